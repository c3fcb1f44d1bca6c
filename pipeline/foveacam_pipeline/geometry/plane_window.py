"""The virtual pinhole of a fovea (Sec. 3.2): parallel to the wide camera, focal length of the telephoto.

Its plane is measured in pixels from its principal point: (u, v) = f (tan ax, tan ay). A window is the
part of that plane that holds one rectified image; its pixel (x, y) lies at (x + u0, y + v0).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_pipeline.geometry.shapes import as_rows


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeWindow:
    """A window of a virtual pinhole plane: where its first pixel lies, its size, and the focal length, px."""

    u0_px: float
    v0_px: float
    width: int
    height: int
    f_px: float

    def plane_from_pixels(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) plane coordinates of window `pixels`: (n, 2)."""
        rows = as_rows(pixels, columns=2, name="pixels")
        return np.column_stack([rows[:, 0] + self.u0_px, rows[:, 1] + self.v0_px])

    def pixels_from_plane(self, plane_px: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) window pixels of `plane_px`: (n, 2)."""
        rows = as_rows(plane_px, columns=2, name="plane_px")
        return np.column_stack([rows[:, 0] - self.u0_px, rows[:, 1] - self.v0_px])


def homography_apply(homography: NDArray[np.float64], points: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) float64 images of `points`: (n, 2) under a (3, 3) homography."""
    rows = as_rows(points, columns=2, name="points")
    mapped = np.column_stack([rows, np.ones(len(rows))]) @ homography.T
    image: NDArray[np.float64] = mapped[:, :2] / mapped[:, 2:]
    return image
