"""Keeps the rig's drawing in the 3D pane up to date: the calibration in force and the mirrors' positions.

Runs on a separate thread at a low rate, as calls of the pane must not delay the hardware thread.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import Role, StereoVolts
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_server.foundation.periodic import PeriodicThread
from foveacam_server.foundation.watching.flows import PANE, count_flow, this_part
from foveacam_server.rig.ports import SceneViewer
from foveacam_web.scene_values import EyeGaze, RigShape

PERIOD_S = 0.25
MOVING_PERIODS = 8
"""Periods between two updates of a changing gaze: a browser that renders in software needs a core for each,
which a fixation then lacks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigGaze:
    """The mirrors' volts (None while unknown), the calibration, the distance looked at (may be infinite)."""

    calibration: Calibration
    volts: StereoVolts | None
    distance_m: float


def rig_shape(calibration: Calibration) -> RigShape:
    """Return baseline and fields of view, for drawing."""
    wide = calibration.wide
    return RigShape(
        baseline_m=calibration.baseline_m,
        wide_fov_rad=(field_rad(wide.width, wide.fx_px), field_rad(wide.height, wide.fy_px)),
        fovea_fov_rad=(
            field_rad(calibration.fovea_width, calibration.fovea_f_px),
            field_rad(calibration.fovea_height, calibration.fovea_f_px),
        ),
    )


def field_rad(size_px: int, f_px: float) -> float:
    """Return the angle that `size_px` pixels see through a focal length of `f_px`."""
    return 2.0 * math.atan(0.5 * size_px / f_px)


class SceneFollower:
    """Sends changes of the gaze and the calibration to the 3D pane, until closed."""

    def __init__(self, viewer: SceneViewer, *, gaze: Callable[[], RigGaze | None]) -> None:
        self._viewer = viewer
        self._gaze = gaze
        self._sent: RigGaze | None = None
        self._last: RigGaze | None = None
        self._unsent = 0
        """Periods since the gaze began to differ from what was sent."""
        self._thread = PeriodicThread("foveacam-scene", self.update, period_s=PERIOD_S, level=logging.DEBUG)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._thread.close()

    def update(self) -> None:
        """Send a gaze once it rests, and a changing one every `MOVING_PERIODS` calls."""
        gaze = self._gaze()
        rests, self._last = gaze == self._last, gaze
        if gaze is None or gaze == self._sent:
            self._unsent = 0
            return
        self._unsent += 1
        if rests or self._sent is None or self._unsent >= MOVING_PERIODS:
            self._send(gaze)

    def _send(self, gaze: RigGaze) -> None:
        if self._sent is None or self._sent.calibration is not gaze.calibration:
            self._viewer.show_rig(rig_shape(gaze.calibration))
        count_flow(this_part(), PANE, "drawings")
        self._viewer.show_gaze(
            left=_gaze(gaze, Role.LEFT),
            right=_gaze(gaze, Role.RIGHT),
            distance_m=gaze.distance_m if math.isfinite(gaze.distance_m) else None,
        )
        self._sent = gaze
        self._unsent = 0


def _gaze(gaze: RigGaze, role: Role) -> EyeGaze | None:
    if gaze.volts is None:
        return None
    ax_rad, ay_rad = gaze.calibration.eye(role).mirror.angles_rad(eye_volts(gaze.volts, role))
    return EyeGaze(ax_rad=ax_rad, ay_rad=ay_rad)
