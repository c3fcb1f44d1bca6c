"""Response of an axis to a step of its reference: settling time, overshoot and cost."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SETTLED_SHARE = 0.02
"""Settling band, as a share of the step."""
OVERSHOOT_WEIGHT = 2.0
VARIATION_WEIGHT = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepResponse:
    """One axis after a step: time since the first look, s, and response as a share of the step, (n,) each."""

    t_s: NDArray[np.float64]
    share: NDArray[np.float64]

    @property
    def settle_s(self) -> float | None:
        """Settling time: the response stays within `SETTLED_SHARE` from then on; None if it never does."""
        outside = np.flatnonzero(np.abs(self.share - 1.0) > SETTLED_SHARE)
        if not len(outside):
            return float(self.t_s[0])
        after = int(outside[-1]) + 1
        return float(self.t_s[after]) if after < len(self.t_s) else None

    @property
    def overshoot(self) -> float:
        """Overshoot as a share of the step."""
        return max(0.0, float(self.share.max()) - 1.0)

    @property
    def cost(self) -> float:
        """ITAE (integral of time times absolute error) plus penalties on overshoot squared and movement.

        Time is counted in looks; the ITAE is divided by the number of looks.
        """
        looks = np.arange(1, len(self.share) + 1)
        itae = float(np.sum(looks * np.abs(1.0 - self.share))) / len(looks)
        moves = float(np.sum(np.abs(np.diff(self.share))))
        return itae + OVERSHOOT_WEIGHT * self.overshoot**2 + VARIATION_WEIGHT * moves


def step_response(times_ns: Sequence[int], shares: Sequence[float]) -> StepResponse:
    """Build the response from the looks after a step: their times and their shares of the step."""
    t_s = (np.array(times_ns, dtype=np.float64) - times_ns[0]) / 1e9
    return StepResponse(t_s=t_s, share=np.array(shares))
