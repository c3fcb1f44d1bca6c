"""One tile of a mosaic: foveae blended over the wide view.

A view weighs by the cube of how far inside its frame a pixel lies: seams are soft and narrow, and noise is
hardly averaged away on one side of them and not on the other. Where no fovea saw, the wide view shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.views import Laid, Patch, Picture, Pictures, View, lay, patch_of
from foveacam_pipeline.geometry.angles import angles_from_tan
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

FEATHER_PX = 24.0
"""Over so many px the outermost foveae pass into the wide view."""
GROUND = (17.0, 20.0, 26.0)
PREVIEW_STEP = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WideView:
    """The wide view beneath. `gain`: (channels,) factors that make it as bright as the foveae."""

    picture: Picture
    calibration: Calibration
    eye_x_m: float
    gain: NDArray[np.float32]

    def on(self, patch: Patch) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return (h, w, channels) float32 on a patch, and where the wide view reaches, (h, w)."""
        f_px = self.calibration.fovea_f_px
        shape = patch.per_depth.shape
        tan_x = np.broadcast_to(patch.u_px / f_px, shape) + self.eye_x_m * patch.per_depth
        tan_y = np.broadcast_to(patch.v_px / f_px, shape)
        angles = angles_from_tan(np.column_stack([tan_x.ravel(), tan_y.ravel()]))
        places = self.calibration.wide.pixels(angles).reshape(*shape, 2)
        x, y = (patch.dense(places[..., axis]) for axis in (0, 1))
        height, width = self.picture.shape[:2]
        seen = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
        image = cv2.remap(self.picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        bright = np.asarray(image, dtype=np.float32).reshape(*x.shape, -1) * self.gain
        return bright, seen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Canvas:
    """Everything that a tile is painted from."""

    chart: Chart
    filled: NDArray[np.float32]
    views: Sequence[View]
    pictures: Pictures
    channels: int
    wide: WideView | None

    def tile(self, x_px: int, y_px: int, *, width: int, height: int) -> Picture:
        """Return a rectangle of the chart, whose edges lie on cells: (h, w) or (h, w, 3) uint8."""
        rows = slice(y_px // CELL, (y_px + height) // CELL)
        columns = slice(x_px // CELL, (x_px + width) // CELL)
        patch = patch_of(self.chart, self.filled, rows, columns)
        total = np.zeros((height, width, self.channels), dtype=np.float32)
        weight = np.zeros((height, width), dtype=np.float32)
        deepest = np.zeros((height, width), dtype=np.float32)
        for laid in self._laid(patch):
            share = laid.inside_px**3
            total += share[..., None] * self._channels(laid.image)
            weight += share
            np.maximum(deepest, laid.inside_px, out=deepest)
        total /= np.maximum(weight, np.float32(1e-9))[..., None]
        cover = np.minimum(deepest / np.float32(FEATHER_PX), np.float32(1.0))[..., None]
        if float(cover.min()) < 1.0:
            total *= cover
            total += (np.float32(1.0) - cover) * self._beneath(patch)
        out = np.clip(np.rint(total), 0, 255).astype(np.uint8)
        return out[..., 0] if self.channels == 1 else out

    def _laid(self, patch: Patch) -> list[Laid]:
        left, top, right, bottom = patch.box
        found = []
        for view in self.views:
            a, b, c, d = view.box
            if a <= right and left <= c and b <= bottom and top <= d:
                laid = lay(view, self.pictures.of(view), patch)
                if laid is not None:
                    found.append(laid)
        return found

    def _beneath(self, patch: Patch) -> NDArray[np.float32]:
        ground = np.array(GROUND if self.channels == 3 else GROUND[:1], dtype=np.float32)
        if self.wide is None:
            return np.broadcast_to(ground, (*patch.size, self.channels))
        image, seen = self.wide.on(patch)
        return np.where(seen[..., None], self._channels(image), ground).astype(np.float32)

    def _channels(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        return image.reshape(*image.shape[:2], -1)


def canvas_of(
    scan: Dataset,
    views: Sequence[View],
    pictures: Pictures,
    *,
    chart: Chart,
    filled: NDArray[np.float32],
) -> Canvas:
    """Return what the tiles of a scan are painted from; the wide view is that of its middle point."""
    canvas = Canvas(
        chart=chart,
        filled=filled,
        views=views,
        pictures=pictures,
        channels=1 if pictures.of(views[0]).ndim == 2 else 3,
        wide=None,
    )
    wide = _wide(scan, canvas, eye_x_m=_eye_x_m(scan, pictures.eye))
    return Canvas(
        chart=chart, filled=filled, views=views, pictures=pictures, channels=canvas.channels, wide=wide
    )


def _wide(scan: Dataset, canvas: Canvas, *, eye_x_m: float) -> WideView | None:
    """Return the wide view of the point nearest to the middle of the scan that has one."""
    calibration = scan.calibration
    points = sorted(scan, key=lambda point: abs(point.index - scan[len(scan) // 2].index))
    for point in points:
        if calibration is not None and any(kept.role is Role.WIDE for kept in point.frames):
            picture = to_uint8(point.frame(Role.WIDE))
            picture = gray(picture) if canvas.channels == 1 else rgb(picture)
            plain = WideView(
                picture=picture,
                calibration=calibration,
                eye_x_m=eye_x_m,
                gain=np.ones(canvas.channels, dtype=np.float32),
            )
            return WideView(
                picture=picture, calibration=calibration, eye_x_m=eye_x_m, gain=_gain(plain, canvas)
            )
    return None


def _gain(wide: WideView, canvas: Canvas) -> NDArray[np.float32]:
    """Return by how much brighter the foveae are than the wide view: the median over all views."""
    ratios = []
    for view in canvas.views:
        middle_x = round((view.box[0] + view.box[2]) / 2 - canvas.chart.u0_px) // CELL
        middle_y = round((view.box[1] + view.box[3]) / 2 - canvas.chart.v0_px) // CELL
        half = PREVIEW_STEP
        patch = patch_of(
            canvas.chart,
            canvas.filled,
            slice(middle_y - half, middle_y + half),
            slice(middle_x - half, middle_x + half),
        )
        laid = lay(view, canvas.pictures.of(view), patch)
        image, seen = wide.on(patch)
        if laid is not None and seen.all():
            fovea = laid.image.reshape(*laid.image.shape[:2], -1).mean(axis=(0, 1))
            ratios.append(fovea / np.maximum(image.mean(axis=(0, 1)), 1.0))
    if not ratios:
        return np.ones(canvas.channels, dtype=np.float32)
    return np.asarray(np.median(np.array(ratios), axis=0), dtype=np.float32)


def _eye_x_m(scan: Dataset, eye: Role) -> float:
    return 0.0 if scan.calibration is None else float(scan.calibration.reference_rig_m(eye)[0])
