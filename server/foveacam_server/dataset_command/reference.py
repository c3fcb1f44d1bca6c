"""`foveacam dataset reference`: depth over a rail's long baselines, and how good the short one's is."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from foveacam_server.dataset_command.commands import (
    DataOption,
    JsonOption,
    WhichDataset,
    dataset_folder,
)
from foveacam_server.dataset_command.mosaic import MosaicProgressBar

_CANCELLED = 130
"""What a shell calls the status of a program that Ctrl-C ended."""


def reference(
    dataset: WhichDataset,
    scan: Annotated[
        int | None,
        typer.Option(help="whose depth is judged; without it the scan nearest to the middle", min=0),
    ] = None,
    bracket: Annotated[int, typer.Option(help="which exposure, from 0", min=0)] = 0,
    across: Annotated[int, typer.Option(help="samples over the width of a view", min=2, max=40)] = 10,
    rail_mm: Annotated[
        float, typer.Option(help="standard error of a place on the rail, mm; 0: exact", min=0.0, max=50.0)
    ] = 0.1,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the depth of a scan with triangulation over the scans from other places on the rail."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.reference import (
        RailTrust,
        ReferenceSettings,
        build_reference,
        write_reference,
    )

    rail = RailTrust(along_m=1e-3 * rail_mm)
    settings = ReferenceSettings(scan=scan, bracket=bracket, across=across, rail=rail)
    opened = Dataset.open(dataset_folder(dataset, data))
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), disable=as_json) as bar:
        watch = MosaicProgressBar(bar, bar.add_task("reference", total=None))
        try:
            made = build_reference(opened, settings, watch=watch)
        except KeyboardInterrupt:
            typer.echo("ended; nothing was written", err=True)
            raise typer.Exit(_CANCELLED) from None
    folder = write_reference(opened.folder, made)
    figures = made.figures
    if as_json:
        typer.echo(json.dumps({"folder": str(folder), **asdict(figures)}))
        return
    found = figures.comparison
    typer.echo(
        f"{folder}: {figures.referenced} of {figures.samples} samples over {1e3 * figures.baseline_m:.0f} mm "
        f"(median; stated error {found.stated_sigma_rel:.3%}); the rig's "
        f"{1e3 * figures.short_baseline_m:.0f} mm are off it by {found.rms_rel:.3%} rms, bias "
        f"{found.bias_rel:+.3%}"
    )
