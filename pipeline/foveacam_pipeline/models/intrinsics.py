"""The intrinsics of a camera: pixels <-> axis-wise angles, with OpenCV's five-coefficient distortion."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import Binning, OutOfRange
from foveacam_pipeline.geometry.angles import angles_from_tan, tan_from_angles
from foveacam_pipeline.geometry.binning import binning_of
from foveacam_pipeline.geometry.shapes import as_rows
from foveacam_pipeline.models.content import OMITTED
from foveacam_pipeline.models.distortion import forward, inverse, largest_radius


@dataclass(frozen=True, slots=True, kw_only=True)
class Intrinsics:
    """Camera matrix and distortion (k1, k2, p1, p2, k3) of one camera, px.

    `known_tan`: tangent of the angle from the axis up to which directions are known to a useful accuracy;
    None: as far as the model goes.
    """

    width: int
    height: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    known_tan: float | None = field(default=None, metadata={OMITTED: True})

    @property
    def widest_tan(self) -> float:
        """Tangent of the largest angle from the axis at which a pixel has a direction."""
        folds_at = largest_radius(self.distortion)
        return folds_at if self.known_tan is None else min(folds_at, self.known_tan)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(3, 3) float64 camera matrix, px."""
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    def binned(self, binning: Binning) -> "Intrinsics":
        """Return the intrinsics for binned pictures of this camera; at binning 1 they are unchanged."""
        return self if binning == 1 else self.scaled(1.0 / binning)

    def of_picture(self, shape: tuple[int, ...]) -> "Intrinsics":
        """Return the intrinsics in pixels of a picture of `shape` (h, w, ...), or raise InvalidInput."""
        return self.binned(self.binning_of(shape))

    def binning_of(self, shape: tuple[int, ...]) -> Binning:
        """Return the binning of a picture of `shape` (h, w, ...) by this camera, or raise InvalidInput."""
        return binning_of(shape, width=self.width, height=self.height)

    def scaled(self, scale: float) -> "Intrinsics":
        """Return the same lens with `scale` times as many pixels a side: 2 undoes `binned(2)`."""
        return replace(
            self,
            width=math.floor(self.width * scale),
            height=math.floor(self.height * scale),
            fx_px=self.fx_px * scale,
            fy_px=self.fy_px * scale,
            cx_px=(self.cx_px + 0.5) * scale - 0.5,
            cy_px=(self.cy_px + 0.5) * scale - 0.5,
        )

    def angles_rad(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) float64 angles, rad, of `pixels`: (n, 2); they may lie outside the image.

        NaN for pixels that no direction reaches, as the lens model folds back before (`distortion.py`), and
        beyond `known_tan`.
        """
        rows = as_rows(pixels, columns=2, name="pixels")
        if len(rows) == 0:
            return np.empty((0, 2))
        return angles_from_tan(inverse(rows, self.matrix, self.distortion, widest=self.widest_tan))

    def pixels(self, angles_rad: ArrayLike) -> NDArray[np.float64]:
        """Return (n, 2) float64 pixels of `angles_rad`: (n, 2); they may lie outside the image.

        NaN for directions beyond `widest_tan`.
        """
        tangents = tan_from_angles(angles_rad)
        if len(tangents) == 0:
            return np.empty((0, 2))
        return forward(tangents, self.matrix, self.distortion, widest=self.widest_tan)

    def contains(self, x_px: float, y_px: float) -> bool:
        """Return whether a pixel lies in the image (the first pixel's centre is 0, 0)."""
        return -0.5 <= x_px <= self.width - 0.5 and -0.5 <= y_px <= self.height - 0.5

    def check_pixel(self, x_px: float, y_px: float) -> None:
        """Raise OutOfRange unless the pixel lies in the image, and in a direction that the lens has."""
        if not (math.isfinite(x_px) and math.isfinite(y_px) and self.contains(x_px, y_px)):
            raise OutOfRange(
                f"pixel ({x_px:g}, {y_px:g}) is outside the image: x from -0.5 to {self.width - 0.5:g}, "
                f"y from -0.5 to {self.height - 0.5:g} px; choose a pixel inside"
            )
        if not np.isfinite(self.angles_rad([(x_px, y_px)])).all():
            why = "folds back" if self.known_tan is None else "is not known well enough"
            raise OutOfRange(
                f"pixel ({x_px:g}, {y_px:g}) has no direction: the calibrated lens model {why} before "
                "it; choose a pixel nearer to the centre, or calibrate the camera with the board in the "
                "corners of the image"
            )

    def check_rectangle(self, x_px: float, y_px: float, *, width_px: float, height_px: float) -> None:
        """Raise OutOfRange unless the rectangle has an area and lies in the image."""
        if not (width_px > 0.0 and height_px > 0.0):
            raise OutOfRange(
                f"rectangle of {width_px:g} x {height_px:g} px has no area; "
                "give a width and a height above 0 px"
            )
        self.check_pixel(x_px, y_px)
        self.check_pixel(x_px + width_px, y_px + height_px)

    @property
    def field_rad(self) -> tuple[float, float, float, float]:
        """Smallest ax, largest ax, smallest ay, largest ay, rad, along the axes through the centre.

        Where the lens's directions end before the image's edge, the field ends there.
        """
        edge = np.array(
            [
                [-0.5, self.cy_px],
                [self.width - 0.5, self.cy_px],
                [self.cx_px, -0.5],
                [self.cx_px, self.height - 0.5],
            ]
        )
        widest = math.atan(self.widest_tan)
        ends = widest * np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
        angles = self.angles_rad(edge)
        angles = np.where(np.isfinite(angles), angles, ends)
        return float(angles[0, 0]), float(angles[1, 0]), float(angles[2, 1]), float(angles[3, 1])
