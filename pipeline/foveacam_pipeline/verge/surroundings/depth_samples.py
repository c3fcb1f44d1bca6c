"""Measured depths in directions from the rig's origin, and the Protocol of their source.

Inverse depth along z is used throughout: a plane is a linear function of the tangents in it, and its error
hardly depends on distance.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DepthSamples:
    """Measured points, rig frame.

    `tangents`: (n, 2) float64, X/Z and Y/Z. `inverse_z_per_m`: (n,) float64, 1/Z. `sigma_per_m`: (n,)
    float64, standard error of `inverse_z_per_m`, its growth with age included.
    """

    tangents: NDArray[np.float64]
    inverse_z_per_m: NDArray[np.float64]
    sigma_per_m: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.inverse_z_per_m)

    @classmethod
    def none(cls) -> "DepthSamples":
        """Return samples of nothing."""
        return cls(tangents=np.empty((0, 2)), inverse_z_per_m=np.empty(0), sigma_per_m=np.empty(0))

    def only(self, kept: NDArray[np.bool_] | NDArray[np.intp]) -> "DepthSamples":
        """Return some of the samples, chosen by a mask (n,) or by their indices."""
        return DepthSamples(
            tangents=self.tangents[kept],
            inverse_z_per_m=self.inverse_z_per_m[kept],
            sigma_per_m=self.sigma_per_m[kept],
        )

    def joined(self, other: "DepthSamples") -> "DepthSamples":
        """Return these samples, then the others."""
        return DepthSamples(
            tangents=np.vstack([self.tangents, other.tangents]),
            inverse_z_per_m=np.append(self.inverse_z_per_m, other.inverse_z_per_m),
            sigma_per_m=np.append(self.sigma_per_m, other.sigma_per_m),
        )

    def near(self, target: NDArray[np.float64], *, reach_tan: float) -> "DepthSamples":
        """Return the samples within `reach_tan` (tangent units) of a direction: (2,) tangents."""
        offset = self.tangents - np.asarray(target, dtype=np.float64)
        return self.only(np.hypot(offset[:, 0], offset[:, 1]) <= reach_tan)


class DepthContext(Protocol):
    """Source of measured depths over the whole wide view."""

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        """Return the samples within `reach_tan` (tangent units) of a direction: (2,) tangents."""
        ...
