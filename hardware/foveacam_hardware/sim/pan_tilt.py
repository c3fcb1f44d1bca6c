"""The simulated pan-tilt: what its motors have done, and where the rig stands because of it.

The world stands still and the rig turns. The pan axis stands upright, the tilt axis rides on it; both pass
a few centimetres below and behind the wide camera, the rail under them runs to the rig's right, and a seed
builds the workshop's errors.
"""

import threading
from bisect import bisect_right
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.optics import rotation

Matrix: TypeAlias = NDArray[np.float64]
"""(4, 4) float64, a rigid motion, metres."""

Place: TypeAlias = tuple[float, float, float]
"""Pan and tilt in degrees, the rail in millimetres."""
SET_UP: Place = (0.0, 0.0, 0.0)
"""Where the rig was set up."""

PIVOT_M = (0.0, 0.055, -0.035)  # deduced: a rig's plate on a motorised head
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


class Pedestal:
    """The axes and the rail, as built: where each stands in the rig when all are at zero."""

    def __init__(self, *, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x9A47])
        pan_lean, tilt_lean = np.deg2rad(rng.uniform(-0.2, 0.2, (2, 2)))
        self._pan_axis = _unit(pan_lean[0], 1.0, pan_lean[1])  # turns +z towards +x
        self._tilt_axis = -_unit(1.0, tilt_lean[0], tilt_lean[1])  # turns +z towards +y
        pivots_m = np.array(PIVOT_M) + rng.uniform(-2e-3, 2e-3, (2, 3))
        self._pan_m, self._tilt_m = pivots_m
        rail_lean = np.deg2rad(rng.uniform(-0.3, 0.3, 2))
        self._rail_axis = _unit(1.0, rail_lean[0], rail_lean[1])

    def rig_from_world(self, pan_deg: float, tilt_deg: float, slide_mm: float = 0.0) -> Matrix:
        """Return the rigid motion (4, 4) from the world, where the rig stands at 0/0, to the moved rig."""
        pan = _about(self._pan_axis, self._pan_m, np.deg2rad(pan_deg))
        tilt = _about(self._tilt_axis, self._tilt_m, np.deg2rad(tilt_deg))
        world_from_rig = pan @ tilt
        world_from_rig[:3, 3] += 1e-3 * slide_mm * self._rail_axis  # the pan-tilt stands on the rail
        back = np.eye(4)
        back[:3, :3] = world_from_rig[:3, :3].T
        back[:3, 3] = -world_from_rig[:3, :3].T @ world_from_rig[:3, 3]
        return back


def _unit(x: float, y: float, z: float) -> NDArray[np.float64]:
    vector = np.array([x, y, z])
    return np.asarray(vector / np.linalg.norm(vector), dtype=np.float64)


def _about(axis: NDArray[np.float64], through_m: NDArray[np.float64], angle_rad: float) -> Matrix:
    """Return the rotation (4, 4) by an angle about an axis through a point."""
    turned = np.eye(4)
    turned[:3, :3] = rotation(axis * angle_rad)
    turned[:3, 3] = through_m - turned[:3, :3] @ through_m
    return turned
