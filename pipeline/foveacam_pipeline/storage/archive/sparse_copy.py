"""A sparse local copy of an archived file, whose ranges are fetched when they are needed."""

from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO

from foveacam_pipeline.storage.archive.manifest import ArchiveRecord
from foveacam_pipeline.storage.archive.store import open_store
from foveacam_pipeline.storage.disk import disk_errors

BLOCK_BYTES = 1 << 15


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
