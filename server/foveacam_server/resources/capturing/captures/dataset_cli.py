"""The commands of `foveacam dataset`; a dataset is given by its folder or by its name in the data folder."""

import json
import math
from dataclasses import asdict
from enum import StrEnum
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import Cancelled, InvalidInput, Role
from foveacam_server.datasets.given_folder import dataset_folder

if TYPE_CHECKING:
    from foveacam_pipeline.capture.mosaic.values import MosaicFigures

app = typer.Typer(
    name="dataset",
    help="Datasets on the disk: check, info, export, rectify, pictures, mosaics, references.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_FOUND_WRONG = 1
_CANCELLED = 130
"""Exit status of a program that Ctrl-C ended."""

WhichDataset = Annotated[str, typer.Argument(help="folder of a dataset, or its name in the data folder")]
DataOption = Annotated[Path | None, typer.Option(help="folder of targets, clouds, jobs and datasets")]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")]
ScaleOption = Annotated[float, typer.Option(help="scale of the images: 0.5 or 1.0")]


class PictureKind(StrEnum):
    """Kinds of pictures of a dataset."""

    SHEET = "sheet"
    COVERAGE = "coverage"
    ANAGLYPH = "anaglyph"


@app.command(name="check")
def check_command(dataset: WhichDataset, data: DataOption = None, as_json: JsonOption = False) -> None:
    """Verify every file, hash, count and row; exit with 1 when something is wrong."""
    from foveacam_pipeline.capture.dataset import check_dataset

    folder = dataset_folder(dataset, data)
    findings = check_dataset(folder)
    if as_json:
        typer.echo(json.dumps({"dataset": str(folder), "good": not findings, "findings": findings}))
    else:
        typer.echo("\n".join(findings) or f"{folder} is as it was written")
    if findings:
        raise typer.Exit(_FOUND_WRONG)


@app.command(name="info")
def info_command(dataset: WhichDataset, data: DataOption = None, as_json: JsonOption = False) -> None:
    """Describe the content of a dataset."""
    from foveacam_pipeline.capture.dataset import dataset_info

    found = asdict(dataset_info(dataset_folder(dataset, data)))
    if as_json:
        typer.echo(json.dumps(found))
        return
    table = Table(title=found["name"], show_header=False)
    for key, value in found.items():
        shown = json.dumps(value, ensure_ascii=False) if isinstance(value, dict) else str(value)
        table.add_row(key, shown.replace("[", "\\["))
    Console().print(table)


@app.command()
def export(
    dataset: WhichDataset,
    output: Annotated[Path, typer.Argument(help="folder to make; it must not exist")],
    to: Annotated[str, typer.Option(help="hugging-face, colmap, nerfstudio, ome-zarr or authors")],
    scale: ScaleOption = 1.0,
    seeds: Annotated[int, typer.Option(help="3D points from each pair (colmap, nerfstudio)", min=0)] = 100,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Export a dataset in another program's format."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.dataset.export import ExportChoice, export_dataset
    from foveacam_server.foundation.progress_bar import progress_bar

    opened = Dataset.open(dataset_folder(dataset, data))
    with progress_bar(Console(stderr=True), stage=f"export to {to}", silent=as_json) as bar:
        done = count(1)
        choice = ExportChoice(
            scale=scale,
            seeds_per_pair=seeds,
            on_point=lambda _: bar.progress(next(done), total=len(opened)),
        )
        export_dataset(opened, output, to=to, choice=choice)
    typer.echo(json.dumps({"folder": str(output), "points": len(opened)}) if as_json else str(output))


@app.command()
def rectify(
    dataset: WhichDataset,
    scale: ScaleOption = 0.5,
    disparities: Annotated[bool, typer.Option(help="also keep the signed residual disparities")] = True,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Store rectified pairs beside the frames of a dataset."""
    from foveacam_pipeline.capture.dataset import Dataset, RectifyChoice, rectify_dataset
    from foveacam_server.foundation.progress_bar import progress_bar

    opened = Dataset.open(dataset_folder(dataset, data))
    total = sum(len(point.brackets) for point in opened)
    with progress_bar(Console(stderr=True), stage="rectify", silent=as_json) as bar:
        done = count(1)
        choice = RectifyChoice(scale=scale, disparities=disparities)
        pairs = rectify_dataset(opened, choice, on_pair=lambda _: bar.progress(next(done), total=total))
    folder = opened.folder / "rectified"
    typer.echo(
        json.dumps({"folder": str(folder), "pairs": pairs}) if as_json else f"{pairs} pairs in {folder}"
    )


@app.command()
def picture(
    dataset: WhichDataset,
    output: Annotated[Path, typer.Argument(help="PNG file to write")],
    kind: Annotated[
        PictureKind, typer.Option(help="all left foveae, what they cover, or one pair in red and cyan")
    ] = (PictureKind.SHEET),
    position: Annotated[int, typer.Option(help="which point, from 0, of an anaglyph", min=0)] = 0,
    data: DataOption = None,
) -> None:
    """Draw a dataset as one picture."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.dataset.pictures import (
        contact_sheet,
        coverage_picture,
        png_bytes,
        point_anaglyph,
    )
    from foveacam_pipeline.storage.disk import disk_errors, write_file

    opened = Dataset.open(dataset_folder(dataset, data))
    if kind is PictureKind.ANAGLYPH and position >= len(opened):
        raise InvalidInput(f"point {position} was asked for, {opened.folder} has {len(opened)}; count from 0")
    drawn = {
        PictureKind.SHEET: lambda: contact_sheet(opened),
        PictureKind.COVERAGE: lambda: coverage_picture(opened),
        PictureKind.ANAGLYPH: lambda: point_anaglyph(opened[position]),
    }[kind]()
    with disk_errors("the picture", output.parent):
        write_file(output, memoryview(png_bytes(drawn)))
    typer.echo(str(output))


@app.command()
def mosaic(
    dataset: WhichDataset,
    output: Annotated[Path, typer.Argument(help="folder to make, or an unfinished one to resume")],
    eye: Annotated[str, typer.Option(help="whose picture: left or right")] = "left",
    scan: Annotated[int, typer.Option(help="which scan, from 0", min=0)] = 0,
    bracket: Annotated[int, typer.Option(help="index of the exposure, from 0", min=0)] = 0,
    quality: Annotated[int, typer.Option(help="quality of the JPEG tiles", min=1, max=100)] = 90,
    network: Annotated[
        str | None,
        typer.Option(help="depth backend of pairs: foveal, or the card of another network (YAML)"),
    ] = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the mosaic of a scan: Deep Zoom picture, depth, cloud and mesh.

    Ctrl-C ends it; repeat to resume.
    """
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.mosaic.build import build_mosaic
    from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
    from foveacam_pipeline.capture.mosaic.folder import finite
    from foveacam_pipeline.capture.mosaic.values import MosaicSettings
    from foveacam_pipeline.networks.card import find_network
    from foveacam_server.foundation.progress_bar import progress_bar
    from foveacam_web.glb import write_glb

    if eye not in (Role.LEFT.value, Role.RIGHT.value):
        raise InvalidInput(f"a mosaic of the {eye!r} eye was asked for; choose left or right")
    settings = MosaicSettings(
        scan=scan,
        eye=Role(eye),
        bracket=bracket,
        quality=quality,
        network=None if network is None else find_network(network),
    )
    opened = Dataset.open(dataset_folder(dataset, data))
    with progress_bar(Console(stderr=True), stage="mosaic", silent=as_json) as bar:
        try:
            made = build_mosaic(
                opened, output, settings, watch=bar, mesh_file=lambda mesh: write_glb(mesh, y_up=True)
            )
            write_depth_tiles(output, made.placed.depth.z_m)
        except (KeyboardInterrupt, Cancelled):
            typer.echo(f"ended; the same command goes on with {output}", err=True)
            raise typer.Exit(_CANCELLED) from None
    if as_json:
        document = {"folder": str(output), **asdict(made.figures)}
        typer.echo(json.dumps(finite(document), allow_nan=False))
        return
    typer.echo(f"{output}: {_mosaic_words(made.figures)}")


def _mosaic_words(figures: "MosaicFigures") -> str:
    seams = figures.seams
    seam_words = f"seams {seams.after_rms_px:.2f} px rms ({seams.before_rms_px:.2f} before the adjustment)"
    if math.isnan(seams.after_rms_px):
        seam_words = "no overlap in which a seam could be measured"
    matching = figures.matching
    failed = f" ({matching.failed_pairs} pairs, on which it failed, by sgbm)" if matching.failed_pairs else ""
    return (
        f"{figures.width} x {figures.height} px from {figures.views} "
        f"{'fovea' if figures.views == 1 else 'foveae'}, {seam_words}, depth of {figures.depth.known:.0%} "
        f"by {matching.backend}{failed}"
    )


@app.command()
def reference(
    dataset: WhichDataset,
    scan: Annotated[
        int | None,
        typer.Option(help="scan whose depth is evaluated; without it the one nearest to the middle", min=0),
    ] = None,
    bracket: Annotated[int, typer.Option(help="index of the exposure, from 0", min=0)] = 0,
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
    from foveacam_pipeline.diagrams import check_figures
    from foveacam_server.foundation.progress_bar import progress_bar

    check_figures("a reference with its diagram")
    rail = RailTrust(along_m=1e-3 * rail_mm)
    settings = ReferenceSettings(scan=scan, bracket=bracket, across=across, rail=rail)
    opened = Dataset.open(dataset_folder(dataset, data))
    with progress_bar(Console(stderr=True), stage="reference", silent=as_json) as bar:
        try:
            made = build_reference(opened, settings, watch=bar)
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
