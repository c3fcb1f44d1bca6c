"""Two stepper motors under Grbl's planner: straight moves that speed up, run and slow down."""

import math
from dataclasses import dataclass

from foveacam_hardware.sim.pan_tilt import NS_PER_S, PanTiltCables, Turning, TurningHistory

Pair = tuple[float, float]
"""Pan and tilt."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How fast a straight move may be, along its way."""

    speed_deg_s: float
    acceleration_deg_s2: float


class Motors:
    """Where both motors are and what they will do; degrees from where the rig was set up."""

    def __init__(self, cables: PanTiltCables, *, steps_per_deg: float) -> None:
        self._cables = cables
        self._track = TurningHistory()
        self._steps_per_deg = steps_per_deg

    def place_deg(self, t_ns: int) -> Pair:
        """Return where they are."""
        return self._track.bearing_deg(t_ns)

    def speed_deg_s(self, t_ns: int) -> float:
        """Return how fast they are, along the way."""
        return math.hypot(*self._track.speed_deg_s(t_ns))

    def move(self, t_ns: int, goal_deg: Pair, pace: Pace) -> int:
        """Go straight to a place, or to the step nearest to it; return when they will be there."""
        start = self.place_deg(t_ns)
        goal = self._on_a_step(goal_deg)
        way = (goal[0] - start[0], goal[1] - start[1])
        length_deg = math.hypot(*way)
        if length_deg == 0.0:
            return t_ns
        unit = (way[0] / length_deg, way[1] / length_deg)
        ramp_s = min(
            pace.speed_deg_s / pace.acceleration_deg_s2, math.sqrt(length_deg / pace.acceleration_deg_s2)
        )
        top_deg_s = ramp_s * pace.acceleration_deg_s2
        steady_s = length_deg / top_deg_s - ramp_s
        for pull_deg_s2, length_s in (
            (pace.acceleration_deg_s2, ramp_s),
            (0.0, steady_s),
            (-pace.acceleration_deg_s2, ramp_s),
        ):
            t_ns = self._pull(t_ns, unit, pull_deg_s2, length_s)
        self._rest(t_ns, goal)
        return t_ns

    def slow_down(self, t_ns: int, acceleration_deg_s2: float) -> int:
        """Come to a stop on the way; return when."""
        speed_deg_s = self.speed_deg_s(t_ns)
        if speed_deg_s == 0.0:
            self.stop(t_ns)
            return t_ns
        pan, tilt = self._track.speed_deg_s(t_ns)
        unit = (pan / speed_deg_s, tilt / speed_deg_s)
        t_ns = self._pull(t_ns, unit, -acceleration_deg_s2, speed_deg_s / acceleration_deg_s2)
        self._rest(t_ns, self._on_a_step(self.place_deg(t_ns)))
        return t_ns

    def stop(self, t_ns: int) -> None:
        """Stand still at once."""
        self._rest(t_ns, self._on_a_step(self.place_deg(t_ns)))

    def _pull(self, t_ns: int, unit: Pair, pull_deg_s2: float, length_s: float) -> int:
        """Accelerate evenly along the way for a while; return its end."""
        speed_deg_s = self.speed_deg_s(t_ns)
        self._turn(
            Turning(
                t_ns=t_ns,
                place_deg=self.place_deg(t_ns),
                speed_deg_s=(unit[0] * speed_deg_s, unit[1] * speed_deg_s),
                acceleration_deg_s2=(unit[0] * pull_deg_s2, unit[1] * pull_deg_s2),
            )
        )
        return t_ns + round(length_s * NS_PER_S)

    def _rest(self, t_ns: int, place_deg: Pair) -> None:
        self._turn(Turning(t_ns=t_ns, place_deg=place_deg))

    def _turn(self, turning: Turning) -> None:
        self._track.turn(turning)
        self._cables.turn(turning)

    def _on_a_step(self, place_deg: Pair) -> Pair:
        steps = self._steps_per_deg
        return round(place_deg[0] * steps) / steps, round(place_deg[1] * steps) / steps
