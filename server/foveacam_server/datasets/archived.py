"""What REST says of a dataset, still or recording whose bytes are in an archive."""

from pathlib import Path
from typing import Self

from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.storage.archive import RECORD, ArchiveRecord, read_record
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.foundation.schema import ResponseModel


class ArchivedDocument(ResponseModel):
    """Where its bytes are in an archive. `local`: whether all are on this machine's disk as well."""

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
    """Return what a record's file says; None without one. `sample`: a file that is absent with the others."""
    found = read_record(record)
    return None if found is None else ArchivedDocument.of(found, local=sample.exists())


def archived_dataset(stored: StoredCapture) -> ArchivedDocument | None:
    """Return what the record of a capture or still says; None without one."""
    frames = (frame for point in stored.dataset or () for frame in point.frames)
    first = next(frames, None)
    sample = stored.folder / (DOCUMENT if first is None else first.file)
    return archived_document(stored.folder / RECORD, sample=sample)
