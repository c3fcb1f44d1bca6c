"""The two motors of a FLIR unit, which move independently with trapezoidal speed."""

import math
from dataclasses import dataclass

from foveacam_hardware.sim.pan_tilt import NS_PER_S, ZERO_POSITIONS, AxisPositions, PanTiltCables, TurnSegment

ARC_SECONDS_PER_DEG = 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Leg:
    """A time span of even acceleration, from `t_ns` on, in steps."""

    t_ns: int
    at: float
    speed: float = 0.0
    acceleration: float = 0.0

    def state_at(self, t_ns: int) -> tuple[float, float]:
        """Return position and speed at a time of this leg."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        return self.at + t_s * (
            self.speed + 0.5 * t_s * self.acceleration
        ), self.speed + t_s * self.acceleration


class StepMotor:
    """One axis, in motor steps; exact at rest."""

    def __init__(self, t_ns: int, *, at: float) -> None:
        self.legs = [_Leg(t_ns=t_ns, at=at)]

    def position_at(self, t_ns: int) -> float:
        """Return the position at a time."""
        return self._leg(t_ns).state_at(t_ns)[0]

    def state_at(self, t_ns: int) -> tuple[float, float, float]:
        """Return position, speed and acceleration at a time."""
        leg = self._leg(t_ns)
        return (*leg.state_at(t_ns), leg.acceleration)

    def rest_ns(self) -> int:
        """Return the time from which it rests."""
        return self.legs[-1].t_ns

    def stop(self, t_ns: int) -> None:
        """Stop at once, at the nearest step."""
        self.legs = [_Leg(t_ns=t_ns, at=float(round(self.position_at(t_ns))))]

    def slow_down(self, t_ns: int, acceleration: float) -> int:
        """Decelerate to a stop; return the time of the stop."""
        at, speed = self._leg(t_ns).state_at(t_ns)
        if abs(speed) < 1e-9:
            self.stop(t_ns)
            return t_ns
        braking = math.copysign(acceleration, -speed)
        slow = _Leg(t_ns=t_ns, at=at, speed=speed, acceleration=braking)
        end_ns = t_ns + round(abs(speed) / acceleration * NS_PER_S)
        self.legs = [slow, _Leg(t_ns=end_ns, at=float(round(slow.state_at(end_ns)[0])))]
        return end_ns

    def move_to(self, t_ns: int, goal: int, *, speed: float, acceleration: float) -> int:
        """Move to a position, after a stop if it is moving; return the time of arrival."""
        t_ns = self.slow_down(t_ns, acceleration)
        legs, start = self.legs[:-1], self.legs[-1].at
        length = abs(goal - start)
        if length:
            ramp_s = min(speed / acceleration, math.sqrt(length / acceleration))
            top = math.copysign(ramp_s * acceleration, goal - start)
            signed = math.copysign(acceleration, goal - start)
            leg, steady_s = _Leg(t_ns=t_ns, at=start, acceleration=signed), length / abs(top) - ramp_s
            legs.append(leg)
            for duration_s, next_acceleration in ((ramp_s, 0.0), (steady_s, -signed)):
                t_ns += round(duration_s * NS_PER_S)
                at, _ = leg.state_at(t_ns)
                leg = _Leg(t_ns=t_ns, at=at, speed=top, acceleration=next_acceleration)
                legs.append(leg)
            t_ns += round(ramp_s * NS_PER_S)
        self.legs = [*legs, _Leg(t_ns=t_ns, at=float(goal))]
        return t_ns

    def _leg(self, t_ns: int) -> _Leg:
        begun = [leg for leg in self.legs if leg.t_ns <= t_ns]
        return begun[-1] if begun else self.legs[0]


class PtuMotors:
    """Both axes; their steps count to the left and up. `arc_seconds_per_step`: the size of a step."""

    def __init__(
        self,
        cables: PanTiltCables,
        t_ns: int,
        *,
        arc_seconds_per_step: float,
        start: AxisPositions = ZERO_POSITIONS,
    ) -> None:
        self._cables = cables
        self.deg_per_step = arc_seconds_per_step / ARC_SECONDS_PER_DEG
        self.pan, self.tilt = (StepMotor(t_ns, at=-place_deg / self.deg_per_step) for place_deg in start[:2])

    def report_motion(self, t_ns: int) -> None:
        """Report the planned motion of both axes from `t_ns` on; it replaces earlier reports."""
        times_ns = {leg.t_ns for axis in (self.pan, self.tilt) for leg in axis.legs if leg.t_ns > t_ns}
        for time_ns in sorted({t_ns} | times_ns):
            pan, tilt = self.pan.state_at(time_ns), self.tilt.state_at(time_ns)
            position, speed, acceleration = (
                (-self.deg_per_step * of_pan, -self.deg_per_step * of_tilt)
                for of_pan, of_tilt in zip(pan, tilt, strict=True)
            )
            self._cables.add_segment(
                TurnSegment(
                    t_ns=time_ns, place_deg=position, speed_deg_s=speed, acceleration_deg_s2=acceleration
                )
            )
