"""The journal: one line a point, appended when the point's images are on the disk; the truth of a dataset.

A line is `digest {json}`; the digest covers the line before it too, so that none can be lost, changed or put
elsewhere unseen. Only the last line can be torn by a crash, and then it was never acknowledged.
"""

import hashlib
import io
import json
import os
import re
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.values import PointRecord

JOURNAL = "journal.jsonl"
DIGITS = 32
"""Hexadecimal digits of the SHA-256 before each line."""
IMAGE_FILE = re.compile(r"images/[A-Za-z0-9][A-Za-z0-9._-]{0,120}")

_RECORD: TypeAdapter[PointRecord] = TypeAdapter(PointRecord)


@dataclass(frozen=True, slots=True, kw_only=True)
class JournalContent:
    """What a journal holds. `good_bytes`: where the next line goes; `torn`: a part of one stands there."""

    records: tuple[PointRecord, ...]
    good_bytes: int
    digest: str
    torn: bool


def read_journal(folder: Path, *, dataset_id: str) -> JournalContent:
    """Read all lines; raise InvalidInput when one before the last is damaged. None there is an empty one."""
    try:
        content = (folder / JOURNAL).read_bytes()
    except FileNotFoundError:
        content = b""
    records: list[PointRecord] = []
    digest, good = seed(dataset_id), 0
    for line in io.BytesIO(content):
        record = _record_of(line, digest)
        if record is None:
            if content[good + len(line) :].strip(b"\x00\n"):
                raise InvalidInput(
                    f"{folder / JOURNAL}: line {len(records) + 1} is damaged and others follow; "
                    "restore the file from a copy"
                )
            break
        _check_record(record, index=len(records), what=str(folder / JOURNAL))
        records.append(record)
        digest, good = line[:DIGITS].decode("ascii"), good + len(line)
    return JournalContent(records=tuple(records), good_bytes=good, digest=digest, torn=good != len(content))


class JournalFile:
    """The end of a journal, open for lines to be appended."""

    def __init__(self, folder: Path, journal: JournalContent) -> None:
        """Open it behind the last good line; what is torn is cut off. Raise OSError."""
        self._digest, self._size = journal.digest, journal.good_bytes
        self.clean = True
        self._descriptor = os.open(folder / JOURNAL, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            os.ftruncate(self._descriptor, self._size)
            os.fsync(self._descriptor)
        except OSError:
            self.close()
            raise

    def append(self, record: PointRecord) -> None:
        """Put one point into the journal, durably.

        Raise OSError; then `clean` says whether the file is as it was.
        """
        line, digest = line_of(record, self._digest)
        self.clean = False
        try:
            written = 0
            while written < len(line):
                written += os.pwrite(self._descriptor, line[written:], self._size + written)
            os.fsync(self._descriptor)
        except OSError:
            os.ftruncate(self._descriptor, self._size)
            self.clean = True
            raise
        self._digest, self._size, self.clean = digest, self._size + len(line), True

    def close(self) -> None:
        """Close the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def seed(dataset_id: str) -> str:
    """Return what stands for the line before the first: a journal belongs to one dataset."""
    return hashlib.sha256(dataset_id.encode()).hexdigest()[:DIGITS]


def line_of(record: PointRecord, before: str) -> tuple[bytes, str]:
    """Return the line of a point that follows the line with digest `before`, and its own digest."""
    text = json.dumps(asdict(record), separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    digest = hashlib.sha256(f"{before} {text}".encode()).hexdigest()[:DIGITS]
    return f"{digest} {text}\n".encode(), digest


def _record_of(line: bytes, before: str) -> PointRecord | None:
    """Return the point of a line; None for one that is torn or changed."""
    digest, text = line[:DIGITS], line[DIGITS + 1 :]
    if not line.endswith(b"\n") or line[DIGITS : DIGITS + 1] != b" ":
        return None
    found = hashlib.sha256(before.encode() + b" " + text[:-1]).hexdigest()[:DIGITS]
    if found.encode() != digest:
        return None
    try:
        return _RECORD.validate_json(text)
    except (ValueError, ValidationError):
        return None


def _check_record(record: PointRecord, *, index: int, what: str) -> None:
    if record.place.index != index:
        raise InvalidInput(
            f"{what}: point {index} is missing, {record.place.index} stands in its place; restore it"
        )
    for frame in record.frames:
        if not IMAGE_FILE.fullmatch(frame.file) or ".." in frame.file:
            raise InvalidInput(f"{what}: file {frame.file!r} is not in the dataset's folder; trust it not")
