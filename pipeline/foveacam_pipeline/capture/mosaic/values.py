"""What a mosaic is asked for, who watches it, and what is told of it."""

from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Cancelled, InvalidInput, Role


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicSettings:
    """What to make. `eye`: whose picture it is; `scan` and `bracket` of the dataset; `quality`: of the JPEGs.

    `adjust`: whether what neighbours differ by may move the views.
    """

    scan: int = 0
    eye: Role = Role.LEFT
    bracket: int = 0
    quality: int = 90
    adjust: bool = True
    cloud_points: int = 300_000

    def __post_init__(self) -> None:
        """Refuse what cannot be made."""
        if self.eye is Role.WIDE:
            raise InvalidInput("a mosaic is made of foveae: ask for the left or the right eye")
        if not 1 <= self.quality <= 100:
            raise InvalidInput(f"JPEG quality {self.quality}: choose 1 to 100")
        if self.cloud_points < 1:
            raise InvalidInput(f"a cloud of {self.cloud_points} points: at least 1 is needed")


class MosaicWatch(Protocol):
    """Who waits for a mosaic; called on the thread that makes it."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Take note that `done` of `total` steps are over."""
        ...

    def cancelled(self) -> bool:
        """Tell whether it shall end; what is done stays, and the same call goes on there."""
        ...


class Silent:
    """Watches nothing."""

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Ignore it."""

    def cancelled(self) -> bool:
        """Go on."""
        return False


class Steps:
    """Counts the steps of a mosaic for its watcher, and ends it when the watcher has had enough."""

    def __init__(self, watch: MosaicWatch, total: int) -> None:
        self._watch, self._total, self._done = watch, total, 0

    def step(self, note: str, count: int = 1) -> None:
        """Take note of steps that are over. Raise Cancelled."""
        self._done += count
        self._watch.progress(self._done, total=self._total, note=note)
        if self._watch.cancelled():
            raise Cancelled("the mosaic was cancelled; what is done stays, start it again to go on")


@dataclass(frozen=True, slots=True, kw_only=True)
class SeamFigures:
    """How far corresponding points of overlapping views lie apart, fovea px, rms of their distance.

    Measured on places that the adjustment was not made from. `links`: so many; `rejected`: places where the
    two pictures did not match. `adjusted`: whether the adjustment was larger than its own error and applied.
    """

    links: int
    rejected: int
    before_rms_px: float
    after_rms_px: float
    measuring_rms_px: float
    adjusted: bool
    largest_shift_px: float
    largest_gain_percent: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthFigures:
    """The fused depth. `known`: share of cells that have one; `seen_twice`: of those, by two pairs or more.

    `between_pairs_rel_rms`: what pairs differ by in the same cell, relative; `outliers`: share of estimates
    that contradict the rest and were left out. `median_sigma_rel`: stated standard error over depth.
    """

    known: float
    seen_twice: float
    between_pairs_rel_rms: float
    outliers: float
    median_sigma_rel: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicFigures:
    """What was made: size in px, foveae, and how good."""

    width: int
    height: int
    views: int
    tiles: int
    seams: SeamFigures
    depth: DepthFigures
