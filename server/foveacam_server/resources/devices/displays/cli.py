"""The command `foveacam board charuco|checkerboard|markers|marker [--paper A4] [--output FILE]`."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from foveacam_hardware.contract import InvalidInput
from foveacam_server.commands.options import JsonOption, parse_pair
from foveacam_server.foundation.plain_words import validated
from foveacam_server.foundation.settings import checked_settings

app = typer.Typer(
    name="board",
    help="Calibration boards and markers to print, as PDF at true size.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

SquaresOption = Annotated[str, typer.Option(help="squares of the board, such as 7x5: one more than corners")]
SquareOption = Annotated[float, typer.Option(help="side of a square, mm")]
SideOption = Annotated[float, typer.Option(help="side of a marker's black square, mm")]
PaperOption = Annotated[str, typer.Option(help="A4, A3 or Letter; turned as the pattern needs it")]
MarginOption = Annotated[float, typer.Option(help="white on all sides of the paper, mm")]
OutputOption = Annotated[
    Path | None, typer.Option("--output", "-o", help="file to write; usually the pattern's name, .pdf")
]


@app.command()
def charuco(
    *,
    squares: SquaresOption = "7x5",
    square_mm: SquareOption = 30.0,
    marker_mm: Annotated[
        float | None, typer.Option(help="side of a marker, mm; usually three quarters of a square")
    ] = None,
    dictionary: Annotated[
        str, typer.Option(help="of the markers; `foveacam calibrate` takes the same")
    ] = "4X4_50",
    paper: PaperOption = "A4",
    margin_mm: MarginOption = 8.0,
    output: OutputOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print a ChArUco board."""
    marker_mm = 0.75 * square_mm if marker_mm is None else marker_mm
    pattern = {"kind": "charuco", **_corners(squares), "square_mm": square_mm, "marker_mm": marker_mm}
    page = {"dictionary": dictionary, "paper": paper, "margin_mm": margin_mm}
    _write(pattern, page, output=output, as_json=as_json)


@app.command()
def checkerboard(
    *,
    squares: SquaresOption = "10x7",
    square_mm: SquareOption = 25.0,
    paper: PaperOption = "A4",
    margin_mm: MarginOption = 8.0,
    output: OutputOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print a checkerboard."""
    pattern = {"kind": "checkerboard", **_corners(squares), "square_mm": square_mm}
    _write(pattern, {"paper": paper, "margin_mm": margin_mm}, output=output, as_json=as_json)


@app.command()
def markers(
    *,
    side_mm: SideOption = 60.0,
    spacing_mm: Annotated[
        float | None,
        typer.Option(help="from the middle marker to either other, mm; usually half the rig's baseline"),
    ] = None,
    rig: Annotated[str | None, typer.Option(help="'sim', or the path of a rig file (.toml)")] = None,
    paper: PaperOption = "A4",
    margin_mm: MarginOption = 8.0,
    output: OutputOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print the mirrors' three markers, from left to right 1, 0 and 2."""
    from foveacam_server.commands.rig import RigChoice

    if spacing_mm is None:
        spacing_mm = 500.0 * RigChoice(settings=checked_settings({"rig": rig})).baseline_m
    pattern = {"kind": "markers", "side_mm": side_mm, "spacing_mm": spacing_mm}
    _write(pattern, {"paper": paper, "margin_mm": margin_mm}, output=output, as_json=as_json)


@app.command()
def marker(
    *,
    marker_id: Annotated[int, typer.Option("--id", help="of the dictionary 4X4_50")] = 0,
    side_mm: SideOption = 60.0,
    paper: PaperOption = "A4",
    margin_mm: MarginOption = 8.0,
    output: OutputOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print one marker."""
    pattern = {"kind": "marker", "id": marker_id, "side_mm": side_mm}
    _write(pattern, {"paper": paper, "margin_mm": margin_mm}, output=output, as_json=as_json)


def _corners(squares: str) -> Mapping[str, int]:
    """Return the inner corners of `7x5` squares."""
    size = parse_pair(squares, option="--squares", example="7x5")
    if size is None or min(size) < 4:
        raise InvalidInput(f"--squares {squares}: at least 4x4 squares are needed; give more of them")
    return {"columns": size[0] - 1, "rows": size[1] - 1}


def _write(
    pattern: Mapping[str, object], page: Mapping[str, object], *, output: Path | None, as_json: bool
) -> None:
    """Write the PDF, and print its description."""
    from foveacam_pipeline.storage.disk import disk_errors, write_file
    from foveacam_server.resources.devices.displays.printing import print_pattern
    from foveacam_server.resources.devices.displays.schema import PrintQuery, StoredPattern

    asked = validated(StoredPattern, {"pattern": pattern}).pattern
    printed = print_pattern(asked, validated(PrintQuery, page))
    path = output or Path(printed.file_name)
    with disk_errors("the print of the pattern", path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, printed.content)
    if as_json:
        found = {"file": str(path), "description": printed.description, "sheets": printed.sheets}
        typer.echo(json.dumps(found))
        return
    typer.echo(f"{path}: {printed.description}; {printed.sheets}")
    typer.echo("Print it at 100 % and measure the ruler beside it.")
