"""The depth of looks by the fixation that made them: read from the clouds' folders, the last few kept."""

import threading
from collections import OrderedDict

from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.look_file import load_look
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.clouds.collection import CloudCollection

KEPT = 6
"""Looks kept in memory: 3 MB each."""


class LookReader:
    """Reads looks; may be called from any thread."""

    def __init__(self, shelf: CloudCollection) -> None:
        self._shelf = shelf
        self._lock = threading.Lock()
        self._kept: OrderedDict[str, LookDepth] = OrderedDict()

    def newest_id(self) -> str:
        """Return the fixation whose look is the newest with depth."""
        newest = self._shelf.newest(1)
        if not newest:
            raise NotFound(
                "no fovea has looked anywhere yet; fixate something first, then measure",
                asked="the newest look",
                found="no look with depth",
                remedy="fixate something first: POST /api/v1/fixations",
            )
        return newest[0].fixation_id

    def get(self, fixation_id: str) -> LookDepth:
        """Return the depth of a fixation's look or raise NotFound."""
        cloud = self._shelf.of_fixation(fixation_id)
        if cloud is None:
            raise NotFound(
                f"fixation {fixation_id} has no depth to measure in; look at its target again",
                asked=f"the depth of {fixation_id}",
                found="no depth was kept of it",
                remedy="look at its target again",
            )
        cloud_id = cloud.id
        with self._lock:
            look = self._kept.get(cloud_id)
        if look is None:
            look = load_look(self._shelf.file(cloud_id, "depth.npz"))
        with self._lock:
            self._kept[cloud_id] = look
            self._kept.move_to_end(cloud_id)
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return look

    def find(self, fixation_id: str) -> LookDepth | None:
        """Return the depth of a fixation's look, None when none was kept."""
        try:
            return self.get(fixation_id)
        except NotFound:
            return None
