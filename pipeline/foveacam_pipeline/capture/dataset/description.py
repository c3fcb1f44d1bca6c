"""What people may change of a dataset afterwards: its label and its licence."""

from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.document import DatasetDocument, read_document, write_document
from foveacam_pipeline.capture.dataset.lock import FolderLock
from foveacam_pipeline.storage.disk import disk_errors

LONGEST = 2000
"""Characters of a label or a licence that are kept."""


def describe(path: str | Path, *, label: str | None = None, licence: str | None = None) -> DatasetDocument:
    """Change label or licence; raise Busy while the dataset is being written."""
    folder = Path(path)
    read_document(folder)
    with disk_errors("its description", folder):
        lock = FolderLock(folder)
        try:
            document = read_document(folder).described(label=_fitting(label), licence=_fitting(licence))
            write_document(folder, document)
        finally:
            lock.release()
    return document


def _fitting(text: str | None) -> str | None:
    if text is not None and len(text) > LONGEST:
        raise InvalidInput(f"a label or licence of {len(text)} characters: {LONGEST} are kept; shorten it")
    return text
