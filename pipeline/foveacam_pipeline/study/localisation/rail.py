"""The design of the experiment: figurine, infinity-shaped rail and its slots, standoffs (Fig. 4).

The simulated scene `rail` has the same figurine and stand; positions are in the rig frame, metres.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SCENE = "rail"
"""The name of the simulated scene."""
HALF_WIDTH_M = 0.12
"""Half of the infinity sign's width: a rail of 0.24 m, as large as a 3D printer prints. Chosen by us."""
LOBE_DEPTH_M = HALF_WIDTH_M / np.sqrt(2.0)
"""Depth of each of its two lobes."""
FOOT_Y_M = 0.12
"""Height of the slots: the figurine's chest is then as high as the eyes."""
CHEST_FRONT_M = 0.0181
"""Distance of the surface in the middle of the chest from the figurine's axis, towards the rig."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RailPosition:
    """A place of the figurine's foot, metres to the right of and behind the rail's geometric centre."""

    x_m: float
    z_m: float

    def foot_m(self, standoff_m: float) -> tuple[float, float, float]:
        """Return the place of the figurine's foot for a rail at a standoff, rig frame."""
        return self.x_m, FOOT_Y_M, standoff_m + self.z_m

    def target_m(self, standoff_m: float) -> tuple[float, float, float]:
        """Return the place of the target, the middle of the chest's surface, rig frame."""
        return self.x_m, 0.0, standoff_m + self.z_m - CHEST_FRONT_M


CENTRE = RailPosition(x_m=0.0, z_m=0.0)


def slots(count: int) -> tuple[RailPosition, ...]:
    """Return the slots (an even number) in order along the infinity sign; none is its crossing."""
    t = (np.arange(count) + 0.25) * 2.0 * np.pi / count
    x_m, z_m = infinity_m(t)
    return tuple(RailPosition(x_m=x, z_m=z) for x, z in zip(x_m.tolist(), z_m.tolist(), strict=True))


def infinity_m(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and z, metres from the centre, of a lemniscate of Bernoulli at parameters 0 to 2π."""
    across = HALF_WIDTH_M * np.cos(t) / (1.0 + np.sin(t) ** 2)
    return across, across * np.sin(t)


def targets_m(positions: tuple[RailPosition, ...], standoff_m: float) -> NDArray[np.float64]:
    """Return the (n, 3) targets of positions on a rail at a standoff, rig frame."""
    return np.array([position.target_m(standoff_m) for position in positions])
