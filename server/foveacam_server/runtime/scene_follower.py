"""Keeps the rig in the 3D pane as it is: drawn from the calibration in force, its eyes as the mirrors are.

A thread of its own at a low rate: the hardware thread never talks to viewers, and all get every change.
"""

import logging
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import FoveaError, Role, StereoVolts
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_server.runtime.ports import SceneViewer
from foveacam_web.scene_values import EyeGaze, RigShape

PERIOD_S = 0.25
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class RigGaze:
    """Where the rig looks: the mirrors' volts, what they mean, the distance looked at (may be infinite).

    `volts`: None while nobody knows them.
    """

    calibration: Calibration
    volts: StereoVolts | None
    distance_m: float


def rig_shape(calibration: Calibration) -> RigShape:
    """Return the rig as it is drawn: baseline and fields of view."""
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
    """Tells the 3D pane what has changed, until closed."""

    def __init__(self, viewer: SceneViewer, *, sight: Callable[[], RigGaze | None]) -> None:
        self._viewer = viewer
        self._sight = sight
        self._told: RigGaze | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="foveacam-scene", daemon=True)

    def start(self) -> None:
        """Begin to follow."""
        self._thread.start()

    def close(self) -> None:
        """Stop following."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()

    def tell(self) -> None:
        """Bring the scene up to date; nothing is sent when nothing has changed."""
        sight = self._sight()
        if sight is None or sight == self._told:
            return
        if self._told is None or self._told.calibration is not sight.calibration:
            self._viewer.show_rig(rig_shape(sight.calibration))
        self._viewer.show_gaze(
            left=_gaze(sight, Role.LEFT),
            right=_gaze(sight, Role.RIGHT),
            distance_m=sight.distance_m if math.isfinite(sight.distance_m) else None,
        )
        self._told = sight

    def _run(self) -> None:
        while not self._closing.wait(PERIOD_S):
            try:
                self.tell()
            except FoveaError as error:
                _log.debug("the scene does not follow: %s", error)


def _gaze(sight: RigGaze, role: Role) -> EyeGaze | None:
    if sight.volts is None:
        return None
    ax_rad, ay_rad = sight.calibration.eye(role).mirror.angles_rad(eye_volts(sight.volts, role))
    return EyeGaze(ax_rad=ax_rad, ay_rad=ay_rad)
