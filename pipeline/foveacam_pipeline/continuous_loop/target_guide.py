"""Position of the loop's target: a fixed direction, or one tracked in the wide view and predicted."""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.image_tracker import ImageTracker, TrackBox
from foveacam_pipeline.track.position_filter import PositionFilter
from foveacam_pipeline.track.trackers import start_tracker
from foveacam_pipeline.verge.distance import LocatedPoint

PLACE_SIGMA_PX = 1.0
"""Standard error of the image tracker's position, wide px."""
FIRST_SIGMA_SHARE = 0.05
LOST_MISSES = 10
FADING_S = 10.0
"""Time constant of a target's velocity: it hardly fades within `LONGEST_LEAD_NS`."""
LONGEST_LEAD_NS = 500_000_000
"""Longest prediction beyond the last image that showed the target; after it the prediction stands still."""
FARTHEST_M = 100.0


class GuideState(StrEnum):
    """Whether the target's position is fixed, tracked, or lost by the tracker."""

    FIXED = "fixed"
    TRACKED = "tracked"
    LOST = "lost"


class TargetGuide:
    """Estimates the target's direction from the wide camera at any time."""

    def __init__(
        self,
        frame: Frame,
        target: NDArray[np.float64],
        *,
        calibration: Calibration,
        settings: LoopSettings,
        inverse_z_per_m: float,
    ) -> None:
        """`target`: (2,) tangents in the wide `frame`; `inverse_z_per_m`: 1/Z, a rough value is enough.

        Raise `OutOfRange` if the settings name a tracker and the target has no texture for it to follow.
        """
        self._wide = calibration.wide
        self._target = target
        self._seen_ns, self._seq, self._misses = frame.t_ns, frame.seq, 0
        self.score: float | None = None
        """Score of the tracker's match; None without a tracker and while it does not find the target."""
        point = np.append(target, 1.0) / max(inverse_z_per_m, 1.0 / FARTHEST_M)
        sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
        self._filter = PositionFilter(point, sigma_m=sigma_m, t_ns=frame.t_ns, fading_s=FADING_S)
        self._tracker = _started(frame, self._pixel(target), settings)

    @property
    def state(self) -> GuideState:
        """LOST after `LOST_MISSES` frames in a row without a match."""
        if self._tracker is None:
            return GuideState.FIXED
        return GuideState.LOST if self._misses >= LOST_MISSES else GuideState.TRACKED

    def see_wide(self, frame: Frame) -> None:
        """Track the target in a newer wide frame and update the motion filter; ignore a repeated frame."""
        if self._tracker is None or frame.seq == self._seq:
            return
        self._seq = frame.seq
        expected = self._pixel(self.place(frame.t_ns, predict=True))
        match = self._tracker.update(gray(to_uint8(frame)), expected)
        if match is None:
            self._misses, self.score = self._misses + 1, None
            return
        self._misses, self.score = 0, match.score
        self._target = np.tan(self._wide.angles_rad([[match.x_px, match.y_px]])[0])
        self._seen_ns = frame.t_ns
        sigma = PLACE_SIGMA_PX / self._wide.fx_px
        if not self._filter.see(frame.t_ns, self._target, sigma=sigma):
            inverse_z_per_m = max(1.0 / FARTHEST_M, self._filter.at(frame.t_ns).inverse_z_per_m)
            point = np.append(self._target, 1.0) / inverse_z_per_m
            sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
            self._filter = PositionFilter(point, sigma_m=sigma_m, t_ns=frame.t_ns, fading_s=FADING_S)

    def see_point(self, t_ns: int, point: LocatedPoint) -> None:
        """Update the filter of a tracked target with the depth measured by a look; no effect when fixed."""
        if self._tracker is None:
            return
        z_m = point.point_rig_m[2]
        expected = self._filter.at(t_ns)
        self._filter.see(
            t_ns,
            expected.tangents,
            sigma=1.0,
            inverse_z_per_m=1.0 / z_m,
            inverse_z_sigma_per_m=max(FIRST_SIGMA_SHARE / 5.0, point.distance_sigma_m / z_m) / z_m,
        )

    def place(self, t_ns: int, *, predict: bool) -> NDArray[np.float64]:
        """Return the target's direction, (2,) tangents: predicted for `t_ns`, or as last seen."""
        if self._tracker is None or not predict:
            return self._target
        return self._filter.at(min(t_ns, self._seen_ns + LONGEST_LEAD_NS)).tangents

    def pixel(self, t_ns: int) -> tuple[float, float]:
        """Return the predicted position in the wide view, px."""
        return self._pixel(self.place(t_ns, predict=True))

    def _pixel(self, target: NDArray[np.float64]) -> tuple[float, float]:
        x_px, y_px = self._wide.pixels(np.arctan(target)[None])[0].tolist()
        return float(x_px), float(y_px)


def _started(frame: Frame, pixel: tuple[float, float], settings: LoopSettings) -> ImageTracker | None:
    if settings.tracker is None:
        return None
    box = TrackBox(
        x_px=pixel[0], y_px=pixel[1], width_px=settings.box_width_px, height_px=settings.box_height_px
    )
    return start_tracker(settings.tracker, gray(to_uint8(frame)), box, binning=frame.binning)
