"""Stills as sources of the archive."""

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.archiving import dataset_item
from foveacam_pipeline.storage.archive import ArchiveItem
from foveacam_server.datasets.collection import readable_dataset
from foveacam_server.datasets.drawings import capture_picture
from foveacam_server.resources.stills.collection import StillState
from foveacam_server.resources.stills.schema import StillDocument
from foveacam_server.resources.stills.service import StillService


class StillArchiveSource:
    """Implements the archive's `ArchiveSource`."""

    def __init__(self, stills: StillService) -> None:
        self._stills = stills

    def archive_item(self, item_id: str) -> ArchiveItem:
        """Return a still that is kept; raise Busy for one that waits for its user's decision."""
        found = self._stills.collection.get(item_id)
        stored = found.stored
        if found.state is not StillState.KEPT:
            raise Busy(
                f"archive still {stored.name}: it is neither kept nor discarded yet; keep it first",
                asked=f"archive still {stored.name}",
                found="it is neither kept nor discarded yet",
                remedy="keep it first",
            )
        return dataset_item(readable_dataset(stored), item_id=stored.id, kind="stills")

    def before_removal(self, item_id: str) -> None:
        """Draw the thumbnail while its frames are here."""
        collection = self._stills.collection
        capture_picture(collection.drawn, collection.get(item_id).stored, "thumbnail", form="jpg")

    def report_change(self, item_id: str, message: str) -> None:
        """Emit `still.updated`."""
        self._stills.report_update(item_id, message)

    def document(self, item_id: str) -> StillDocument:
        """Return the still."""
        return self._stills.get(item_id)
