"""Motion of the simulated pan-tilt and rail: segments of even acceleration, by motors or by hand.

The resulting pose of the rig in its scene is in `rig_pose`; the motors' controllers are in `far_ends`.
"""

import math
import threading
from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, PanTiltPose

if TYPE_CHECKING:  # the processes of the far ends import this module, and start without pydantic
    from foveacam_hardware.pan_tilt_config import OperatorConfig

AxisPositions: TypeAlias = tuple[float, float, float]
"""Pan and tilt in degrees, rail in millimetres."""
ZERO_POSITIONS: AxisPositions = (0.0, 0.0, 0.0)
"""The positions at which the rig was set up."""
HISTORY_NS = 30_000_000_000
"""Age up to which positions can be requested."""
NS_PER_S = 1e9
OPERATOR_RAMP_S = 0.3
"""Time to accelerate, and to stop."""
OPERATOR_REACTION_S = 0.2
MAX_ERROR_SIGMAS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnSegment:
    """Even acceleration from `t_ns` on: (pan, tilt) in degrees, as the motors count.

    Pan > 0 turns the rig to the right, tilt > 0 down. `slide_mm`: position, speed and acceleration on the
    rail (millimetres, seconds), > 0 to the right.
    """

    t_ns: int
    place_deg: tuple[float, float]
    speed_deg_s: tuple[float, float] = (0.0, 0.0)
    acceleration_deg_s2: tuple[float, float] = (0.0, 0.0)
    slide_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def bearing_at(self, t_ns: int) -> tuple[float, float]:
        """Return (pan, tilt), degrees, at a time of this segment; exact at rest."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        pan, tilt = (
            position + t_s * (speed + 0.5 * t_s * acceleration)
            for position, speed, acceleration in zip(
                self.place_deg, self.speed_deg_s, self.acceleration_deg_s2, strict=True
            )
        )
        return pan, tilt

    def speed_at(self, t_ns: int) -> tuple[float, float]:
        """Return the speed (pan, tilt), degrees per second, at a time of this segment."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        pan, tilt = (
            speed + t_s * acceleration
            for speed, acceleration in zip(self.speed_deg_s, self.acceleration_deg_s2, strict=True)
        )
        return pan, tilt

    def slide_at(self, t_ns: int) -> float:
        """Return the position on the rail, mm, at a time of this segment; exact at rest."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        position_mm, speed_mm_s, acceleration_mm_s2 = self.slide_mm
        return position_mm + t_s * (speed_mm_s + 0.5 * t_s * acceleration_mm_s2)

    def slide_speed_at(self, t_ns: int) -> float:
        """Return the speed on the rail, mm per second, at a time of this segment."""
        _, speed_mm_s, acceleration_mm_s2 = self.slide_mm
        return speed_mm_s + (t_ns - self.t_ns) / NS_PER_S * acceleration_mm_s2


class PanTiltCables(Protocol):
    """The shafts between the motors and the rig; calls come in the order of their times."""

    def add_segment(self, segment: TurnSegment) -> None:
        """Move by `segment` from its `t_ns` on; it replaces segments with later times."""
        ...


class TurningHistory:
    """Positions of the axes at any time of the last 30 s; `start`: the positions before the first segment."""

    def __init__(self, start: AxisPositions = ZERO_POSITIONS) -> None:
        self._lock = threading.Lock()
        self._segments = [TurnSegment(t_ns=0, place_deg=start[:2], slide_mm=(start[2], 0.0, 0.0))]

    def add_segment(self, segment: TurnSegment) -> None:
        """Append a segment; segments that would begin after it are void."""
        with self._lock:
            keep = bisect_right(self._segments, segment.t_ns, key=_t_ns)
            first = max(0, bisect_right(self._segments, segment.t_ns - HISTORY_NS, key=_t_ns) - 1)
            self._segments = [*self._segments[first:keep], segment]

    def bearing_deg(self, t_ns: int) -> tuple[float, float]:
        """Return (pan, tilt), degrees, at a time."""
        segment = self._at(t_ns)
        return segment.bearing_at(max(t_ns, segment.t_ns))

    def speed_deg_s(self, t_ns: int) -> tuple[float, float]:
        """Return the speed (pan, tilt), degrees per second, at a time."""
        segment = self._at(t_ns)
        return segment.speed_at(max(t_ns, segment.t_ns))

    def slide_mm(self, t_ns: int) -> tuple[float, float]:
        """Return position and speed on the rail, mm and mm per second, at a time."""
        segment = self._at(t_ns)
        begun_ns = max(t_ns, segment.t_ns)
        return segment.slide_at(begun_ns), segment.slide_speed_at(begun_ns)

    def positions(self, t_ns: int) -> AxisPositions:
        """Return the positions of all axes at a time."""
        return (*self.bearing_deg(t_ns), self.slide_mm(t_ns)[0])

    def _at(self, t_ns: int) -> TurnSegment:
        with self._lock:
            return self._segments[max(0, bisect_right(self._segments, t_ns, key=_t_ns) - 1)]


def _t_ns(segment: TurnSegment) -> int:
    return segment.t_ns


class Operator:
    """A simulated person who turns the rig by hand; `motion` receives the turns."""

    def __init__(self, motion: TurningHistory, clock: Clock, config: "OperatorConfig", *, seed: int) -> None:
        self._motion = motion
        self._clock = clock
        self._config = config
        self._rng = np.random.default_rng([seed, 0x0BE7])

    def turn_to(self, wanted: PanTiltPose | None) -> None:
        """Turn to a pose after the operator's delay, with an error; None stops the turn where it is."""
        now_ns = self._clock.now_ns()
        if wanted is None:
            self._add_rest(now_ns + round(OPERATOR_REACTION_S * NS_PER_S))
            return
        begin_ns = now_ns + round(self._config.delay_s * NS_PER_S)
        self._add_rest(begin_ns)  # ends the turn in progress
        error_deg = (
            np.clip(self._rng.standard_normal(2), -MAX_ERROR_SIGMAS, MAX_ERROR_SIGMAS)
            * self._config.error_deg
        )
        goal = np.rad2deg([wanted.pan_rad, wanted.tilt_rad]) + error_deg
        self._add_turn(begin_ns, goal - np.array(self._motion.bearing_deg(begin_ns)))

    def _add_turn(self, t_ns: int, displacement_deg: NDArray[np.float64]) -> None:
        """Turn by (pan, tilt), degrees: accelerate, run, decelerate."""
        length_deg = float(np.linalg.norm(displacement_deg))
        if length_deg == 0.0:
            return
        speed_deg_s = min(self._config.speed_deg_s, length_deg / OPERATOR_RAMP_S)
        steady_s = length_deg / speed_deg_s - OPERATOR_RAMP_S
        acceleration_deg_s2 = speed_deg_s / OPERATOR_RAMP_S
        pan, tilt = (displacement_deg / length_deg).tolist()
        for along_deg_s2, duration_s in (
            (acceleration_deg_s2, OPERATOR_RAMP_S),
            (0.0, steady_s),
            (-acceleration_deg_s2, OPERATOR_RAMP_S),
        ):
            speed = math.hypot(*self._motion.speed_deg_s(t_ns))
            segment = TurnSegment(
                t_ns=t_ns,
                place_deg=self._motion.bearing_deg(t_ns),
                speed_deg_s=(pan * speed, tilt * speed),
                acceleration_deg_s2=(pan * along_deg_s2, tilt * along_deg_s2),
            )
            self._motion.add_segment(segment)
            t_ns += round(duration_s * NS_PER_S)
        self._add_rest(t_ns)

    def _add_rest(self, t_ns: int) -> None:
        self._motion.add_segment(TurnSegment(t_ns=t_ns, place_deg=self._motion.bearing_deg(t_ns)))
