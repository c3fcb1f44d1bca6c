"""`foveacam dataset mosaic`: all foveae of a scan as one picture, its depth and its points."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from foveacam_hardware.contract import Cancelled, InvalidInput, Role
from foveacam_server.dataset_command.commands import (
    DataOption,
    JsonOption,
    WhichDataset,
    dataset_folder,
)

if TYPE_CHECKING:
    from foveacam_pipeline.capture.mosaic.values import MosaicFigures

_CANCELLED = 130
"""What a shell calls the status of a program that Ctrl-C ended."""


class MosaicProgressBar:
    """Shows a mosaic's progress as a bar."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        self._bar, self._task = bar, task

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Move the bar."""
        self._bar.update(self._task, completed=done, total=total, description=note)

    def cancelled(self) -> bool:
        """Go on: Ctrl-C ends it."""
        return False


def mosaic(
    dataset: WhichDataset,
    output: Annotated[Path, typer.Argument(help="folder to make, or one that was begun, to go on with")],
    eye: Annotated[str, typer.Option(help="whose picture: left or right")] = "left",
    scan: Annotated[int, typer.Option(help="which scan, from 0", min=0)] = 0,
    bracket: Annotated[int, typer.Option(help="which exposure, from 0", min=0)] = 0,
    quality: Annotated[int, typer.Option(help="quality of the JPEG tiles", min=1, max=100)] = 90,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Lay all foveae of a scan side by side: Deep Zoom picture, depth, cloud and mesh. Ctrl-C may end it."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.mosaic.build import build_mosaic
    from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
    from foveacam_pipeline.capture.mosaic.folder import finite
    from foveacam_pipeline.capture.mosaic.values import MosaicSettings
    from foveacam_web.glb import write_glb

    if eye not in (Role.LEFT.value, Role.RIGHT.value):
        raise InvalidInput(f"a mosaic of the {eye!r} eye was asked for; choose left or right")
    settings = MosaicSettings(scan=scan, eye=Role(eye), bracket=bracket, quality=quality)
    opened = Dataset.open(dataset_folder(dataset, data))
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), disable=as_json) as bar:
        watch = MosaicProgressBar(bar, bar.add_task("mosaic", total=None))
        try:
            made = build_mosaic(
                opened, output, settings, watch=watch, mesh_file=lambda mesh: write_glb(mesh, y_up=True)
            )
            write_depth_tiles(output, made.placed.depth.z_m)
        except (KeyboardInterrupt, Cancelled):
            typer.echo(f"ended; the same command goes on with {output}", err=True)
            raise typer.Exit(_CANCELLED) from None
    if as_json:
        document = {"folder": str(output), **asdict(made.figures)}
        typer.echo(json.dumps(finite(document), allow_nan=False))
        return
    typer.echo(f"{output}: {_words(made.figures)}")


def _words(figures: "MosaicFigures") -> str:
    seams = figures.seams
    told = f"seams {seams.after_rms_px:.2f} px rms ({seams.before_rms_px:.2f} before the adjustment)"
    if math.isnan(seams.after_rms_px):
        told = "no overlap in which a seam could be measured"
    return (
        f"{figures.width} x {figures.height} px from {figures.views} "
        f"{'fovea' if figures.views == 1 else 'foveae'}, {told}, depth of {figures.depth.known:.0%}"
    )
