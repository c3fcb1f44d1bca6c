"""The commands `foveacam backup` and `foveacam restore`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.filesize import decimal

from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.settings import checked_settings

if TYPE_CHECKING:
    from foveacam_server.foundation.backup.archive import BackupManifest


def backup(
    archive: Annotated[Path, typer.Argument(help="new file, for instance rig.tar")],
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Copy a server's data directory into one file; the server may be running."""
    from foveacam_server.foundation.backup.archive import back_up
    from foveacam_server.foundation.progress_bar import progress_bar

    folder = checked_settings({"data": data}).data
    with progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar:
        bar.stage("backup")
        manifest = back_up(folder, archive, created_utc=utc_now(), watch=bar)
    _print_manifest(manifest, as_json=as_json, where=f"{folder} -> {archive}")


def restore(
    archive: Annotated[Path, typer.Argument(help="file that `backup` has written")],
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Restore a backup into a new or empty data directory, after a check of all hashes."""
    from foveacam_server.foundation.backup.restore import restore as restore_backup
    from foveacam_server.foundation.progress_bar import progress_bar

    folder = checked_settings({"data": data}).data
    with progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar:
        bar.stage("restore")
        manifest = restore_backup(archive, folder, watch=bar)
    _print_manifest(manifest, as_json=as_json, where=f"{archive} -> {folder}")


def _print_manifest(manifest: "BackupManifest", *, as_json: bool, where: str) -> None:
    size = sum(file.size for file in manifest.files)
    if as_json:
        document = {"files": len(manifest.files), "bytes": size, "created_utc": manifest.created_utc}
        typer.echo(json.dumps(document | {"program": manifest.program}))
        return
    typer.echo(f"{len(manifest.files)} files, {decimal(size)}, of {manifest.created_utc}: {where}")
