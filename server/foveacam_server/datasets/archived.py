"""Schema of the archive state of a dataset, still or recording."""

from pathlib import Path
from typing import Self

from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.storage.archive import RECORD, ArchiveRecord, read_record
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.foundation.schema import ResponseModel


class ArchivedDocument(ResponseModel):
    """Location of its files in an archive. `local`: whether all are also on this machine's disk."""

    url: str
    utc: str
    bytes: int
    local: bool

    @classmethod
    def of(cls, record: ArchiveRecord, *, local: bool) -> Self:
        """Return the document of a record."""
        manifest = record.manifest
        return cls(url=record.url, utc=manifest.archived_utc, bytes=manifest.size_bytes, local=local)


def archived_document(record: Path, *, sample: Path) -> ArchivedDocument | None:
    """Return the content of a record's file; None without one.

    `sample`: a file that tells whether the others are present.
    """
    found = read_record(record)
    return None if found is None else ArchivedDocument.of(found, local=sample.exists())


def archived_dataset(stored: StoredCapture) -> ArchivedDocument | None:
    """Return the archive record of a capture or still; None without one."""
    frames = (frame for point in stored.dataset or () for frame in point.frames)
    first = next(frames, None)
    sample = stored.folder / (DOCUMENT if first is None else first.file)
    return archived_document(stored.folder / RECORD, sample=sample)
