"""The commands `foveacam retention show` and `foveacam retention apply`."""

import json
from pathlib import Path

import typer
from rich.console import Console
from rich.filesize import decimal
from rich.table import Table

from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.datasets.collection import CAPTURES, CaptureCollection
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.foundation.settings import checked_settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.captures.schema import CaptureDocument
from foveacam_server.resources.recordings.collection import RECORDINGS, RecordingCollection
from foveacam_server.resources.recordings.documents import recording_document
from foveacam_server.resources.retention.rules import RetentionSource, Sources, preview
from foveacam_server.resources.retention.schema import DueItem
from foveacam_server.resources.retention.service import RetentionService
from foveacam_server.resources.stills.collection import STILLS, StillCollection, StillState
from foveacam_server.resources.stills.schema import StillDocument

app = typer.Typer(
    name="retention",
    help="How long captures, recordings and stills are kept: rules in retention.toml of the data folder.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command()
def show(data: DataOption = None, as_json: JsonOption = False) -> None:
    """Say what the rules would move to the trash now, and why."""
    folder = checked_settings({"data": data}).data
    found = preview(folder, _sources(folder))
    _print(found, found.items, as_json=as_json)


@app.command()
def apply(data: DataOption = None, as_json: JsonOption = False) -> None:
    """Move to the trash what the rules name; a server that uses the folder must have ended."""
    folder = checked_settings({"data": data}).data
    with Store(folder):
        service = RetentionService(folder, _sources(folder))
        moved = service.apply(service.preview().digest)
    _print(moved, moved.items, as_json=as_json)


def _sources(data: Path) -> Sources:
    captures = CaptureCollection(data / CAPTURES)
    recordings = RecordingCollection(data / RECORDINGS)
    stills = StillCollection(data / STILLS)
    return {
        "captures": RetentionSource(
            every=lambda: [CaptureDocument.of(stored) for stored in captures.every()],
            in_use=lambda capture_id: is_being_written(captures.get(capture_id).folder),
            remove=captures.remove,
        ),
        "recordings": RetentionSource(
            every=lambda: [recording_document(stored) for stored in recordings.every()],
            in_use=lambda recording_id: False,  # a server that records has the folder's lock
            remove=lambda recording_id: recordings.remove(recordings.get(recording_id)),
        ),
        "stills": RetentionSource(
            every=lambda: [StillDocument.of(still) for still in stills.every(StillState.KEPT)],
            in_use=lambda still_id: is_being_written(stills.get(still_id).stored.folder),
            remove=stills.remove,
        ),
    }


def _print(document: ResponseModel, items: list[DueItem], *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(document.as_json()))
        return
    if not items:
        typer.echo("nothing")
        return
    table = Table()
    for column in ("kind", "name", "created", "size", "why"):
        table.add_column(column)
    for item in items:
        name = item.name.replace("[", "\\[")
        table.add_row(item.kind, name, item.created_utc, decimal(item.size_bytes), item.why)
    Console().print(table)
