"""The journal, which defines a dataset's content: one line a point, appended once its images are on disk.

A line is `digest {json}`. The digest also covers the preceding line, so that a lost, changed or moved line is
detected. Only the last line can be torn by a crash, and then its point was never acknowledged.
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
"""Hexadecimal digits of SHA-256 at the start of each line."""
IMAGE_FILE = re.compile(r"images/[A-Za-z0-9][A-Za-z0-9._-]{0,120}")

_RECORD: TypeAdapter[PointRecord] = TypeAdapter(PointRecord)


@dataclass(frozen=True, slots=True, kw_only=True)
class JournalContent:
    """The content of a journal.

    `good_bytes`: offset of the next line; `torn`: an incomplete line is there.
    """

    records: tuple[PointRecord, ...]
    good_bytes: int
    digest: str
    torn: bool


def read_journal(folder: Path, *, dataset_id: str) -> JournalContent:
    """Read all lines, none if the file is missing; raise InvalidInput for damage before the last line."""
    try:
        content = (folder / JOURNAL).read_bytes()
    except FileNotFoundError:
        content = b""
    records: list[PointRecord] = []
    digest, good = first_digest(dataset_id), 0
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
    """A journal that is open for appending."""

    def __init__(self, folder: Path, journal: JournalContent) -> None:
        """Open it behind the last good line and cut off a torn one. Raise OSError."""
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
        """Append one point durably.

        Raise OSError; `clean` is then true if the file is unchanged.
        """
        line, digest = journal_line(record, self._digest)
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


def first_digest(dataset_id: str) -> str:
    """Return the digest that precedes the first line: it ties a journal to its dataset."""
    return hashlib.sha256(dataset_id.encode()).hexdigest()[:DIGITS]


def journal_line(record: PointRecord, before: str) -> tuple[bytes, str]:
    """Return the line of a point that follows the line with digest `before`, and its own digest."""
    text = json.dumps(asdict(record), separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    digest = hashlib.sha256(f"{before} {text}".encode()).hexdigest()[:DIGITS]
    return f"{digest} {text}\n".encode(), digest


def _record_of(line: bytes, before: str) -> PointRecord | None:
    """Return the point of a line; None for a torn or changed line."""
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
            raise InvalidInput(
                f"{what}: file {frame.file!r} is not in the dataset's folder; do not use this dataset"
            )
