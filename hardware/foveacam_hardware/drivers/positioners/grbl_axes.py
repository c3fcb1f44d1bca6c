"""An axis of a Grbl board, in its own units, and how a pan-tilt sits on two of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_hardware.contract import PanTiltLimits, PanTiltPose
from foveacam_hardware.drivers.positioners.bearing_limits import STRAIGHT_AHEAD
from foveacam_hardware.wire.grbl import LETTERS


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblAxis:
    """One of a board's axes: `span`, `rest` (where it goes after homing) and speeds in its `unit` (deg, mm).

    `arrived`: at rest this near to its goal it has arrived, a few steps of a motor.
    """

    letter: str
    name: str
    verb: str
    unit: str
    span: float
    rest: float
    speed_per_s: float
    arrived: float = 0.05

    @property
    def index(self) -> int:
        """Its place in reports and settings."""
        return LETTERS.index(self.letter)


def feed_per_min(
    axes: Mapping[str, GrblAxis], goals: Mapping[str, float], *, place: tuple[float, ...] | None
) -> float:
    """Return the feed along the way at which one axis goes at its own speed and none faster.

    Without knowing the `place` that it begins at: the slowest axis's speed.
    """
    if place is not None:
        ways = {letter: abs(goal - place[axes[letter].index]) for letter, goal in goals.items()}
        duration_s = max(way / axes[letter].speed_per_s for letter, way in ways.items())
        if duration_s > 0.0:
            return 60.0 * math.hypot(*ways.values()) / duration_s
    return 60.0 * min(axes[letter].speed_per_s for letter in goals)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblMounting:
    """How the base sits on its motors.

    `zero`: where the base points when the machine counts zero; after homing that is at the reference
    switches. `has_switches` false: there are none, and the machine counts from where it was switched on.
    """

    zero: PanTiltPose = STRAIGHT_AHEAD
    speed_rad_s: float = math.radians(25.0)
    has_switches: bool = True

    def goals(self, pose: PanTiltPose) -> dict[str, float]:
        """Return a bearing as X and Y, degrees of the machine."""
        return {
            "X": math.degrees(pose.pan_rad - self.zero.pan_rad),
            "Y": math.degrees(pose.tilt_rad - self.zero.tilt_rad),
        }

    def bearing(self, place: tuple[float, ...]) -> PanTiltPose:
        """Return where the base points at a position of the machine."""
        return PanTiltPose(
            pan_rad=math.radians(place[0]) + self.zero.pan_rad,
            tilt_rad=math.radians(place[1]) + self.zero.tilt_rad,
        )

    def axes(self, limits: PanTiltLimits) -> tuple[GrblAxis, GrblAxis]:
        """Return X and Y as the board's."""
        rest = self.goals(STRAIGHT_AHEAD)
        pan_rad, tilt_rad = limits.pan_max_rad - limits.pan_min_rad, limits.tilt_max_rad - limits.tilt_min_rad
        pan, tilt = (
            GrblAxis(
                letter=letter,
                name=name,
                verb="turn",
                unit="deg",
                span=math.degrees(span_rad),
                rest=rest[letter],
                speed_per_s=math.degrees(self.speed_rad_s),
            )
            for letter, name, span_rad in (("X", "pan", pan_rad), ("Y", "tilt", tilt_rad))
        )
        return pan, tilt
