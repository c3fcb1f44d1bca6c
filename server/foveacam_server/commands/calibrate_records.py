"""`foveacam calibrate list, use, report, export, import, discard, restore, combine, residuals`.

All but `use` run beside a server.
"""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import InvalidInput
from foveacam_server.commands.options import (
    DataOption,
    JsonOption,
    RigOptions,
    on_rig,
)
from foveacam_server.foundation.settings import checked_settings

app = typer.Typer(add_completion=False)

WhichOne = Annotated[str, typer.Argument(help="id of a calibration, or its beginning; `current`: in force")]
FormatOption = Annotated[str, typer.Option("--format", help="foveacam, or authors (with the poses)")]
ROOM = "calibration"


@app.command(name="list")
def list_all(data: DataOption = None, as_json: JsonOption = False) -> None:
    """List all calibrations, newest first."""
    from foveacam_server.commands.calibration_data import CalibrationData

    records = CalibrationData(checked_settings({"data": data}).data)
    documents = [records.describe(calibration) for calibration in records.every()]
    if as_json:
        typer.echo(json.dumps([found.as_json() for found in documents]))
        return
    table = Table(title=f"calibrations in {records.folder}")
    table.add_column("id", no_wrap=True)
    for title in ("rig", "label", "origin", "created", "in force"):
        table.add_column(title, overflow="fold")
    for found in documents:
        created = found.created_utc[:16].replace("T", " ")
        row = (found.id, found.rig_id, found.label, found.origin, created)
        table.add_row(*(cell.replace("[", "\\[") for cell in row), "yes" if found.current else "")
    Console().print(table)


@app.command()
@on_rig(usual_scene=ROOM)
def use(rig_options: RigOptions, *, calibration: WhichOne) -> None:
    """Put a calibration in force."""
    from foveacam_server.commands.calibration_data import CalibrationData, open_data
    from foveacam_server.commands.rig import RigChoice

    wanted = CalibrationData(rig_options.settings.data).find(calibration)
    with open_data(RigChoice.of(rig_options), lock=True) as data:
        data.calibration.activate(wanted.id)
    typer.echo(
        json.dumps({"id": wanted.id}) if rig_options.as_json else f"{wanted.id} ({wanted.label}) is in force"
    )


@app.command()
def report(
    calibration: WhichOne = "current",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="file to write")] = None,
    data: DataOption = None,
) -> None:
    """Write a calibration's report as one HTML page: measured values beside the paper's."""
    from foveacam_server.commands.calibration_data import CalibrationData
    from foveacam_server.resources.calibrating.calibrations.reports import report_page
    from foveacam_server.resources.calibrating.sessions.descriptions import SessionReader

    records = CalibrationData(checked_settings({"data": data}).data)
    found = records.find(calibration)
    path = output or Path(f"calibration-{found.id}.html")
    path.write_text(
        report_page(
            found,
            sessions=SessionReader(records.sessions),
            drift=records.drift,
            acceptances=records.acceptances,
        ),
        encoding="utf-8",
    )
    typer.echo(str(path))


@app.command()
def export(
    calibration: WhichOne,
    output: Annotated[Path, typer.Argument(help="file to write; it must not exist")],
    file_format: FormatOption = "foveacam",
    data: DataOption = None,
) -> None:
    """Write a calibration to a file."""
    from foveacam_pipeline.calibrate.records.new_file import write_new
    from foveacam_server.commands.calibration_data import CalibrationData
    from foveacam_server.resources.calibrating.calibrations.record_files import export_bytes, known_format
    from foveacam_server.resources.calibrating.sessions.descriptions import SessionReader

    records = CalibrationData(checked_settings({"data": data}).data)
    found = records.find(calibration)
    write_new(
        output, export_bytes(found, known_format(file_format), sessions=SessionReader(records.sessions))
    )
    typer.echo(str(output))


@app.command(name="import")
@on_rig(usual_scene=ROOM)
def import_file(
    rig_options: RigOptions,
    *,
    file: Annotated[Path, typer.Argument(help="calibration file, or the authors' device bundle")],
    distance_m: Annotated[
        float | None, typer.Option(help="distance of the markers, which a bundle lacks", min=0.1)
    ] = None,
) -> None:
    """Store the calibration of a file; `use` puts it in force."""
    from foveacam_server.commands.calibration_data import CalibrationData
    from foveacam_server.commands.rig import RigChoice
    from foveacam_server.resources.calibrating.calibrations.record_files import ImportFacts, calibration_of

    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInput(f"there is no file {file}; give the path of a calibration file") from error
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{file} cannot be read as JSON ({error}); export it again") from error
    facts = ImportFacts(rig_id=RigChoice.of(rig_options).rig_id, distance_m=distance_m)
    records = CalibrationData(rig_options.settings.data)
    imported = calibration_of(content, facts)
    records.add(imported)
    found = records.describe(imported)
    if rig_options.as_json:
        typer.echo(json.dumps(found.as_json()))
        return
    how = "and in force" if found.current else f"put it in force with `foveacam calibrate use {found.id}`"
    typer.echo(f"{found.id} ({found.label}) is kept, {how}")


@app.command()
def discard(calibration: WhichOne, data: DataOption = None) -> None:
    """Move a calibration to the trash; `restore` brings it back."""
    from foveacam_server.commands.calibration_data import CalibrationData

    records = CalibrationData(checked_settings({"data": data}).data)
    found = records.find(calibration)
    records.discard(found)
    typer.echo(
        f"{found.id} ({found.label}) is in the trash; `foveacam calibrate restore {found.id}` undoes it"
    )


@app.command()
def restore(
    calibration: Annotated[str, typer.Argument(help="id of a discarded calibration, or its beginning")],
    data: DataOption = None,
) -> None:
    """Restore a calibration from the trash."""
    from foveacam_server.commands.calibration_data import CalibrationData

    found = CalibrationData(checked_settings({"data": data}).data).restore(calibration)
    typer.echo(f"{found.id} ({found.label}) is kept again")


@app.command()
def combine(
    session: Annotated[list[str], typer.Argument(help="ids of sessions of one rig, two or more")],
    label: Annotated[str | None, typer.Option(help="name for people")] = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Combine the sweeps of several sessions into one, to be fitted jointly."""
    from foveacam_server.commands.calibration_data import CalibrationData

    made = CalibrationData(checked_settings({"data": data}).data).sessions.combine(session, label=label)
    if as_json:
        typer.echo(json.dumps({"id": made.id, "label": made.head.label}))
        return
    typer.echo(f"{made.id}: {made.head.label}; fit it with `foveacam calibrate rectify --session {made.id}`")


@app.command()
def residuals(
    file: Annotated[Path, typer.Argument(help="JSON: left and right, each with volts and angles_deg")],
    as_json: JsonOption = False,
) -> None:
    """Show the causes of a mirror sweep's residuals: rounding, the scan, the target's pose, the mirrors."""
    from foveacam_server.commands.calibrate_residuals import figures_of_file

    figures = figures_of_file(file)
    if as_json:
        typer.echo(json.dumps(figures))
        return
    table = Table("figure", "value", title=f"residuals of {file.name}".replace("[", "\\["))
    for name, value in figures.items():
        table.add_row(name, json.dumps(value).replace("[", "\\["))
    Console().print(table)
