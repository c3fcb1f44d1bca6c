"""Errors that refuse a move or a look, each with its remedy; checks of directions and volts."""

import math

from foveacam_hardware.contract import (
    Busy,
    NotConnected,
    OutOfRange,
    StereoVolts,
    Stopped,
    Timeout,
)
from foveacam_server.foundation.errors import StillOpening
from foveacam_server.rig.schema import DeviceProblemDocument
from foveacam_server.rig.status import RigStatus


def stopped() -> Stopped:
    """Return the error of a move while the stop is engaged."""
    return Stopped(
        "asked to move: the stop is engaged, the mirrors are parked",
        asked="move the mirrors",
        found="the stop is engaged",
        remedy="release the stop: DELETE /api/v1/stop",
    )


def in_use(asked: str, holder: str) -> Busy:
    """Return the error for a request while a job has the rig exclusively."""
    return Busy(
        f"asked to {asked}: {holder} is using the rig",
        asked=asked,
        found=f"{holder} is using the rig",
        remedy="wait for it, or cancel its job",
    )


def late_opening(within_s: float) -> Timeout:
    """Return the error of a rig that did not open in time, and is still opening."""
    return Timeout(
        f"asked to open another rig: it is not open within {within_s:g} s",
        asked="open another rig",
        found=f"it is not open within {within_s:g} s",
        remedy="look at the steps of the start",
    )


def missing(problem: DeviceProblemDocument) -> NotConnected:
    """Return the error for a missing device; the problem's detail may already end with its remedy."""
    found = f"{problem.device}: {problem.detail.removesuffix(f'; {problem.remedy}')}"
    return NotConnected(found, asked="use the rig", found=found, remedy=problem.remedy)


def not_open(status: RigStatus) -> NotConnected:
    """Return the error when no rig is open: it is still opening, or could not be opened."""
    if status.opened and status.problems:
        return missing(status.problems[0])
    return StillOpening(
        found="the rig is still opening",
        remedy="try again in a moment",
    )


def no_pan_tilt(asked: str) -> NotConnected:
    """Return the error for a rig without a pan-tilt."""
    return NotConnected(
        f"asked to {asked}: this rig has no pan-tilt",
        asked=asked,
        found="no pan-tilt",
        remedy="name one in the rig's file ([pan_tilt], kind grbl or manual)",
    )


STEERING_LIMIT_DEG = 10.0
"""Largest angle of the mirrors' specification, both axes (Table 2); the calibrated range may be smaller."""


def check_volts(volts: StereoVolts, *, max_v: float) -> None:
    """Raise `OutOfRange` for a drive beyond the rig's limit, naming eye and axis.

    `max_v` of 0: the rig is not open, and the move itself is refused.
    """
    if max_v == 0.0:
        return
    for eye, mirror in (("left", volts.left), ("right", volts.right)):
        for axis, value_v in (("x_v", mirror.x_v), ("y_v", mirror.y_v)):
            if abs(value_v) > max_v:
                asked = f"{eye} {axis} = {value_v:g}"
                raise OutOfRange(
                    f"{asked} is outside ±{max_v:g} V",
                    asked=asked,
                    found=f"the mirrors take ±{max_v:g} V",
                    remedy="choose volts inside",
                )


def check_direction(ax_rad: float, ay_rad: float) -> None:
    """Raise `OutOfRange` beyond the mirrors' specification."""
    for name, angle_rad in (("ax_deg", ax_rad), ("ay_deg", ay_rad)):
        angle_deg = math.degrees(angle_rad)
        if not abs(angle_deg) <= STEERING_LIMIT_DEG * (1.0 + 1e-12):
            allowed = f"-{STEERING_LIMIT_DEG:g} to {STEERING_LIMIT_DEG:g}"
            raise OutOfRange(
                f"direction {name} = {angle_deg:g} is outside {allowed} degrees",
                asked=f"{name} = {angle_deg:g}",
                found=f"the mirrors reach {allowed} degrees",
                remedy="choose a direction inside",
            )
