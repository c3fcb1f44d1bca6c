"""A capture as one ZIP file, made while it is sent: it is neither held in memory nor put on the disk."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

from foveacam_pipeline.capture.dataset.lock import LOCK
from foveacam_pipeline.storage.disk import PART

BLOCK = 1 << 20


class _Outbox:
    """What `zipfile` writes to: it takes bytes, and gives them away again."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, content: bytes) -> int:
        self._parts.append(bytes(content))
        return len(content)

    def flush(self) -> None:
        """Keep what there is."""

    def close(self) -> None:
        """Stay open: what was written is still to be taken."""

    def taken(self) -> bytes:
        parts, self._parts = self._parts, []
        return b"".join(parts)


def zip_stream(folder: Path) -> Iterator[bytes]:
    """Yield a ZIP file of a folder's files, not compressed: images do not become smaller."""
    outbox = _Outbox()
    with zipfile.ZipFile(outbox, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(folder.rglob("*")):
            if not path.is_file() or path.name == LOCK or path.name.endswith(PART):
                continue
            head = zipfile.ZipInfo.from_file(path, f"{folder.name}/{path.relative_to(folder).as_posix()}")
            with path.open("rb") as file, archive.open(head, "w", force_zip64=True) as entry:
                while block := file.read(BLOCK):
                    entry.write(block)
                    yield outbox.taken()
    yield outbox.taken()
