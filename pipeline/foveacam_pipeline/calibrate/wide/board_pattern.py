"""Checks of the print around detected corners: a whole plain checkerboard, or something else."""

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.board_map import BoardMap
from foveacam_pipeline.calibrate.wide.boards import MIN_CORNERS, Checkerboard

_MIN_PRINT_CONTRAST = 0.4
"""Minimum contrast within a square, over the board's, of a print in it."""


def extends_beyond(gray: NDArray[np.uint8], board: Checkerboard, image_from_board: BoardMap) -> bool:
    """Return whether the pattern continues beyond the board's rim, as in a part of a larger board."""
    x, y = np.arange(board.columns), np.arange(board.rows)
    rims = (
        np.column_stack([np.full_like(y, -1), y]),
        np.column_stack([np.full_like(y, board.columns), y]),
        np.column_stack([x, np.full_like(x, -1)]),
        np.column_stack([x, np.full_like(x, board.rows)]),
    )
    inside = _crossing_strength(gray, np.argwhere(np.ones((board.columns, board.rows))), image_from_board)
    strength = float(np.nanmedian(inside))
    for rim in rims:
        there = _crossing_strength(gray, rim, image_from_board) * np.sign(strength)
        known = there[np.isfinite(there)]
        if len(known) >= MIN_CORNERS and np.median(known) > 0.5 * abs(strength):
            return True
    return False


def has_markers(gray: NDArray[np.uint8], board: Checkerboard, image_from_board: BoardMap) -> bool:
    """Return whether the bright squares contain a print, as on a ChArUco board."""
    squares = np.argwhere(np.ones((board.columns - 1, board.rows - 1))) + 0.5
    around = np.stack(np.meshgrid([-0.2, 0.0, 0.2], [-0.2, 0.0, 0.2]), axis=-1).reshape(-1, 2)
    points = (squares[:, None, :] + around).reshape(-1, 2)
    values = _gray_at(gray, image_from_board.pixels(points)).reshape(-1, len(around))
    first = np.floor(squares).sum(axis=1) % 2 == 0
    spread = np.nanmax(values, axis=1) - np.nanmin(values, axis=1)
    contrast = float(np.nanmax(values) - np.nanmin(values))
    return bool(
        max(np.nanmedian(spread[first]), np.nanmedian(spread[~first])) > _MIN_PRINT_CONTRAST * contrast
    )


def starts_at_black(gray: NDArray[np.uint8], corners_px: NDArray[np.float64], board: Checkerboard) -> bool:
    """Return whether the square before the first corner is darker than the one beside it."""
    lattice = corners_px.reshape(board.rows, board.columns, 2)
    right, down = lattice[0, 1] - lattice[0, 0], lattice[1, 0] - lattice[0, 0]
    points = lattice[0, 0] + 0.5 * np.array([right + down, right - down])
    inside, beside = _gray_at(gray, points)
    return bool(inside < beside)  # the square after the first corner has the colour of the one before


def _crossing_strength(
    gray: NDArray[np.uint8], places: NDArray[np.int64], image_from_board: BoardMap
) -> NDArray[np.float64]:
    """Return the contrast of four squares that meet at points (n, 2), in squares; NaN outside the image.

    It is 0 where no squares meet; the sign is the same all over one board.
    """
    around = np.array([[0.3, 0.3], [-0.3, -0.3], [0.3, -0.3], [-0.3, 0.3]])
    points = (places[:, None, :] + around).reshape(-1, 2)
    a, b, c, d = _gray_at(gray, image_from_board.pixels(points)).reshape(-1, 4).T
    cross = (a + b - c - d) / 2.0
    unlike = np.maximum(np.abs(a - b), np.abs(c - d))
    sign = np.where(places.sum(axis=1) % 2 == 0, 1.0, -1.0) * np.sign(cross)
    return np.asarray(sign * np.maximum(np.abs(cross) - unlike, 0.0))


def _gray_at(gray: NDArray[np.uint8], points_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) grey values at the nearest pixels; NaN outside the image."""
    x, y = np.rint(points_px).astype(np.int64).T
    inside = (x >= 0) & (y >= 0) & (x < gray.shape[1]) & (y < gray.shape[0])
    values = np.full(len(x), np.nan)
    values[inside] = gray[y[inside], x[inside]]
    return values
