"""Computes the overlay of the wide view: the directions of both foveae and the outlines of their fields."""

import math
from collections.abc import Callable

from foveacam_hardware.contract import MirrorVolts, Role, StereoVolts
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.models.footprint import fovea_footprint_px
from foveacam_server.rig.schema import Direction, FollowMark, OverlayDocument

EYES = (Role.LEFT, Role.RIGHT)
UNKNOWN_GAZE = OverlayDocument(footprints={"left": None, "right": None}, gaze={"left": None, "right": None})


class GazeOverlay:
    """Computes the overlay of a gaze; caches the last, as the gaze rests most of the time."""

    def __init__(self, calibration: Callable[[], Calibration | None]) -> None:
        self._calibration = calibration
        self._distance_m = math.inf
        self._follows: Callable[[], list[FollowMark]] = list
        self._last: tuple[Calibration, StereoVolts, float, OverlayDocument] | None = None

    @property
    def distance_m(self) -> float:
        """The distance at which the outlines are drawn, metres; infinite while none is known."""
        return self._distance_m

    def look_at_distance(self, distance_m: float) -> None:
        """Draw the outlines at `distance_m` from now on, metres from the rig's origin."""
        self._distance_m = distance_m

    def show_follows(self, follows: Callable[[], list[FollowMark]]) -> None:
        """Set the function that returns the marks of followed targets; called with every wide frame."""
        self._follows = follows

    def of(self, gaze: StereoVolts | None) -> OverlayDocument | None:
        """Return footprints and directions of `gaze`, and the followed targets; None without a calibration.

        An unknown gaze (None) has neither, so that the page removes what it drew.
        """
        calibration = self._calibration()
        if calibration is None:
            return None
        if gaze is None:
            return UNKNOWN_GAZE
        overlay, follows = self._of_gaze(calibration, gaze), self._follows()
        return overlay.model_copy(update={"follows": follows}) if follows else overlay

    def _of_gaze(self, calibration: Calibration, gaze: StereoVolts) -> OverlayDocument:
        distance_m = self._distance_m
        last = self._last
        if last is not None and last[0] is calibration and last[1] == gaze and last[2] == distance_m:
            return last[3]
        volts = {role: eye_volts(gaze, role) for role in EYES}
        overlay = OverlayDocument(
            footprints={
                role.value: _footprint_px(calibration, role, volts[role], distance_m) for role in EYES
            },
            gaze={role.value: _direction(calibration, role, volts[role]) for role in EYES},
        )
        self._last = (calibration, gaze, distance_m, overlay)
        return overlay


def _footprint_px(
    calibration: Calibration, role: Role, volts: MirrorVolts, distance_m: float
) -> list[tuple[float, float]]:
    corners_px = fovea_footprint_px(calibration, role, volts, distance_m)
    return [(round(x, 2), round(y, 2)) for x, y in corners_px.tolist()]


def _direction(calibration: Calibration, role: Role, volts: MirrorVolts) -> Direction:
    ax_rad, ay_rad = calibration.eye(role).mirror.angles_rad(volts)
    return Direction(ax_deg=round(math.degrees(ax_rad), 4), ay_deg=round(math.degrees(ay_rad), 4))
