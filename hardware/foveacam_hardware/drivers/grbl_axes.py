"""Bearings of the rig as a Grbl board's numbers: where its zero points, how far and how fast it turns."""

import math
from dataclasses import dataclass

from foveacam_hardware.contract import OutOfRange, PanTiltLimits, PanTiltPose
from foveacam_hardware.wire.grbl import jog

STRAIGHT_AHEAD = PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
ARRIVED_DEG = 0.05
"""At rest this near to the goal it has arrived: a few steps of a motor."""
SLACK_RAD = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblMounting:
    """How the base sits on its motors.

    `zero`: where the base points when the machine counts zero; after homing that is at the reference
    switches. `has_switches` false: there are none, and the machine counts from where it was switched on.
    """

    zero: PanTiltPose = STRAIGHT_AHEAD
    speed_rad_s: float = math.radians(25.0)
    has_switches: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """Pan and tilt as the board's X and Y, degrees of the machine."""

    name: str
    limits: PanTiltLimits
    mounting: GrblMounting

    def check_range(self, pose: PanTiltPose) -> None:
        """Raise `OutOfRange` for a bearing beyond the limits."""
        limits = self.limits
        for axis, asked, low, high in (
            ("pan", pose.pan_rad, limits.pan_min_rad, limits.pan_max_rad),
            ("tilt", pose.tilt_rad, limits.tilt_min_rad, limits.tilt_max_rad),
        ):
            if not low - SLACK_RAD <= asked <= high + SLACK_RAD:
                raise OutOfRange(
                    f"{self.name}: {axis} {math.degrees(asked):.2f} deg is outside"
                    f" {math.degrees(low):g} to {math.degrees(high):g} deg; choose a bearing inside"
                )

    def jog_to(self, pose: PanTiltPose) -> str:
        """Return the line that turns the base to a bearing."""
        pan_deg, tilt_deg = self._machine_deg(pose)
        return jog(pan_deg, tilt_deg, feed_deg_min=math.degrees(self.mounting.speed_rad_s) * 60.0)

    def bearing(self, machine_deg: tuple[float, float]) -> PanTiltPose:
        """Return where the base points at a position of the machine."""
        zero = self.mounting.zero
        return PanTiltPose(
            pan_rad=math.radians(machine_deg[0]) + zero.pan_rad,
            tilt_rad=math.radians(machine_deg[1]) + zero.tilt_rad,
        )

    def arrived(self, machine_deg: tuple[float, float], pose: PanTiltPose) -> bool:
        """Return whether a position of the machine is that of a bearing, to a few steps."""
        goal_deg = self._machine_deg(pose)
        return max(abs(at - to) for at, to in zip(machine_deg, goal_deg, strict=True)) <= ARRIVED_DEG

    def _machine_deg(self, pose: PanTiltPose) -> tuple[float, float]:
        zero = self.mounting.zero
        return math.degrees(pose.pan_rad - zero.pan_rad), math.degrees(pose.tilt_rad - zero.tilt_rad)
