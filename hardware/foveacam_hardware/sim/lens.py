"""The wide camera's lens: a division model, which is not the polynomial that a calibration fits to it."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.projection import RayTable

WIDE_WIDTH = 1440
WIDE_HEIGHT = 1080
WIDE_FOCAL_PX = 3155.0  # Table 2: 25.6 x 19.4 deg over 1440 x 1080 px


@dataclass(frozen=True, slots=True, kw_only=True)
class WideLens:
    """Undistorted radius = distorted radius / (1 + bend radius^2), radii in tangents."""

    focal_px: float = WIDE_FOCAL_PX
    centre_x_px: float = (WIDE_WIDTH - 1) / 2 + 3.4
    centre_y_px: float = (WIDE_HEIGHT - 1) / 2 - 2.1
    bend: float = -0.06

    def undistorted_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where an ideal pinhole would have drawn raw pixels: (n, 2) px to (n, 2) px."""
        offset = (pixels - np.array([self.centre_x_px, self.centre_y_px])) / self.focal_px
        radius2 = np.sum(offset**2, axis=-1, keepdims=True)
        straight = offset / (1.0 + self.bend * radius2)
        return np.asarray(straight * self.focal_px + np.array([self.centre_x_px, self.centre_y_px]))

    def distorted_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the raw pixels of an ideal pinhole's: the inverse of `undistorted_px`, in closed form."""
        offset = (pixels - np.array([self.centre_x_px, self.centre_y_px])) / self.focal_px
        radius2 = np.sum(offset**2, axis=-1, keepdims=True)
        bent = offset * 2.0 / (1.0 + np.sqrt(1.0 - 4.0 * self.bend * radius2))
        return np.asarray(bent * self.focal_px + np.array([self.centre_x_px, self.centre_y_px]))

    def matrix(self) -> NDArray[np.float64]:
        """Return the camera matrix (3, 3) of the undistorted image."""
        return np.array(
            [[self.focal_px, 0.0, self.centre_x_px], [0.0, self.focal_px, self.centre_y_px], [0.0, 0.0, 1.0]]
        )


@cache
def ray_table(lens: WideLens) -> RayTable:
    """Return where every raw pixel lies in the undistorted image, as the renderer takes it."""
    x, y = np.meshgrid(np.arange(WIDE_WIDTH, dtype=np.float64), np.arange(WIDE_HEIGHT, dtype=np.float64))
    straight = lens.undistorted_px(np.stack([x.ravel(), y.ravel()], axis=1))
    return RayTable(straight.reshape(WIDE_HEIGHT, WIDE_WIDTH, 2))
