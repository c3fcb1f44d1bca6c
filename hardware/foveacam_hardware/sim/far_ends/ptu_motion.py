"""The two motors of a FLIR unit: each goes its own way to its goal, speeding up and slowing down evenly."""

import math
from dataclasses import dataclass

from foveacam_hardware.sim.pan_tilt import NS_PER_S, ZERO_POSITIONS, AxisPositions, PanTiltCables, TurnSegment

ARC_SECONDS_A_DEG = 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Leg:
    """Even acceleration from `t_ns` on, in steps."""

    t_ns: int
    at: float
    speed: float = 0.0
    acceleration: float = 0.0

    def state_at(self, t_ns: int) -> tuple[float, float]:
        """Return position and speed at a moment of this leg."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        return self.at + t_s * (
            self.speed + 0.5 * t_s * self.acceleration
        ), self.speed + t_s * self.acceleration


class StepMotor:
    """One axis, in steps as its windings count; exact where it rests."""

    def __init__(self, t_ns: int, *, at: float) -> None:
        self.legs = [_Leg(t_ns=t_ns, at=at)]

    def position_at(self, t_ns: int) -> float:
        """Return where it is."""
        return self._leg(t_ns).state_at(t_ns)[0]

    def state_at(self, t_ns: int) -> tuple[float, float, float]:
        """Return position, speed and acceleration from a moment on."""
        leg = self._leg(t_ns)
        return (*leg.state_at(t_ns), leg.acceleration)

    def rest_ns(self) -> int:
        """Return when it comes to rest for good."""
        return self.legs[-1].t_ns

    def stop(self, t_ns: int) -> None:
        """Stand still at once."""
        self.legs = [_Leg(t_ns=t_ns, at=float(round(self.position_at(t_ns))))]

    def slow_down(self, t_ns: int, acceleration: float) -> int:
        """Come to rest as fast as it may; return when."""
        at, speed = self._leg(t_ns).state_at(t_ns)
        if abs(speed) < 1e-9:
            self.stop(t_ns)
            return t_ns
        way = math.copysign(acceleration, -speed)
        slow = _Leg(t_ns=t_ns, at=at, speed=speed, acceleration=way)
        end_ns = t_ns + round(abs(speed) / acceleration * NS_PER_S)
        self.legs = [slow, _Leg(t_ns=end_ns, at=float(round(slow.state_at(end_ns)[0])))]
        return end_ns

    def move_to(self, t_ns: int, goal: int, *, speed: float, acceleration: float) -> int:
        """Go to a position, from a stop if it moves; return when it will be there."""
        t_ns = self.slow_down(t_ns, acceleration)
        legs, start = self.legs[:-1], self.legs[-1].at
        length = abs(goal - start)
        if length:
            ramp_s = min(speed / acceleration, math.sqrt(length / acceleration))
            top = math.copysign(ramp_s * acceleration, goal - start)
            pull = math.copysign(acceleration, goal - start)
            leg, steady_s = _Leg(t_ns=t_ns, at=start, acceleration=pull), length / abs(top) - ramp_s
            legs.append(leg)
            for length_s, pulled in ((ramp_s, 0.0), (steady_s, -pull)):
                t_ns += round(length_s * NS_PER_S)
                at, _ = leg.state_at(t_ns)
                leg = _Leg(t_ns=t_ns, at=at, speed=top, acceleration=pulled)
                legs.append(leg)
            t_ns += round(ramp_s * NS_PER_S)
        self.legs = [*legs, _Leg(t_ns=t_ns, at=float(goal))]
        return t_ns

    def _leg(self, t_ns: int) -> _Leg:
        begun = [leg for leg in self.legs if leg.t_ns <= t_ns]
        return begun[-1] if begun else self.legs[0]


class PtuMotors:
    """Both axes, and the rig on them. `seconds_a_step`: of arc. It counts to the left and up."""

    def __init__(
        self,
        cables: PanTiltCables,
        t_ns: int,
        *,
        seconds_a_step: float,
        start: AxisPositions = ZERO_POSITIONS,
    ) -> None:
        self._cables = cables
        self.deg_a_step = seconds_a_step / ARC_SECONDS_A_DEG
        self.pan, self.tilt = (StepMotor(t_ns, at=-place_deg / self.deg_a_step) for place_deg in start[:2])

    def report_motion(self, t_ns: int) -> None:
        """Tell the rig what both will do from `t_ns` on; what was announce of later is void."""
        moments = {leg.t_ns for axis in (self.pan, self.tilt) for leg in axis.legs if leg.t_ns > t_ns}
        for moment_ns in sorted({t_ns} | moments):
            pan, tilt = self.pan.state_at(moment_ns), self.tilt.state_at(moment_ns)
            place, speed, acceleration = (
                (-self.deg_a_step * of_pan, -self.deg_a_step * of_tilt)
                for of_pan, of_tilt in zip(pan, tilt, strict=True)
            )
            self._cables.add_segment(
                TurnSegment(
                    t_ns=moment_ns, place_deg=place, speed_deg_s=speed, acceleration_deg_s2=acceleration
                )
            )
