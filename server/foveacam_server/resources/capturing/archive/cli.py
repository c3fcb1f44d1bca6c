"""The commands of `foveacam archive`: list what an archive holds, get an item, open one in place."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.filesize import decimal
from rich.table import Table

from foveacam_hardware.contract import InvalidInput
from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.foundation.settings import checked_settings

if TYPE_CHECKING:
    from foveacam_pipeline.storage.archive import ArchiveRecord

app = typer.Typer(
    name="archive",
    help="Archives of captures, recordings and stills on S3-compatible storage: list, get, open.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

UrlArgument = Annotated[str, typer.Argument(metavar="URL", help="archive: s3://bucket/prefix")]
ItemArgument = Annotated[
    str, typer.Argument(metavar="ID", help="id or name of a capture, a recording or a still")
]
_MB = 1_000_000


@app.command(name="list")
def list_command(url: UrlArgument, as_json: JsonOption = False) -> None:
    """List the items of an archive, newest first."""
    from foveacam_pipeline.storage.archive import list_archive

    records = list_archive(url)
    if as_json:
        typer.echo(json.dumps({"url": url, "items": [_document(record) for record in records]}))
        return
    table = Table(title=url)
    for column in ("kind", "id", "name", "label", "created", "size"):
        table.add_column(column, no_wrap=column in {"id", "created"})  # an id is copied into `get` and `open`
    for record in records:
        manifest = record.manifest
        minute = manifest.created_utc[:16].replace("T", " ")
        size = decimal(manifest.size_bytes)
        row = (manifest.kind, manifest.id, manifest.name, manifest.label, minute, size)
        table.add_row(*(text.replace("[", "\\[") for text in row))
    Console().print(table)


@app.command()
def get(url: UrlArgument, item: ItemArgument, data: DataOption = None, as_json: JsonOption = False) -> None:
    """Fetch a capture, a recording or a still into the data folder; repeat the command to resume."""
    _bring(url, item, data, whole=True, as_json=as_json)


@app.command(name="open")
def open_command(
    url: UrlArgument, item: ItemArgument, data: DataOption = None, as_json: JsonOption = False
) -> None:
    """Add a capture, a recording or a still to the data folder, with its frames left in the archive."""
    _bring(url, item, data, whole=False, as_json=as_json)


def _bring(url: str, wanted: str, data: Path | None, *, whole: bool, as_json: bool) -> None:
    from foveacam_pipeline.capture.archiving import is_large, paths_of, place_of, record_at
    from foveacam_pipeline.storage.archive import fetch_item, write_record
    from foveacam_server.foundation.progress_bar import progress_bar

    record = _found(url, wanted)
    manifest = record.manifest
    place = place_of(manifest, checked_settings({"data": data}).data)
    beside = record_at(manifest, place)
    _check_free(record, place, beside)
    paths = paths_of(manifest, place)
    asked = {name: path for name, path in paths.items() if whole or not is_large(manifest, name)}
    write_record(beside, record)
    with progress_bar(Console(stderr=True), stage=manifest.name, silent=as_json) as bar:
        fetch_item(
            record,
            asked,
            watch=lambda done, total: bar.progress(done // _MB, total=max(1, total // _MB), note="MB"),
        )
    typer.echo(json.dumps({**_document(record), "path": str(place)}) if as_json else str(place))


def _found(url: str, wanted: str) -> "ArchiveRecord":
    """Return the item with an id or a name; raise InvalidInput for none or for several."""
    from foveacam_pipeline.storage.archive import list_archive

    records = list_archive(url)
    found = [record for record in records if record.manifest.id == wanted]
    found = found or [record for record in records if record.manifest.name == wanted]
    if len(found) != 1:
        count = len(found) or "no"
        raise InvalidInput(
            f"{url} holds {count} items {wanted!r}; give an id that `foveacam archive list {url}` shows",
            asked=wanted,
            found=f"{count} items",
        )
    return found[0]


def _check_free(record: "ArchiveRecord", place: Path, beside: Path) -> None:
    """Raise InvalidInput when the item's path is taken by something else."""
    from foveacam_pipeline.storage.archive import read_record

    known = read_record(beside)
    same = known is not None and known.manifest.id == record.manifest.id
    if not same and (place.exists() or beside.exists()):
        raise InvalidInput(
            f"{place} exists already and is something else; give another folder with --data",
            asked=str(place),
            found="it exists already",
        )


def _document(record: "ArchiveRecord") -> dict[str, object]:  # object: JSON for the command line
    manifest = record.manifest
    return {
        "kind": manifest.kind,
        "id": manifest.id,
        "name": manifest.name,
        "label": manifest.label,
        "created_utc": manifest.created_utc,
        "archived_utc": manifest.archived_utc,
        "bytes": manifest.size_bytes,
        "url": record.url,
    }
