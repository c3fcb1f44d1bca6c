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
from foveacam_server.foundation.store import DATABASE, Store, StoreReader
from foveacam_server.resources.captures.schema import CaptureDocument
from foveacam_server.resources.clouds.collection import CLOUDS, CloudCollection
from foveacam_server.resources.fixations.retained import RetainedLooks
from foveacam_server.resources.fixations.table import FixationTable, TargetTable
from foveacam_server.resources.recordings.collection import RECORDINGS, RecordingCollection
from foveacam_server.resources.recordings.documents import recording_document
from foveacam_server.resources.retention.rules import RetentionSource, Sources, look_sources, preview
from foveacam_server.resources.retention.schema import DueItem
from foveacam_server.resources.retention.service import RetentionService
from foveacam_server.resources.stills.collection import STILLS, StillCollection, StillState
from foveacam_server.resources.stills.schema import StillDocument

app = typer.Typer(
    name="retention",
    help="How long captures, recordings, stills, clouds and fixations are kept: rules in retention.toml.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command()
def show(data: DataOption = None, as_json: JsonOption = False) -> None:
    """Say what the rules would remove now, and why; also beside a server that uses the folder."""
    folder = checked_settings({"data": data}).data
    sources = _sources(folder)
    if (folder / DATABASE).exists():
        looks = RetainedLooks(StoreReader(folder), folder / CLOUDS)
        shown = look_sources(looks, remove_cloud=_only_shown, remove_fixation=_only_shown)
        sources = {**sources, **shown}
    found = preview(folder, sources)
    _print(found, found.items, as_json=as_json)


@app.command()
def apply(data: DataOption = None, as_json: JsonOption = False) -> None:
    """Remove what the rules name; a server that uses the folder must have ended."""
    folder = checked_settings({"data": data}).data
    with Store(folder) as store:
        service = RetentionService(folder, {**_sources(folder), **_removable_looks(store)})
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


def _removable_looks(store: Store) -> Sources:
    """Return clouds and fixations of a folder that no server uses."""
    clouds, fixations, targets = CloudCollection(store), FixationTable(store), TargetTable(store)

    def remove_cloud(cloud_id: str) -> None:
        fixation_id = clouds.remove(cloud_id).fixation_id
        fixations.set_cloud(fixation_id, None)
        targets.set_cloud(fixation_id, None)

    def remove_fixation(fixation_id: str) -> None:
        targets.remove_of(fixations.remove(fixation_id))

    looks = RetainedLooks(store, store.subfolder(CLOUDS))
    return look_sources(looks, remove_cloud=remove_cloud, remove_fixation=remove_fixation)


def _only_shown(item_id: str) -> None:
    raise AssertionError(f"{item_id}: nothing is removed where it is shown alone")


def _print(document: ResponseModel, items: list[DueItem], *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(document.as_json()))
        return
    if not items:
        typer.echo("nothing")
        return
    table = Table()
    for column in ("kind", "name", "created", "size", "why", "goes"):
        table.add_column(column)
    for item in items:
        name = item.name.replace("[", "\\[")
        goes = "for good" if item.for_good else "to the trash"
        table.add_row(item.kind, name, item.created_utc, decimal(item.size_bytes), item.why, goes)
    Console().print(table)
