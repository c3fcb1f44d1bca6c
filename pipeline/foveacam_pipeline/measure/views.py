"""Convert pixels between the views of a look and its left window, in both directions.

Views: `depth`, `anaglyph` and `difference` are the left window itself; `left` and `right` are the raw foveae;
`wide` is the wide camera. `right` and `wide` have another viewpoint, so the conversion needs the depth.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.angles import angles_from_rays, ray
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.models.intrinsics import Intrinsics

Pixel = tuple[float, float]
TIE_PX = 0.75
"""Distance of two right window pixels below which the point nearer to the rig occludes the other, px."""


class MeasuredView(StrEnum):
    """A picture in which pixels are measured."""

    WIDE = "wide"
    LEFT = "left"
    RIGHT = "right"
    ANAGLYPH = "anaglyph"
    DIFFERENCE = "difference"
    DEPTH = "depth"


WINDOWS = frozenset({MeasuredView.ANAGLYPH, MeasuredView.DIFFERENCE, MeasuredView.DEPTH})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewMap:
    """Converts pixels between the views of one look."""

    look: LookDepth
    wide: Intrinsics

    def size_px(self, view: MeasuredView) -> tuple[int, int]:
        """Return width and height of a view's picture, without its scale bar."""
        if view is MeasuredView.WIDE:
            return self.wide.width, self.wide.height
        width, height = self.look.size_px
        if view in WINDOWS:
            return width, height
        return round(width / self.look.scale), round(height / self.look.scale)

    def to_window(self, view: MeasuredView, pixel: Pixel, *, z_m: float) -> Pixel:
        """Return the left window position of what a view shows at `pixel`, which is at depth `z_m`."""
        look = self.look
        if view in WINDOWS:
            return pixel
        if view is MeasuredView.LEFT:
            return _mapped(look.window_from_left, pixel)
        if view is MeasuredView.RIGHT:
            x, y = self.to_right_window(pixel)
            return x + look.residual_px(z_m), y
        direction = ray(*self.wide.angles_rad([pixel])[0].tolist())
        x_m, y_m, _ = (direction * (z_m / direction[2])).tolist()
        u_px, v_px = look.f_px * (x_m + look.baseline_m / 2.0) / z_m, look.f_px * y_m / z_m
        return u_px - look.u0_left_px, v_px - look.v0_px

    def to_right_window(self, pixel: Pixel) -> Pixel:
        """Return the right window position of a pixel of the raw right fovea."""
        return _mapped(self.look.window_from_right, pixel)

    def from_window(self, view: MeasuredView, window_px: Pixel, *, z_m: float) -> Pixel:
        """Return the pixel of a view for a position in the left window, which is at depth `z_m`."""
        look = self.look
        if view in WINDOWS:
            return window_px
        if view is MeasuredView.LEFT:
            return _mapped_back(look.window_from_left, window_px)
        if view is MeasuredView.RIGHT:
            right_px = (window_px[0] - look.residual_px(z_m), window_px[1])
            return _mapped_back(look.window_from_right, right_px)
        x_m = (window_px[0] + look.u0_left_px) * z_m / look.f_px - look.baseline_m / 2.0
        y_m = (window_px[1] + look.v0_px) * z_m / look.f_px
        return wide_pixel(self.wide, (x_m, y_m, z_m))


def wide_pixel(wide: Intrinsics, point_rig_m: tuple[float, float, float]) -> Pixel:
    """Return the wide pixel of a point of the rig frame."""
    x_px, y_px = wide.pixels(angles_from_rays([point_rig_m]))[0].tolist()
    return x_px, y_px


def nearest_known_right(look: LookDepth, right_px: Pixel, *, reach_px: float) -> tuple[int, int] | None:
    """Return the (x, y) of the left window pixel with depth that corresponds to `right_px`.

    None when no such pixel is within `reach_px` of it.
    """
    width, height = look.size_px
    x_px, y_px = right_px
    top, bottom = max(0, math.ceil(y_px - reach_px)), min(height - 1, math.floor(y_px + reach_px))
    if top > bottom:
        return None
    band = look.z_m[top : bottom + 1].astype(np.float64)
    residual = look.f_px * look.baseline_m / band - (look.u0_left_px - look.u0_right_px)
    off_x = np.arange(width) - residual - x_px
    off_y = np.arange(top, bottom + 1)[:, None] - y_px
    away_px = np.where(np.isfinite(off_x), np.hypot(off_x, off_y), np.inf)
    least = float(away_px.min())
    if least > reach_px:
        return None
    near = np.where(away_px <= least + TIE_PX, band, np.inf)
    front = near <= near.min() * (1.0 + 1e-3)  # the surface in front, then its nearest pixel
    row, column = np.unravel_index(int(np.argmin(np.where(front, away_px, np.inf))), away_px.shape)
    return int(column), int(row) + top


def _mapped(homography: NDArray[np.float64], pixel: Pixel) -> Pixel:
    x, y, w = (homography @ np.array([pixel[0], pixel[1], 1.0])).tolist()
    return x / w, y / w


def _mapped_back(homography: NDArray[np.float64], pixel: Pixel) -> Pixel:
    x, y, w = np.linalg.solve(homography, np.array([pixel[0], pixel[1], 1.0])).tolist()
    return x / w, y / w
