"""Reads the depth of a fixation's look from its cloud's folder; caches the last few."""

import threading
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, Protocol

from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.look_file import load_look
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.errors import NotFound, NotLookedAt

HELD = 6
"""Number of looks held in memory, 3 MB each."""


class StoredCloud(Protocol):
    """Identity of a cloud."""

    @property
    def id(self) -> str:
        """The cloud's id."""
        ...

    @property
    def fixation_id(self) -> str:
        """Id of the fixation that made it."""
        ...


class DepthAtPixel(Protocol):
    """Depth at one wide pixel."""

    @property
    def fixation_id(self) -> str:
        """Id of the fixation that measured it."""
        ...

    @property
    def point_rig_m(self) -> tuple[float, float, float]:
        """The point, rig frame."""
        ...

    @property
    def distance_m(self) -> float:
        """Its distance from the rig's origin."""
        ...

    @property
    def distance_sigma_m(self) -> float:
        """Standard error of its distance."""
        ...


class DepthOfPixels(Protocol):
    """Depth of the wide pixels that the foveae have looked at."""

    def at(self, x_px: float, y_px: float, *, wide: Intrinsics) -> DepthAtPixel:
        """Return the newest depth at a wide pixel or raise `NotFound`."""
        ...


class StoredClouds(Protocol):
    """The stored clouds with the depth of their looks."""

    @property
    def patches(self) -> DepthOfPixels:
        """The depth of wide pixels."""
        ...

    def newest(self, limit: int) -> Sequence[StoredCloud]:
        """Return the newest clouds, at most `limit`, newest first."""
        ...

    def of_fixation(self, fixation_id: str) -> StoredCloud | None:
        """Return the cloud of a fixation; None without one."""
        ...

    def file(self, cloud_id: str, name: Literal["depth.npz"]) -> Path:
        """Return the file of a cloud with the depth of its look or raise `NotFound`."""
        ...


class LookReader:
    """Reads looks; may be called from any thread."""

    def __init__(self, clouds: StoredClouds) -> None:
        self._clouds = clouds
        self._lock = threading.Lock()
        self._held: OrderedDict[str, LookDepth] = OrderedDict()

    def newest_id(self) -> str:
        """Return the fixation whose look is the newest with depth."""
        newest = self._clouds.newest(1)
        if not newest:
            raise NotLookedAt(
                "no fovea has looked anywhere yet",
                asked="the newest look",
                found="no look with depth",
                remedy="fixate something first: POST /api/v1/fixations",
            )
        return newest[0].fixation_id

    def get(self, fixation_id: str) -> LookDepth:
        """Return the depth of a fixation's look or raise NotFound."""
        cloud = self._clouds.of_fixation(fixation_id)
        if cloud is None:
            raise NotFound(
                f"fixation {fixation_id} has no depth to measure in",
                asked=f"the depth of {fixation_id}",
                found="no depth was kept of it",
                remedy="look at its target again",
            )
        cloud_id = cloud.id
        with self._lock:
            look = self._held.get(cloud_id)
        if look is None:
            look = load_look(self._clouds.file(cloud_id, "depth.npz"))
        with self._lock:
            self._held[cloud_id] = look
            self._held.move_to_end(cloud_id)
            while len(self._held) > HELD:
                self._held.popitem(last=False)
        return look

    def find(self, fixation_id: str) -> LookDepth | None:
        """Return the depth of a fixation's look, None when none was stored."""
        try:
            return self.get(fixation_id)
        except NotFound:
            return None
