"""Where a moving target will be at the next look: constant speed since the last two."""

import numpy as np
from numpy.typing import NDArray

STILL_TAN = 3e-4
"""Smaller changes between two looks are noise of the registration: 9 fovea px, one wide px."""


class Motion:
    """Predict the target's next displacement from where and when it was seen."""

    def __init__(self) -> None:
        self._last: tuple[NDArray[np.float64], int] | None = None

    def step(self, target: NDArray[np.float64], t_ns: int) -> NDArray[np.float64]:
        """Take the target's direction, (2,) tangents, at `t_ns`; return its displacement by the next look.

        The next look is taken to come after the same time as this one came after the last.
        """
        last, self._last = self._last, (target, t_ns)
        if last is None or t_ns <= last[1]:
            return np.zeros(2)
        moved = target - last[0]
        if float(np.abs(moved).max()) < STILL_TAN:
            return np.zeros(2)
        return np.asarray(moved, dtype=np.float64)
