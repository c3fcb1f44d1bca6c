"""The map from a board to its image: a homography, and a cubic for what the lens bends.

A short lens bends a near board by half a square and more: the corners of such views fix its distortion, and
are not to be taken for a confusion of corners.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

CUBIC_TERMS = 10
LEAST_FOR_A_CUBIC = 2 * CUBIC_TERMS
BENT = 0.05
"""Distance of a corner from the homography, in squares, from which the lens's bend is fitted too."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardMap:
    """Maps places on a board, in squares, to pixels.

    `plane`: (3, 3) homography. `bend_px`: (10, 2) coefficients of a cubic of the places about `middle`, in
    units of `reach`.
    """

    plane: NDArray[np.float64]
    bend_px: NDArray[np.float64]
    middle: NDArray[np.float64]
    reach: float

    def pitches_px(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n,) sides, px, of squares at places (n, 2), by the homography's scale of areas there."""
        away = np.maximum(np.abs(places @ self.plane[2, :2] + self.plane[2, 2]), 1e-12)
        return np.asarray(np.sqrt(abs(np.linalg.det(self.plane)) / away**3))

    def pixels(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) pixels of places (n, 2)."""
        flat = np.asarray(cv2.perspectiveTransform(places[:, None, :], self.plane), dtype=np.float64)[:, 0, :]
        bent = _cubic((places - self.middle) / self.reach) @ self.bend_px
        return np.asarray(flat + bent)


def fit_board_map(places: NDArray[np.float64], corners_px: NDArray[np.float64]) -> BoardMap | None:
    """Return the map of places (n, 2), in squares, to corners (n, 2); None if there is none."""
    plane = np.asarray(cv2.findHomography(places, corners_px)[0], dtype=np.float64)
    if plane.shape != (3, 3):  # OpenCV found none
        return None
    middle = places.mean(axis=0)
    reach = max(float(np.abs(places - middle).max()), 1.0)
    flat = BoardMap(plane=plane, bend_px=np.zeros((CUBIC_TERMS, 2)), middle=middle, reach=reach)
    off_px = corners_px - flat.pixels(places)
    is_flat = bool((np.linalg.norm(off_px, axis=1) < BENT * flat.pitches_px(places)).all())
    if is_flat or len(places) < LEAST_FOR_A_CUBIC:
        return flat
    bend_px = np.linalg.lstsq(_cubic((places - middle) / reach), off_px, rcond=None)[0]
    return BoardMap(plane=plane, bend_px=np.asarray(bend_px), middle=middle, reach=reach)


def _cubic(at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 10) all products of up to three coordinates of (n, 2) places."""
    x, y = at.T
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3])
