"""Computes the volts of a steering target: given volts, or a direction, distance and vertical shift."""

import math

from foveacam_hardware.contract import MirrorVolts, OutOfRange, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.devices.mirrors.schema import EyeVolts, SteerGaze, VoltsRequest
from foveacam_server.rig.refusals import check_direction

SHIFT_LIMIT_DEG = 0.5
"""Largest vertical shift in steering by hand, in either direction."""


def volts_of(request: VoltsRequest, *, before: StereoVolts) -> StereoVolts:
    """Return the volts of a request; an eye left out keeps its present ones."""
    return StereoVolts(
        left=_eye(request.left, before=before.left), right=_eye(request.right, before=before.right)
    )


def gaze_volts(gaze: SteerGaze, calibration: Calibration) -> StereoVolts:
    """Return the volts with which both eyes take a gaze, or raise `OutOfRange`."""
    ax_rad, ay_rad = math.radians(gaze.direction.ax_deg), math.radians(gaze.direction.ay_deg)
    check_direction(ax_rad, ay_rad)
    shift_deg = gaze.vertical_shift_deg
    if abs(shift_deg) > SHIFT_LIMIT_DEG:
        allowed = f"±{SHIFT_LIMIT_DEG:g} degrees"
        raise OutOfRange(
            f"vertical_shift_deg = {shift_deg:g} is outside {allowed}",
            asked=f"vertical_shift_deg = {shift_deg:g}",
            found=f"the eyes are shifted by {allowed} at most",
            remedy="choose a shift inside",
        )
    distance_m = math.inf if gaze.distance_m is None else gaze.distance_m
    return calibration.steer(ax_rad, ay_rad, distance_m=distance_m, shift_rad=math.radians(shift_deg))


def volts_text(volts: StereoVolts) -> str:
    """Return volts as the event log shows them."""
    left, right = volts.left, volts.right
    return f"left {left.x_v:.2f}, {left.y_v:.2f} V, right {right.x_v:.2f}, {right.y_v:.2f} V"


def _eye(asked: EyeVolts | None, *, before: MirrorVolts) -> MirrorVolts:
    return before if asked is None else MirrorVolts(x_v=asked.x_v, y_v=asked.y_v)
