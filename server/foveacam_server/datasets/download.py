"""A dataset as a ZIP stream, made while it is sent, without a copy in memory or on the disk."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

from foveacam_pipeline.capture.dataset.lock import LOCK
from foveacam_pipeline.storage.archive import RECORD, read_record, read_stored
from foveacam_pipeline.storage.disk import PART

BLOCK = 1 << 20


class _Buffer:
    """The write buffer of `zipfile`; `drain` empties it."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, content: bytes) -> int:
        self._parts.append(bytes(content))
        return len(content)

    def flush(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Stay open, as the last bytes are still to be drained."""

    def drain(self) -> bytes:
        parts, self._parts = self._parts, []
        return b"".join(parts)


def zip_stream(folder: Path, *, remove: bool = False) -> Iterator[bytes]:
    """Yield an uncompressed ZIP file of a folder's files; images would not become smaller.

    Files that are only in the archive are read from there. `remove`: whether each file is deleted once it is
    in the ZIP file.
    """
    buffer = _Buffer()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(folder.rglob("*")):
            if not path.is_file() or path.name in (LOCK, RECORD) or path.name.endswith(PART):
                continue
            head = zipfile.ZipInfo.from_file(path, f"{folder.name}/{path.relative_to(folder).as_posix()}")
            with path.open("rb") as file, archive.open(head, "w", force_zip64=True) as entry:
                while block := file.read(BLOCK):
                    entry.write(block)
                    yield buffer.drain()
            if remove:
                path.unlink()
        for name in _archived_alone(folder):
            archive.writestr(f"{folder.name}/{name}", read_stored(folder, name))
            yield buffer.drain()
    yield buffer.drain()


def _archived_alone(folder: Path) -> list[str]:
    record = read_record(folder / RECORD)
    files = () if record is None else record.manifest.files
    return sorted(name for name in files if not (folder / name).exists())
