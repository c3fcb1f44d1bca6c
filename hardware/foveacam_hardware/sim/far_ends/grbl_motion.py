"""Stepper motors under Grbl's planner: straight moves of all axes with trapezoidal speed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from foveacam_hardware.sim.pan_tilt import (
    NS_PER_S,
    ZERO_POSITIONS,
    AxisPositions,
    PanTiltCables,
    TurningHistory,
    TurnSegment,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveLimits:
    """Speed and acceleration of a straight move along its displacement, in the axes' units."""

    speed_per_s: float
    acceleration_per_s2: float


def limits_along(
    displacement: Sequence[float], settings: Mapping[int, float], *, feed_per_min: float
) -> MoveLimits:
    """Return the limits of a move on which no axis exceeds its own speed and acceleration."""
    length = math.hypot(*displacement)
    share = {axis: abs(part) / length for axis, part in enumerate(displacement) if part}
    fastest = [settings.get(110 + axis, feed_per_min) / part for axis, part in share.items()]
    gains = [settings.get(120 + axis, settings[120]) / part for axis, part in share.items()]
    return MoveLimits(
        speed_per_s=min([feed_per_min, *fastest]) / 60.0,
        acceleration_per_s2=min(gains, default=settings[120]),
    )


class GrblMotors:
    """Positions and planned motion of the motors; `start`: their positions at first."""

    def __init__(
        self, cables: PanTiltCables, *, steps_per_unit: float, start: AxisPositions = ZERO_POSITIONS
    ) -> None:
        self._cables = cables
        self._history = TurningHistory(start)
        self._steps_per_unit = steps_per_unit

    def positions(self, t_ns: int) -> AxisPositions:
        """Return the positions at a time."""
        return self._history.positions(t_ns)

    def speed_per_s(self, t_ns: int) -> float:
        """Return the speed along the present displacement."""
        return math.hypot(*self._speeds(t_ns))

    def move(self, t_ns: int, goal: AxisPositions, limits: MoveLimits) -> int:
        """Move straight to the step nearest to a goal; return the time of arrival."""
        start = self.positions(t_ns)
        goal = self._nearest_step(goal)
        displacement = [to - at for to, at in zip(goal, start, strict=True)]
        length = math.hypot(*displacement)
        if length == 0.0:
            return t_ns
        unit = (displacement[0] / length, displacement[1] / length, displacement[2] / length)
        ramp_s = min(
            limits.speed_per_s / limits.acceleration_per_s2, math.sqrt(length / limits.acceleration_per_s2)
        )
        steady_s = length / (ramp_s * limits.acceleration_per_s2) - ramp_s
        for acceleration_per_s2, duration_s in (
            (limits.acceleration_per_s2, ramp_s),
            (0.0, steady_s),
            (-limits.acceleration_per_s2, ramp_s),
        ):
            t_ns = self._accelerate(t_ns, unit, acceleration_per_s2, duration_s)
        self._hold(t_ns, goal)
        return t_ns

    def slow_down(self, t_ns: int, acceleration_per_s2: float) -> int:
        """Decelerate to a stop along the present displacement; return the time of the stop."""
        speed_per_s = self.speed_per_s(t_ns)
        if speed_per_s == 0.0:
            self.stop(t_ns)
            return t_ns
        pan, tilt, rail = self._speeds(t_ns)
        unit = (pan / speed_per_s, tilt / speed_per_s, rail / speed_per_s)
        t_ns = self._accelerate(t_ns, unit, -acceleration_per_s2, speed_per_s / acceleration_per_s2)
        self._hold(t_ns, self._nearest_step(self.positions(t_ns)))
        return t_ns

    def stop(self, t_ns: int) -> None:
        """Stop at once."""
        self._hold(t_ns, self._nearest_step(self.positions(t_ns)))

    def push(self, t_ns: int, positions: AxisPositions) -> None:
        """Push the axes to positions by hand, at once, without the firmware's knowledge."""
        self._hold(t_ns, positions)

    def _speeds(self, t_ns: int) -> AxisPositions:
        return (*self._history.speed_deg_s(t_ns), self._history.slide_mm(t_ns)[1])

    def _accelerate(
        self, t_ns: int, unit: AxisPositions, acceleration_per_s2: float, duration_s: float
    ) -> int:
        """Accelerate evenly along a unit vector for a duration; return its end."""
        speed_per_s = self.speed_per_s(t_ns)
        pan_deg, tilt_deg, rail_mm = self.positions(t_ns)
        self._add_segment(
            TurnSegment(
                t_ns=t_ns,
                place_deg=(pan_deg, tilt_deg),
                speed_deg_s=(unit[0] * speed_per_s, unit[1] * speed_per_s),
                acceleration_deg_s2=(unit[0] * acceleration_per_s2, unit[1] * acceleration_per_s2),
                slide_mm=(rail_mm, unit[2] * speed_per_s, unit[2] * acceleration_per_s2),
            )
        )
        return t_ns + round(duration_s * NS_PER_S)

    def _hold(self, t_ns: int, place: AxisPositions) -> None:
        self._add_segment(TurnSegment(t_ns=t_ns, place_deg=place[:2], slide_mm=(place[2], 0.0, 0.0)))

    def _add_segment(self, segment: TurnSegment) -> None:
        self._history.add_segment(segment)
        self._cables.add_segment(segment)

    def _nearest_step(self, place: AxisPositions) -> AxisPositions:
        steps = self._steps_per_unit
        pan, tilt, rail = (round(at * steps) / steps for at in place)
        return pan, tilt, rail
