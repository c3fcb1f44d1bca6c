"""Captures, recordings and stills as sources of the archive (`ArchiveSource`)."""

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.archiving import dataset_item, recording_item
from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_pipeline.storage.archive import ArchiveItem
from foveacam_server.datasets.collection import readable_dataset
from foveacam_server.datasets.drawings import capture_picture
from foveacam_server.resources.capturing.captures.schema import CaptureDocument
from foveacam_server.resources.capturing.captures.service import CaptureService
from foveacam_server.resources.capturing.recordings.notes import layout_path, notes_path
from foveacam_server.resources.capturing.recordings.schema import RecordingDocument
from foveacam_server.resources.capturing.recordings.service import RecordingService
from foveacam_server.resources.capturing.stills.collection import StillState
from foveacam_server.resources.capturing.stills.schema import StillDocument
from foveacam_server.resources.capturing.stills.service import StillService


class CaptureArchiveSource:
    """Implements the archive's `ArchiveSource`."""

    def __init__(self, captures: CaptureService) -> None:
        self._captures = captures

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return a capture that is complete."""
        stored = self._captures.collection.get(item_id)
        if self._captures.is_running(item_id) or is_being_written(stored.folder):
            raise Busy(
                f"capture {stored.name} is still running",
                asked=f"archive {stored.name}",
                found="it is still running",
                remedy="archive it when it has ended",
            )
        return dataset_item(readable_dataset(stored), item_id=stored.id)

    def before_removal(self, item_id: str) -> None:
        """Draw the thumbnail while the frames are on the disk."""
        collection = self._captures.collection
        capture_picture(collection, collection.get(item_id), "thumbnail", form="jpg")

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `capture.updated`."""
        self._captures.report_update(item_id, message)

    def document(self, item_id: str) -> CaptureDocument:
        """Return the capture."""
        return self._captures.get(item_id)


class RecordingArchiveSource:
    """Implements the archive's `ArchiveSource`."""

    def __init__(self, recordings: RecordingService) -> None:
        self._recordings = recordings

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return a recording that has ended."""
        stored = self._recordings.readable(item_id)
        return recording_item(
            stored.path,
            item_id=stored.id,
            label=stored.notes.label,
            created_utc=stored.notes.created_utc,
            beside=[notes_path(stored.path), layout_path(stored.path)],
            about={
                "contents": None if stored.contents is None else stored.contents.as_json(),
                "counts": {name: counts.as_json() for name, counts in stored.counts.items()},
            },
        )

    def before_removal(self, item_id: str) -> None:
        """Close the file, so that its disk space is freed."""
        self._recordings.opened.forget(self._recordings.readable(item_id).path)

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `recording.updated`."""
        self._recordings.report_update(item_id, message)

    def document(self, item_id: str) -> RecordingDocument:
        """Return the recording."""
        return self._recordings.get(item_id)


class StillArchiveSource:
    """Implements the archive's `ArchiveSource`."""

    def __init__(self, stills: StillService) -> None:
        self._stills = stills

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return a kept still; raise Busy for one that is neither kept nor discarded yet."""
        found = self._stills.collection.get(item_id)
        stored = found.stored
        if found.state is not StillState.KEPT:
            raise Busy(
                asked=f"archive still {stored.name}",
                found="it is neither kept nor discarded yet",
                remedy="keep it first",
            )
        return dataset_item(readable_dataset(stored), item_id=stored.id, kind="stills")

    def before_removal(self, item_id: str) -> None:
        """Draw the thumbnail while the frames are on the disk."""
        collection = self._stills.collection
        capture_picture(collection.drawn, collection.get(item_id).stored, "thumbnail", form="jpg")

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `still.updated`."""
        self._stills.report_update(item_id, message)

    def document(self, item_id: str) -> StillDocument:
        """Return the still."""
        return self._stills.get(item_id)
