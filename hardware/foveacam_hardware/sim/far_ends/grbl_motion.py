"""Stepper motors under Grbl's planner: straight moves of all axes that speed up, run and slow down."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from foveacam_hardware.sim.pan_tilt import NS_PER_S, SET_UP, PanTiltCables, Place, TurningHistory, TurnSegment


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveLimits:
    """How fast a straight move may be, along its way, in the axes' own units."""

    speed_per_s: float
    acceleration_per_s2: float


def pace_along(way: Sequence[float], settings: Mapping[int, float], *, feed_per_min: float) -> MoveLimits:
    """Return how fast it goes along a way on which no axis exceeds its own speed and acceleration."""
    length = math.hypot(*way)
    share = {axis: abs(part) / length for axis, part in enumerate(way) if part}
    fastest = [settings.get(110 + axis, feed_per_min) / part for axis, part in share.items()]
    gains = [settings.get(120 + axis, settings[120]) / part for axis, part in share.items()]
    return MoveLimits(
        speed_per_s=min([feed_per_min, *fastest]) / 60.0,
        acceleration_per_s2=min(gains, default=settings[120]),
    )


class GrblMotors:
    """Where the motors are and what they will do, from `start` on."""

    def __init__(self, cables: PanTiltCables, *, steps_per_unit: float, start: Place = SET_UP) -> None:
        self._cables = cables
        self._track = TurningHistory(start)
        self._steps_per_unit = steps_per_unit

    def place(self, t_ns: int) -> Place:
        """Return where they are."""
        return self._track.place(t_ns)

    def speed_per_s(self, t_ns: int) -> float:
        """Return how fast they are, along the way."""
        return math.hypot(*self._speeds(t_ns))

    def move(self, t_ns: int, goal: Place, pace: MoveLimits) -> int:
        """Go straight to a place, or to the step nearest to it; return when they will be there."""
        start = self.place(t_ns)
        goal = self._on_a_step(goal)
        way = [there - here for there, here in zip(goal, start, strict=True)]
        length = math.hypot(*way)
        if length == 0.0:
            return t_ns
        unit = (way[0] / length, way[1] / length, way[2] / length)
        ramp_s = min(
            pace.speed_per_s / pace.acceleration_per_s2, math.sqrt(length / pace.acceleration_per_s2)
        )
        steady_s = length / (ramp_s * pace.acceleration_per_s2) - ramp_s
        for pull_per_s2, length_s in (
            (pace.acceleration_per_s2, ramp_s),
            (0.0, steady_s),
            (-pace.acceleration_per_s2, ramp_s),
        ):
            t_ns = self._pull(t_ns, unit, pull_per_s2, length_s)
        self._rest(t_ns, goal)
        return t_ns

    def slow_down(self, t_ns: int, acceleration_per_s2: float) -> int:
        """Come to a stop on the way; return when."""
        speed_per_s = self.speed_per_s(t_ns)
        if speed_per_s == 0.0:
            self.stop(t_ns)
            return t_ns
        pan, tilt, rail = self._speeds(t_ns)
        unit = (pan / speed_per_s, tilt / speed_per_s, rail / speed_per_s)
        t_ns = self._pull(t_ns, unit, -acceleration_per_s2, speed_per_s / acceleration_per_s2)
        self._rest(t_ns, self._on_a_step(self.place(t_ns)))
        return t_ns

    def stop(self, t_ns: int) -> None:
        """Stand still at once."""
        self._rest(t_ns, self._on_a_step(self.place(t_ns)))

    def _speeds(self, t_ns: int) -> Place:
        return (*self._track.speed_deg_s(t_ns), self._track.slide_mm(t_ns)[1])

    def _pull(self, t_ns: int, unit: Place, pull_per_s2: float, length_s: float) -> int:
        """Accelerate evenly along the way for a while; return its end."""
        speed_per_s = self.speed_per_s(t_ns)
        pan_deg, tilt_deg, rail_mm = self.place(t_ns)
        self._turn(
            TurnSegment(
                t_ns=t_ns,
                place_deg=(pan_deg, tilt_deg),
                speed_deg_s=(unit[0] * speed_per_s, unit[1] * speed_per_s),
                acceleration_deg_s2=(unit[0] * pull_per_s2, unit[1] * pull_per_s2),
                slide_mm=(rail_mm, unit[2] * speed_per_s, unit[2] * pull_per_s2),
            )
        )
        return t_ns + round(length_s * NS_PER_S)

    def _rest(self, t_ns: int, place: Place) -> None:
        self._turn(TurnSegment(t_ns=t_ns, place_deg=place[:2], slide_mm=(place[2], 0.0, 0.0)))

    def _turn(self, turning: TurnSegment) -> None:
        self._track.turn(turning)
        self._cables.turn(turning)

    def _on_a_step(self, place: Place) -> Place:
        steps = self._steps_per_unit
        pan, tilt, rail = (round(at * steps) / steps for at in place)
        return pan, tilt, rail
