"""Manifest of an archived item (`ArchiveManifest`), and the local record of it (`ArchiveRecord`).

`SparseCopy` is a local copy of an archived file whose ranges are fetched when they are needed.
"""

import hashlib
import logging
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO, Annotated, Literal
from urllib.parse import quote

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue, ValidationError

from foveacam_hardware.contract import DeviceFault, InvalidInput
from foveacam_pipeline.storage.archive.store import open_store
from foveacam_pipeline.storage.disk import disk_errors, write_file

_log = logging.getLogger(__name__)

MANIFEST = "manifest.json"
RECORD = "archived.json"
"""The record's name in a dataset's folder; beside a recording it follows the recording's own name."""
ItemKind = Literal["captures", "recordings", "stills"]
BLOCK_BYTES = 1 << 15


def _inside(name: str) -> str:
    if any(part in ("", ".", "..") for part in name.split("/")) or "\0" in name:
        raise ValueError(f"{name!r} is no file below the item's folder")
    return name


FileName = Annotated[str, AfterValidator(_inside)]
"""A file's name in its item, with folders; it never leads out of the item's folder."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ArchivedFile(_Table):
    """One file: its size and hash."""

    size_bytes: Annotated[int, Field(ge=0)]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class ArchiveManifest(_Table):
    """Manifest of an archived dataset, recording or still; `created_utc`: of the item itself.

    `about`: metadata that is shown without reading its files.
    """

    format: Literal["foveacam-archive"] = "foveacam-archive"
    version: Literal[1] = 1
    kind: ItemKind
    id: Annotated[str, Field(min_length=1, max_length=255)]
    name: Annotated[str, Field(min_length=1, max_length=255, pattern=r"^[^/\x00]+$")]
    label: str = ""
    created_utc: str = ""
    archived_utc: str
    about: dict[str, JsonValue] = {}
    files: dict[FileName, ArchivedFile]

    @property
    def size_bytes(self) -> int:
        """Bytes of all files."""
        return sum(file.size_bytes for file in self.files.values())

    @property
    def folder(self) -> str:
        """Where the item lies below the archive's URL."""
        return item_folder(self.kind, self.id)

    def key(self, name: str) -> str:
        """Return the object of a file; raise InvalidInput for a file that is not part of the item."""
        file = self.files.get(name)
        if file is None:
            raise InvalidInput(f"{self.kind} {self.id}: its archive has no file {name!r}; archive it again")
        return f"{self.folder}/{file.sha256}/{name.rpartition('/')[2]}"


class ArchiveRecord(_Table):
    """Local record of an archived dataset, recording or still: the archive's URL and the manifest."""

    format: Literal["foveacam-archived"] = "foveacam-archived"
    version: Literal[1] = 1
    archive: str
    manifest: ArchiveManifest

    @property
    def url(self) -> str:
        """The item's own URL."""
        return f"{self.archive}/{self.manifest.folder}"

    def read(self, name: str) -> bytes:
        """Return a whole file; raise DeviceFault for one that is not what was archived."""
        content = open_store(self.archive).read(self.manifest.key(name))
        if hashlib.sha256(content).hexdigest() != self.manifest.files[name].sha256:
            raise mismatch(name, self.url)
        return content


def mismatch(name: str, url: str) -> DeviceFault:
    """Return the error for a file whose content has another hash than its manifest."""
    found, remedy = "its content is not what was archived (SHA-256)", "archive it again from a copy"
    return DeviceFault(f"reading {name} in {url}: {found}", asked=name, found=found, remedy=remedy)


def item_folder(kind: str, item_id: str) -> str:
    """Return where an item lies below the archive's URL."""
    safe = quote(item_id, safe=" ()")
    return f"{kind}/{safe.replace('.', '%2E', 1) if safe.startswith('.') else safe}"


def parse_manifest(content: bytes, *, what: str) -> ArchiveManifest:
    """Return a manifest; raise InvalidInput for anything else."""
    try:
        return ArchiveManifest.model_validate_json(content)
    except ValidationError as error:
        raise InvalidInput(f"{what}: that is no manifest of an archive; archive the item again") from error


def write_record(path: Path, record: ArchiveRecord) -> None:
    """Write the record of an archived item; raise as `disk_errors`."""
    with disk_errors(f"the record {path.name}", path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, record.model_dump_json(indent=1).encode())


def read_record(path: Path) -> ArchiveRecord | None:
    """Return a record; None where there is none that can be read."""
    try:
        status = path.stat()
    except OSError:
        return None
    return _read(path, (status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=256)
def _read(path: Path, stamp: tuple[int, int]) -> ArchiveRecord | None:
    try:
        return ArchiveRecord.model_validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        _log.warning("%s is passed over, so its item counts as not archived: %s", path, error)
        return None


def read_stored(folder: Path, name: str) -> bytes:
    """Return a file of a folder, from the folder's archive where it is not on the disk.

    Raise OSError for one that is in neither, FoveaError for an archive that cannot be read.
    """
    try:
        return (folder / name).read_bytes()
    except FileNotFoundError:
        record = read_record(folder / RECORD)
        if record is None or name not in record.manifest.files:
            raise
        return record.read(name)


class SparseCopy:
    """A temporary file as long as the archived one; `fetch` fills a range of it. For one thread at a time."""

    def __init__(self, record: ArchiveRecord, name: str) -> None:
        self._store, self._key = open_store(record.archive), record.manifest.key(name)
        self._size = record.manifest.files[name].size_bytes
        self._missing = bytearray(b"\x01" * -(-self._size // BLOCK_BYTES))
        self.file: IO[bytes] = TemporaryFile()  # noqa: SIM115 - its user closes it
        self.file.truncate(self._size)

    def fetch(self, start: int, end: int) -> None:
        """Fill the bytes from `start` to before `end`, in as few reads as possible; raise FoveaError."""
        last = min(-(-min(end, self._size) // BLOCK_BYTES), len(self._missing))
        at = max(0, start) // BLOCK_BYTES
        while (at := self._missing.find(1, at, last)) >= 0:
            until = self._missing.find(0, at, last)
            until = last if until < 0 else until
            low, high = at * BLOCK_BYTES, min(until * BLOCK_BYTES, self._size)
            content = self._store.read(self._key, start=low, end=high)
            with disk_errors("what was read of an archive", Path(gettempdir())):
                self.file.seek(low)
                self.file.write(content)
                self.file.flush()
            self._missing[at:until] = bytes(until - at)
            at = until
