"""The chart of a mosaic: the virtual pinhole plane of one eye (Sec. 3.2), cropped to its views.

Its focal length is the telephoto's, so one chart pixel is one fovea pixel in the middle and 3 % less at 10°.
A plane, not a chart of angles: straight lines stay straight, fovea to chart is a homography, and depth is f B
/ d everywhere on it. Cells of 8 x 8 px carry depth.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput

Floats = NDArray[np.float64]

CELL = 8
"""Side of a cell, px: depth is matched over windows of this size."""
MOST_PX = 40_000
"""Largest side of a chart: a larger one means wrong poses (70° at the telephoto's resolution)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """A window of an eye's plane: pixel (x, y) lies at (x + u0, y + v0) px from the principal point.

    `u0_px`, `v0_px`, `width` and `height` are whole numbers, the sizes multiples of `CELL`.
    """

    u0_px: int
    v0_px: int
    width: int
    height: int
    f_px: float

    @property
    def columns(self) -> int:
        """Cells across."""
        return self.width // CELL

    @property
    def rows(self) -> int:
        """Cells down."""
        return self.height // CELL

    def cell_centres(self, row: slice, column: slice) -> tuple[Floats, Floats]:
        """Return plane coordinates u (1, n), v (m, 1) of the centres of cells; slices may reach outside."""
        middle = (CELL - 1) / 2
        u = self.u0_px + CELL * np.arange(column.start, column.stop, dtype=np.float64) + middle
        v = self.v0_px + CELL * np.arange(row.start, row.stop, dtype=np.float64) + middle
        return u[None, :], v[:, None]


def chart_around(corners_px: Floats, *, f_px: float) -> Chart:
    """Return the smallest chart that contains plane positions (n, 2)."""
    low = np.floor(corners_px.min(axis=0) / CELL).astype(int) * CELL
    high = np.ceil(corners_px.max(axis=0) / CELL).astype(int) * CELL
    width, height = (high - low).tolist()
    if not 0 < max(width, height) <= MOST_PX or not math.isfinite(f_px):
        raise InvalidInput(
            f"a mosaic of {width} x {height} px would result from these poses, at most {MOST_PX} px are "
            "possible; the dataset's volts or its calibration are wrong"
        )
    return Chart(u0_px=int(low[0]), v0_px=int(low[1]), width=width, height=height, f_px=f_px)
