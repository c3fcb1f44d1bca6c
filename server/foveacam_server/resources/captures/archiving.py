"""Captures as sources of the archive."""

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.archiving import dataset_item
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.storage.archive import ArchiveItem
from foveacam_server.datasets.collection import readable_dataset
from foveacam_server.datasets.drawings import capture_picture
from foveacam_server.resources.captures.schema import CaptureDocument
from foveacam_server.resources.captures.service import CaptureService


class CaptureArchiveSource:
    """Implements the archive's `ArchiveSource`."""

    def __init__(self, captures: CaptureService) -> None:
        self._captures = captures

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return a capture that has ended."""
        stored = self._captures.collection.get(item_id)
        if self._captures.is_running(item_id) or is_being_written(stored.folder):
            raise Busy(
                f"capture {stored.name} is still running; archive it when it has ended",
                asked=f"archive {stored.name}",
                found="it is still running",
                remedy="wait for its end",
            )
        return dataset_item(readable_dataset(stored), item_id=stored.id)

    def before_removal(self, item_id: str) -> None:
        """Draw the thumbnail while its frames are here."""
        collection = self._captures.collection
        capture_picture(collection, collection.get(item_id), "thumbnail", form="jpg")

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `capture.updated`."""
        self._captures.report_update(item_id, message)

    def document(self, item_id: str) -> CaptureDocument:
        """Return the capture."""
        return self._captures.get(item_id)
