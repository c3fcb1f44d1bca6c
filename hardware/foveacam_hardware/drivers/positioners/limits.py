"""Checks of bearings against a pan-tilt's limits and of positions against a rail's, for every driver."""

import math

from foveacam_hardware.contract import OutOfRange, PanTiltLimits, PanTiltPose, RailLimits

STRAIGHT_AHEAD = PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
SLACK_RAD = 1e-9
SLACK_M = 1e-9


def check_bearing(pose: PanTiltPose, limits: PanTiltLimits, *, name: str) -> None:
    """Raise `OutOfRange` for a bearing beyond the limits or NaN."""
    for axis, asked, low, high in (
        ("pan", pose.pan_rad, limits.pan_min_rad, limits.pan_max_rad),
        ("tilt", pose.tilt_rad, limits.tilt_min_rad, limits.tilt_max_rad),
    ):
        if not low - SLACK_RAD <= asked <= high + SLACK_RAD:
            raise OutOfRange(
                f"{name}: {axis} {math.degrees(asked):.2f} deg is outside {math.degrees(low):g} to"
                f" {math.degrees(high):g} deg; choose a bearing inside"
            )


def check_position(position_m: float, limits: RailLimits, *, name: str) -> None:
    """Raise `OutOfRange` for a position beyond the limits or NaN."""
    if not limits.min_m - SLACK_M <= position_m <= limits.max_m + SLACK_M:
        raise OutOfRange(
            f"{name}: {1e3 * position_m:.1f} mm is outside {1e3 * limits.min_m:g} to"
            f" {1e3 * limits.max_m:g} mm; choose a place inside"
        )
