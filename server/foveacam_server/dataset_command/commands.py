"""The commands of `foveacam dataset`. A dataset is given by its folder, or by its name in the data folder."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from foveacam_hardware.contract import InvalidInput
from foveacam_server.settings import checked_settings

app = typer.Typer(
    name="dataset",
    help="Datasets on the disk: check, info, export, rectify, pictures, mosaics, references.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

DATASETS = "captures"
"""Where a server keeps them in its data folder."""
STILLS = "stills"
"""And those of one point."""
_FOUND_WRONG = 1

WhichDataset = Annotated[str, typer.Argument(help="folder of a dataset, or its name in the data folder")]
DataOption = Annotated[Path | None, typer.Option(help="folder of targets, clouds, jobs and datasets")]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")]
ScaleOption = Annotated[float, typer.Option(help="scale of the images: 0.5 or 1.0")]


class PictureKind(StrEnum):
    """What a picture shows."""

    SHEET = "sheet"
    COVERAGE = "coverage"
    ANAGLYPH = "anaglyph"


@app.command(name="check")
def check_command(dataset: WhichDataset, data: DataOption = None, as_json: JsonOption = False) -> None:
    """Verify every file, hash, count and row; end with status 1 when something is wrong."""
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
    """Say what a dataset holds."""
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
    to: Annotated[str, typer.Option(help="hugging-face, colmap, nerfstudio or authors")],
    scale: ScaleOption = 1.0,
    seeds: Annotated[int, typer.Option(help="3D points from each pair (colmap, nerfstudio)", min=0)] = 100,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a dataset for another program."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.dataset.export import ExportChoice, export_dataset

    opened = Dataset.open(dataset_folder(dataset, data))
    with _progress(f"export to {to}", len(opened), silent=as_json) as advance:
        choice = ExportChoice(scale=scale, seeds_per_pair=seeds, on_point=advance)
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
    """Keep rectified pairs beside the frames of a dataset."""
    from foveacam_pipeline.capture.dataset import Dataset, RectifyChoice, rectify_dataset

    opened = Dataset.open(dataset_folder(dataset, data))
    total = sum(len(point.brackets) for point in opened)
    with _progress("rectify", total, silent=as_json) as advance:
        choice = RectifyChoice(scale=scale, disparities=disparities)
        pairs = rectify_dataset(opened, choice, on_pair=advance)
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


def dataset_folder(text: str, data: Path | None) -> Path:
    """Return the folder of a dataset that was given by path or by name; whether it is one is seen later."""
    path = Path(text)
    if path.exists() or len(path.parts) != 1:
        return path
    home = checked_settings({"data": data}).data
    kept = home / DATASETS / text
    if not kept.exists() and (home / STILLS / text).exists():
        return home / STILLS / text
    if not kept.exists():
        raise InvalidInput(
            f"there is no dataset {text!r}, neither here nor in {kept.parent}; give its folder"
        )
    return kept


@contextmanager
def _progress(what: str, total: int, *, silent: bool) -> Iterator[Callable[[int], None]]:
    """Yield what moves a bar on by one."""
    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, TextColumn(""), console=Console(stderr=True), disable=silent) as bar:
        task = bar.add_task(what, total=total)
        yield lambda _: bar.advance(task)
