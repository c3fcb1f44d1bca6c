"""Converts bearings of the rig to motor steps of a FLIR unit and back."""

import math
from dataclasses import dataclass

from foveacam_hardware.contract import PanTiltPose
from foveacam_hardware.contract.quantities import check_positive
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD

Steps = tuple[int, int]
"""Positions of pan and tilt, steps."""
ARC_SECOND_RAD = math.radians(1.0 / 3600.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuMounting:
    """Mounting of the rig on the unit. `zero`: bearing at the unit's 0/0, the middle of both ranges."""

    zero: PanTiltPose = STRAIGHT_AHEAD
    speed_rad_s: float = math.radians(25.0)
    upside_down: bool = False
    """The unit is mounted upside down: both axes turn the other way."""

    def __post_init__(self) -> None:
        check_positive("pan-tilt", speed_rad_s=self.speed_rad_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuAxes:
    """Conversion between steps of both motors and bearings of the rig."""

    mounting: PtuMounting
    pan_step_rad: float
    tilt_step_rad: float

    def steps(self, pose: PanTiltPose) -> Steps:
        """Return the step positions nearest to a bearing."""
        zero, turn = self.mounting.zero, self._turn
        return (
            round(turn * (pose.pan_rad - zero.pan_rad) / self.pan_step_rad),
            round(turn * (pose.tilt_rad - zero.tilt_rad) / self.tilt_step_rad),
        )

    def bearing(self, steps: Steps) -> PanTiltPose:
        """Return the bearing at step positions."""
        zero, turn = self.mounting.zero, self._turn
        return PanTiltPose(
            pan_rad=zero.pan_rad + turn * steps[0] * self.pan_step_rad,
            tilt_rad=zero.tilt_rad + turn * steps[1] * self.tilt_step_rad,
        )

    @property
    def _turn(self) -> float:
        """Sign: the unit counts to the left and up, bearings to the right and down."""
        return 1.0 if self.mounting.upside_down else -1.0
