"""Recordings as sources of the archive."""

from foveacam_pipeline.capture.archiving import recording_item
from foveacam_pipeline.storage.archive import ArchiveItem
from foveacam_server.resources.recordings.notes import layout_path, notes_path
from foveacam_server.resources.recordings.schema import RecordingDocument
from foveacam_server.resources.recordings.service import RecordingService


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
        """Close the file, so that its room is freed."""
        self._recordings.opened.forget(self._recordings.readable(item_id).path)

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `recording.updated`."""
        self._recordings.report_update(item_id, message)

    def document(self, item_id: str) -> RecordingDocument:
        """Return the recording."""
        return self._recordings.get(item_id)
