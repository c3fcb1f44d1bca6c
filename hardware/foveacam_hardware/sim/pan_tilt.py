"""The simulated pan-tilt: what its motors have done, and where the rig stands because of it.

The world stands still and the rig turns. The pan axis stands upright, the tilt axis rides on it; both pass
a few centimetres below and behind the wide camera, the rail under them runs to the rig's right, and a seed
builds the workshop's errors.
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
    from foveacam_hardware.operator_config import OperatorConfig

Place: TypeAlias = tuple[float, float, float]
"""Pan and tilt in degrees, the rail in millimetres."""
SET_UP: Place = (0.0, 0.0, 0.0)
"""Where the rig was set up."""
KEPT_NS = 30_000_000_000
"""How long ago a bearing can be asked for."""
NS_PER_S = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnSegment:
    """Even acceleration of the motors from `t_ns` on: (pan, tilt) in degrees, as the motors count.

    Pan > 0 turns the rig to the right, tilt > 0 down. `slide_mm`: place, speed and acceleration (millimetres,
    seconds) of the rail below both, > 0 to the right.
    """

    t_ns: int
    place_deg: tuple[float, float]
    speed_deg_s: tuple[float, float] = (0.0, 0.0)
    acceleration_deg_s2: tuple[float, float] = (0.0, 0.0)
    slide_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def place_at(self, t_ns: int) -> tuple[float, float]:
        """Return the bearing (pan, tilt), degrees, at a moment of this turning; exact while at rest."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        pan, tilt = (
            place + t_s * (speed + 0.5 * t_s * acceleration)
            for place, speed, acceleration in zip(
                self.place_deg, self.speed_deg_s, self.acceleration_deg_s2, strict=True
            )
        )
        return pan, tilt

    def speed_at(self, t_ns: int) -> tuple[float, float]:
        """Return the speed (pan, tilt), degrees a second, at a moment of this turning."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        pan, tilt = (
            speed + t_s * acceleration
            for speed, acceleration in zip(self.speed_deg_s, self.acceleration_deg_s2, strict=True)
        )
        return pan, tilt

    def slide_at(self, t_ns: int) -> float:
        """Return the place on the rail, mm, at a moment of this turning; exact while at rest."""
        t_s = (t_ns - self.t_ns) / NS_PER_S
        place_mm, speed_mm_s, acceleration_mm_s2 = self.slide_mm
        return place_mm + t_s * (speed_mm_s + 0.5 * t_s * acceleration_mm_s2)

    def slide_speed_at(self, t_ns: int) -> float:
        """Return the speed on the rail, mm a second, at a moment of this turning."""
        _, speed_mm_s, acceleration_mm_s2 = self.slide_mm
        return speed_mm_s + (t_ns - self.t_ns) / NS_PER_S * acceleration_mm_s2


class PanTiltCables(Protocol):
    """The shafts between the pan-tilt's motors and the rig; calls come in the order of their times."""

    def turn(self, turning: TurnSegment) -> None:
        """Take what the motors do from `turning.t_ns` on."""
        ...


class TurningHistory:
    """What the motors have done: bearings at any moment of the last half minute, and of all rest before.

    `start`: where they stood at the beginning.
    """

    def __init__(self, start: Place = SET_UP) -> None:
        self._lock = threading.Lock()
        self._turnings = [TurnSegment(t_ns=0, place_deg=start[:2], slide_mm=(start[2], 0.0, 0.0))]

    def turn(self, turning: TurnSegment) -> None:
        """Go on with `turning`; what was planned after its beginning is void."""
        with self._lock:
            keep = bisect_right(self._turnings, turning.t_ns, key=_t_ns)
            first = max(0, bisect_right(self._turnings, turning.t_ns - KEPT_NS, key=_t_ns) - 1)
            self._turnings = [*self._turnings[first:keep], turning]

    def bearing_deg(self, t_ns: int) -> tuple[float, float]:
        """Return (pan, tilt), degrees, at a moment."""
        turning = self._at(t_ns)
        return turning.place_at(max(t_ns, turning.t_ns))

    def speed_deg_s(self, t_ns: int) -> tuple[float, float]:
        """Return the speed (pan, tilt), degrees a second, at a moment."""
        turning = self._at(t_ns)
        return turning.speed_at(max(t_ns, turning.t_ns))

    def slide_mm(self, t_ns: int) -> tuple[float, float]:
        """Return place and speed on the rail, mm and mm a second, at a moment."""
        turning = self._at(t_ns)
        moment_ns = max(t_ns, turning.t_ns)
        return turning.slide_at(moment_ns), turning.slide_speed_at(moment_ns)

    def place(self, t_ns: int) -> Place:
        """Return where all motors are at a moment."""
        return (*self.bearing_deg(t_ns), self.slide_mm(t_ns)[0])

    def _at(self, t_ns: int) -> TurnSegment:
        with self._lock:
            return self._turnings[max(0, bisect_right(self._turnings, t_ns, key=_t_ns) - 1)]


def _t_ns(turning: TurnSegment) -> int:
    return turning.t_ns


RAMP_S = 0.3
"""To get going, and to stop."""
REACTION_S = 0.2
MOST_SIGMAS = 2.0


class Operator:
    """Turns by hand what no motor turns; `hands` holds where that has brought the rig."""

    def __init__(self, hands: TurningHistory, clock: Clock, config: "OperatorConfig", *, seed: int) -> None:
        self._hands = hands
        self._clock = clock
        self._config = config
        self._rng = np.random.default_rng([seed, 0x0BE7])

    def told(self, wanted: PanTiltPose | None) -> None:
        """Take note of a bearing that is wanted; None: let go of the rig, wherever it is."""
        now_ns = self._clock.now_ns()
        if wanted is None:
            self._rest(now_ns + round(REACTION_S * NS_PER_S))
            return
        begin_ns = now_ns + round(self._config.delay_s * NS_PER_S)
        self._rest(begin_ns)  # whatever was being done
        missed = np.clip(self._rng.standard_normal(2), -MOST_SIGMAS, MOST_SIGMAS) * self._config.error_deg
        goal = np.rad2deg([wanted.pan_rad, wanted.tilt_rad]) + missed
        self._turn(begin_ns, goal - np.array(self._hands.bearing_deg(begin_ns)))

    def _turn(self, t_ns: int, way_deg: NDArray[np.float64]) -> None:
        """Turn by (pan, tilt), degrees: get going, keep the pace, stop."""
        length_deg = float(np.linalg.norm(way_deg))
        if length_deg == 0.0:
            return
        speed_deg_s = min(self._config.speed_deg_s, length_deg / RAMP_S)
        steady_s = length_deg / speed_deg_s - RAMP_S
        pull_deg_s2 = speed_deg_s / RAMP_S
        pan, tilt = (way_deg / length_deg).tolist()
        for pull, spent_s in ((pull_deg_s2, RAMP_S), (0.0, steady_s), (-pull_deg_s2, RAMP_S)):
            speed = math.hypot(*self._hands.speed_deg_s(t_ns))
            turning = TurnSegment(
                t_ns=t_ns,
                place_deg=self._hands.bearing_deg(t_ns),
                speed_deg_s=(pan * speed, tilt * speed),
                acceleration_deg_s2=(pan * pull, tilt * pull),
            )
            self._hands.turn(turning)
            t_ns += round(spent_s * NS_PER_S)
        self._rest(t_ns)

    def _rest(self, t_ns: int) -> None:
        self._hands.turn(TurnSegment(t_ns=t_ns, place_deg=self._hands.bearing_deg(t_ns)))
