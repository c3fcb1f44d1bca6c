"""How an axis answers a step of its reference: settling, overshoot, cost, and the drawing of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SETTLED_SHARE = 0.02
"""A step has settled once it stays within this share of its height."""
OVERSHOOT_WEIGHT = 2.0
VARIATION_WEIGHT = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepResponse:
    """One axis after a step, look by look: time since the first, s, and the share of the step, (n,) each."""

    t_s: NDArray[np.float64]
    share: NDArray[np.float64]

    @property
    def settle_s(self) -> float | None:
        """Time after which it stays within `SETTLED_SHARE` of the step; None where it never does."""
        outside = np.flatnonzero(np.abs(self.share - 1.0) > SETTLED_SHARE)
        if not len(outside):
            return float(self.t_s[0])
        after = int(outside[-1]) + 1
        return float(self.t_s[after]) if after < len(self.t_s) else None

    @property
    def overshoot(self) -> float:
        """By how much it goes beyond the step, as a share of it."""
        return max(0.0, float(self.share.max()) - 1.0)

    @property
    def cost(self) -> float:
        """Integral of time by error, twice the square of the overshoot, and a little for each move.

        Time counts in looks, divided by the number of looks squared.
        """
        looks = np.arange(1, len(self.share) + 1)
        itae = float(np.sum(looks * np.abs(1.0 - self.share))) / len(looks)
        moves = float(np.sum(np.abs(np.diff(self.share))))
        return itae + OVERSHOOT_WEIGHT * self.overshoot**2 + VARIATION_WEIGHT * moves


def step_response(times_ns: Sequence[int], shares: Sequence[float]) -> StepResponse:
    """Return the response from the looks after a step: their times and the shares that they show."""
    t_s = (np.array(times_ns, dtype=np.float64) - times_ns[0]) / 1e9
    return StepResponse(t_s=t_s, share=np.array(shares))
