"""Kernel of `occlusion`: which pixels of each row a nearer surface hides from the right eye."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel

F32 = NDArray[np.float32]

_NOTHING = np.float32(-1e6)
"""Farther than everything."""


@kernel
def _fill_background(disparity: F32, filled: F32) -> None:
    """Fill `filled` with a row whose holes have the farther of their two known neighbours."""
    w = disparity.shape[0]
    latest = _NOTHING
    for x in range(w):
        if disparity[x] == disparity[x]:
            latest = disparity[x]
        filled[x] = latest
    latest = _NOTHING
    for x in range(w - 1, -1, -1):
        if disparity[x] == disparity[x]:
            latest = disparity[x]
        elif filled[x] == _NOTHING or (latest != _NOTHING and latest < filled[x]):
            filled[x] = latest


@kernel
def _carry(disparity: F32, place: NDArray[np.int32], nearest: F32) -> None:
    """Fill `nearest` (w + 4,), a rim of 2 px on either side, with the nearest surface at each right pixel.

    Gaps of up to 2 px are closed: the largest of three, then the smallest of three.
    """
    w = disparity.shape[0]
    nearest[:] = _NOTHING
    for x in range(w):
        if place[x] >= 0 and disparity[x] == disparity[x]:
            nearest[place[x] + 2] = max(nearest[place[x] + 2], disparity[x])
    before = nearest[0]
    for x in range(1, w + 3):
        here = nearest[x]
        nearest[x] = max(before, here, nearest[x + 1])
        before = here
    before = nearest[1]
    for x in range(2, w + 2):
        here = nearest[x]
        nearest[x] = min(before, here, nearest[x + 1])
        before = here


@kernel
def mark_hidden(disparity: F32, per_px: np.float32, nearer: np.float32, hidden: NDArray[np.uint8]) -> None:
    """Fill `hidden` (h, w) with 1 where something nearer by `nearer` px lies in the right window, else 0.

    `disparity`: (h, w) px, NaN where unknown; `per_px`: columns that a px of it shifts by.
    """
    h, w = disparity.shape
    filled, nearest, place = np.empty(w, np.float32), np.empty(w + 4, np.float32), np.empty(w, np.int32)
    for y in range(h):
        _fill_background(disparity[y], filled)
        for x in range(w):
            at = np.int32(np.floor(np.float32(x) - per_px * filled[x] + np.float32(0.5)))
            place[x] = at if filled[x] != _NOTHING and 0 <= at < w else -1
        _carry(disparity[y], place, nearest)
        for x in range(w):
            seen = place[x] < 0 or nearest[place[x] + 2] <= filled[x] + nearer
            hidden[y, x] = 0 if seen else 1
