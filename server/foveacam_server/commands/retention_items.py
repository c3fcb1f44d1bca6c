"""Applies the rules of retention to a data directory from the command line."""

from pathlib import Path

from foveacam_pipeline.capture.dataset.lock import is_being_written
from foveacam_server.datasets.collection import CAPTURES, DatasetCollection
from foveacam_server.foundation.store import DATABASE, Store, StoreReader
from foveacam_server.resources.capturing.captures.schema import CaptureDocument
from foveacam_server.resources.capturing.exports.collection import EXPORTS, ExportCollection
from foveacam_server.resources.capturing.recordings.collection import RECORDINGS, RecordingCollection
from foveacam_server.resources.capturing.recordings.documents import recording_document
from foveacam_server.resources.capturing.retention.rules import (
    RetentionSource,
    Sources,
    look_sources,
    preview,
)
from foveacam_server.resources.capturing.retention.schema import RetentionApplied, RetentionPreview
from foveacam_server.resources.capturing.retention.service import RetentionService
from foveacam_server.resources.capturing.stills.collection import STILLS, StillCollection, StillState
from foveacam_server.resources.capturing.stills.schema import StillDocument
from foveacam_server.resources.looking.clouds.collection import CLOUDS, CloudCollection
from foveacam_server.resources.looking.fixations.retained import RetainedLooks
from foveacam_server.resources.looking.fixations.table import FixationTable, TargetTable


def due_items(folder: Path) -> RetentionPreview:
    """Return the preview of the rules; a server may be using the folder."""
    sources = _sources(folder)
    if (folder / DATABASE).exists():
        looks = RetainedLooks(StoreReader(folder), folder / CLOUDS)
        shown = look_sources(looks, remove_cloud=_only_shown, remove_fixation=_only_shown)
        sources = {**sources, **shown}
    return preview(folder, sources)


def remove_due_items(folder: Path) -> RetentionApplied:
    """Apply the rules; raise `Busy` while a server is using the folder."""
    with Store(folder) as store:
        service = RetentionService(folder, {**_sources(folder), **_removable_looks(store)})
        return service.apply(service.preview().digest)


def _sources(data: Path) -> Sources:
    captures = DatasetCollection(data / CAPTURES)
    recordings = RecordingCollection(data / RECORDINGS)
    stills = StillCollection(data / STILLS)
    exports = ExportCollection(data / CAPTURES / EXPORTS)
    return {
        "captures": RetentionSource(
            every=lambda: [CaptureDocument.of(stored) for stored in captures.every()],
            in_use=lambda capture_id: is_being_written(captures.get(capture_id).folder),
            remove=captures.remove,
        ),
        "recordings": RetentionSource(
            every=lambda: [recording_document(stored) for stored in recordings.every()],
            in_use=lambda recording_id: False,  # a server that records has the folder's lock
            remove=lambda recording_id: recordings.remove(recordings.get(recording_id)),
        ),
        "stills": RetentionSource(
            every=lambda: [StillDocument.of(still) for still in stills.every(StillState.KEPT)],
            in_use=lambda still_id: is_being_written(stills.get(still_id).stored.folder),
            remove=stills.remove,
        ),
        "exports": RetentionSource(
            every=exports.every,
            in_use=lambda export_id: False,  # a server that makes one has the folder's lock
            remove=exports.remove_by_id,
            for_good=True,
        ),
    }


def _removable_looks(store: Store) -> Sources:
    """Return the sources of clouds and fixations of a folder that no server uses."""
    clouds, fixations, targets = CloudCollection(store), FixationTable(store), TargetTable(store)

    def remove_fixation(fixation_id: str) -> None:
        targets.remove_of(fixation_id)
        fixations.remove(fixation_id)

    looks = RetainedLooks(store, store.subfolder(CLOUDS))
    return look_sources(looks, remove_cloud=clouds.remove, remove_fixation=remove_fixation)


def _only_shown(item_id: str) -> None:
    raise AssertionError(f"{item_id}: nothing is removed where it is shown alone")
