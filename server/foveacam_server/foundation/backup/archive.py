"""Backups of a data directory in one tar file, made while a server may be using it.

The database is copied first by SQLite's own backup, then documents and journals, then all other files. Files
are written before the documents that name them, and are therefore in the backup too. A growing file is copied
at its present length. The manifest with the SHA-256 of every file is the last member: a backup without one
was cut short.
"""

import hashlib
import io
import os
import tarfile
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO, Literal

from pydantic import BaseModel, ConfigDict

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.storage.disk import PART, PRIVATE, disk_errors, part_path, sync_folder
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_server import __version__
from foveacam_server.foundation.database_errors import database_errors
from foveacam_server.foundation.migrate import copy_database, revision_of
from foveacam_server.foundation.store import DATABASE

MANIFEST = "manifest.json"
_MB = 1_000_000
FIRST_SUFFIXES = (".json", ".jsonl", ".toml")
_OWN_TO_ONE_SERVER = (
    "lock", "sign_in.key", "token", "first_admin_link", f"{DATABASE}-wal", f"{DATABASE}-shm", DATABASE
)  # fmt: skip


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class BackedUpFile(_Table):
    """One file: its path below the data directory, size and hash."""

    path: str
    size: int
    sha256: str


class BackupManifest(_Table):
    """The manifest: the content of a backup."""

    format: Literal["foveacam-backup"] = "foveacam-backup"
    version: Literal[1] = 1
    program: str
    """Version of the program that wrote the backup."""
    revision: str | None
    """Revision of the database."""
    created_utc: str
    files: tuple[BackedUpFile, ...]


def back_up(folder: Path, archive: Path, *, created_utc: str, watch: ProgressWatcher) -> BackupManifest:
    """Write a backup of a data directory to a new file that only its owner can read.

    Raise InvalidInput for another folder and for an existing archive, StorageFull for a full disk, Cancelled;
    the unfinished archive is then deleted.
    """
    if not (folder / DATABASE).is_file():
        raise InvalidInput(
            f"{folder} is no data directory of a server: it has no {DATABASE}; name it with --data DIR",
            asked=str(folder),
        )
    if archive.exists():
        raise InvalidInput(f"{archive} exists already; choose another name", asked=str(archive))
    part = part_path(archive)
    with database_errors(folder / DATABASE), disk_errors(f"the backup {archive.name}", archive.parent):
        archive.parent.mkdir(parents=True, exist_ok=True)
        try:
            with part.open("wb") as file:  # replaces an unfinished one
                os.fchmod(file.fileno(), PRIVATE)
                manifest = _write(folder, file, beside=archive.parent, created_utc=created_utc, watch=watch)
                file.flush()
                os.fsync(file.fileno())
            part.replace(archive)
            sync_folder(archive.parent)
        finally:
            part.unlink(missing_ok=True)
    return manifest


def _write(
    folder: Path, file: BinaryIO, *, beside: Path, created_utc: str, watch: ProgressWatcher
) -> BackupManifest:
    with (
        TemporaryDirectory(dir=beside) as place,
        tarfile.open(fileobj=file, mode="w", format=tarfile.PAX_FORMAT) as tar,
    ):
        database = Path(place) / DATABASE
        copy_database(folder / DATABASE, database)
        paths = sorted(_files(folder), key=lambda path: (path.suffix not in FIRST_SUFFIXES, path))
        copying = _Copying(tar, watch, total=database.stat().st_size + sum(map(_size, paths)))
        copying.add(database, DATABASE)
        for path in paths:
            copying.add(path, path.relative_to(folder).as_posix())
        manifest = BackupManifest(
            program=__version__,
            revision=revision_of(database),
            created_utc=created_utc,
            files=tuple(copying.files),
        )
        copying.add_bytes(MANIFEST, manifest.model_dump_json(indent=1).encode())
    return manifest


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files to back up: regular, finished, and not specific to a running server."""
    for parent, _, names in os.walk(folder):
        for name in names:
            path = Path(parent) / name
            temporary = name.startswith(".") and name.endswith(PART)
            own = path.parent == folder and name in _OWN_TO_ONE_SERVER
            if path.is_file() and not path.is_symlink() and not temporary and not own:
                yield path


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


class _Copying:
    def __init__(self, tar: tarfile.TarFile, watch: ProgressWatcher, *, total: int) -> None:
        self._tar, self._watch, self._total = tar, watch, total
        self._done = 0
        self.files: list[BackedUpFile] = []

    def add(self, path: Path, name: str) -> None:
        """Add a file at its present size; one that was deleted meanwhile is left out."""
        try:
            file = path.open("rb")
        except FileNotFoundError:
            return
        with file:
            status = os.fstat(file.fileno())
            member = tarfile.TarInfo(name)
            member.size, member.mtime = status.st_size, int(status.st_mtime)
            hashing = _HashingReader(file, on_bytes=self._advance)
            self._tar.addfile(member, hashing)
        self.files.append(BackedUpFile(path=name, size=member.size, sha256=hashing.digest.hexdigest()))

    def add_bytes(self, name: str, content: bytes) -> None:
        """Add a member from memory."""
        member = tarfile.TarInfo(name)
        member.size = len(content)
        self._tar.addfile(member, io.BytesIO(content))

    def _advance(self, count: int) -> None:
        self._done += count
        report_bytes(self._watch, self._done, self._total)
        if self._watch.cancelled():
            raise Cancelled("the backup was cancelled; nothing of it is kept")


def report_bytes(watch: ProgressWatcher, done: int, total: int) -> None:
    """Report copied bytes as megabytes, at most the total although a file may have grown meanwhile."""
    watch.progress(min(done, total) // _MB, total=max(1, total // _MB), note="MB")


class _HashingReader:
    """Reads a file for `tarfile`, and hashes it on the way."""

    def __init__(self, file: BinaryIO, *, on_bytes: Callable[[int], None]) -> None:
        self._file, self._on_bytes = file, on_bytes
        self.digest = hashlib.sha256()

    def read(self, count: int = -1) -> bytes:
        """Read and hash."""
        found = self._file.read(count)
        self.digest.update(found)
        self._on_bytes(len(found))
        return found
