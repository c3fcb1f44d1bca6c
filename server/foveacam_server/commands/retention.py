"""The commands `foveacam retention show` and `foveacam retention apply`."""

import json
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.filesize import decimal
from rich.table import Table

from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.foundation.settings import checked_settings

if TYPE_CHECKING:
    from foveacam_server.foundation.schema import ResponseModel
    from foveacam_server.resources.capturing.retention.schema import DueItem

app = typer.Typer(
    name="retention",
    help="How long captures, recordings, stills, clouds, fixations, exports are kept: retention.toml.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command()
def show(data: DataOption = None, as_json: JsonOption = False) -> None:
    """List what the rules would remove now, with reasons; also while a server uses the folder."""
    from foveacam_server.commands.retention_items import due_items

    found = due_items(checked_settings({"data": data}).data)
    _print(found, found.items, as_json=as_json)


@app.command()
def apply(data: DataOption = None, as_json: JsonOption = False) -> None:
    """Apply the rules; no server may be using the folder."""
    from foveacam_server.commands.retention_items import remove_due_items

    moved = remove_due_items(checked_settings({"data": data}).data)
    _print(moved, moved.items, as_json=as_json)


def _print(document: "ResponseModel", items: "list[DueItem]", *, as_json: bool) -> None:
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
