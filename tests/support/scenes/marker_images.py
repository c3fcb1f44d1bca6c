"""Draws square markers with area sampling, blur and noise, for tests that know where every corner is."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.sweep.marker_code import CELLS, black_cells
from foveacam_pipeline.calibrate.sweep.marker_model import HALF

BLACK, WHITE, WALL = 30.0, 215.0, 105.0


def homography(
    side_px: float, middle_px: tuple[float, float], *, turn_rad: float = 0.0, keystone: float = 0.0
) -> NDArray[np.float64]:
    """Return (3, 3) from cells from a marker's middle to pixels."""
    cell = side_px / CELLS
    c, s = np.cos(turn_rad) * cell, np.sin(turn_rad) * cell
    placed = np.array([[c, -s, middle_px[0]], [s, c * 0.98, middle_px[1]], [0.0, 0.0, 1.0]])
    placed[2, 0] = keystone
    placed[:2, 0] += keystone * np.array(middle_px)
    return placed


def true_corners(px_from_cells: NDArray[np.float64], cells: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where places, (n, 2) cells, are drawn."""
    rows = np.column_stack([cells, np.ones(len(cells))]) @ px_from_cells.T
    return np.asarray(rows[:, :2] / rows[:, 2:], dtype=np.float64)


def draw_marker(
    marker_id: int,
    px_from_cells: NDArray[np.float64],
    *,
    size: tuple[int, int],
    blur_px: float,
    noise: float = 2.5,
    seed: int = 0,
    finer: int = 4,
) -> NDArray[np.uint8]:
    """Return a grey image of (width, height) with one marker on its white margin on a grey wall."""
    black = black_cells(marker_id)
    width, height = size
    y, x = np.mgrid[0 : height * finer, 0 : width * finer]
    back = np.linalg.inv(px_from_cells)
    x, y = (x + 0.5) / finer - 0.5, (y + 0.5) / finer - 0.5
    below = back[2, 0] * x + back[2, 1] * y + back[2, 2]
    u = (back[0, 0] * x + back[0, 1] * y + back[0, 2]) / below + HALF
    v = (back[1, 0] * x + back[1, 1] * y + back[1, 2]) / below + HALF
    white = np.ones_like(u)
    on = (u >= 0) & (u < CELLS) & (v >= 0) & (v < CELLS)
    white[on] = 1.0 - black[v[on].astype(int), u[on].astype(int)]
    levels = BLACK + (WHITE - BLACK) * white
    levels[(np.abs(u - HALF) > HALF + 1.0) | (np.abs(v - HALF) > HALF + 1.0)] = WALL
    drawn = np.asarray(cv2.resize(levels, size, interpolation=cv2.INTER_AREA))
    drawn = np.asarray(cv2.GaussianBlur(drawn, (0, 0), blur_px))
    drawn = drawn + np.random.default_rng(seed).normal(0.0, noise, drawn.shape) * np.sqrt(drawn / 255.0)
    return np.asarray(np.clip(np.rint(drawn), 0, 255), dtype=np.uint8)
