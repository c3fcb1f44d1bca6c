"""The wide view as background of a mosaic: its projection on an eye's plane, and its brightness."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.views import (
    ChartPatch,
    Floats,
    MosaicView,
    Picture,
    ViewPictureCache,
    chart_patch,
    warp_view,
)
from foveacam_pipeline.geometry.angles import angles_from_tan
from foveacam_pipeline.geometry.binning import enlarge
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

HALF_CELLS = 16
"""Half side of the central part of a view in which brightness is compared."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WideView:
    """One wide frame. `gain`: (channels,) factors that make it as bright as the foveae.

    `eye_x_m`: x of the reference point of the mosaic's eye.
    """

    picture: Picture
    calibration: Calibration
    eye_x_m: float
    gain: NDArray[np.float32]

    def pixels(self, u_px: Floats, v_px: Floats, per_depth: Floats) -> tuple[Floats, Floats]:
        """Return wide px (x, y) of positions of the eye's plane at q = `per_depth`, (h, w)."""
        f_px, shape = self.calibration.fovea_f_px, per_depth.shape
        tan_x = np.broadcast_to(u_px / f_px, shape) + self.eye_x_m * per_depth
        tan_y = np.broadcast_to(v_px / f_px, shape)
        angles = angles_from_tan(np.column_stack([tan_x.ravel(), tan_y.ravel()]))
        places = self.calibration.wide.pixels(angles).reshape(*shape, 2)
        return places[..., 0], places[..., 1]

    def on_patch(self, patch: ChartPatch) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return (h, w, channels) float32 on a patch, and where the wide view covers it, (h, w)."""
        places = self.pixels(patch.u_px, patch.v_px, patch.per_depth)
        x, y = (patch.dense(nodes) for nodes in places)
        height, width = self.picture.shape[:2]
        seen = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
        image = cv2.remap(self.picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        bright = np.asarray(image, dtype=np.float32).reshape(*x.shape, -1) * self.gain
        return bright, seen


def wide_view_of(
    scan: Dataset, calibration: Calibration, pictures: ViewPictureCache, first: MosaicView
) -> WideView | None:
    """Return the wide view of the point nearest to the middle of a scan, in the foveae's colour mode."""
    coloured = pictures.picture(first).ndim == 3
    for point in sorted(scan, key=lambda point: abs(point.index - scan[len(scan) // 2].index)):
        if any(frame.role is Role.WIDE for frame in point.frames):
            frame = point.frame(Role.WIDE)
            picture = enlarge(to_uint8(frame), binning=frame.binning)
            return WideView(
                picture=rgb(picture) if coloured else gray(picture),
                calibration=calibration,
                eye_x_m=float(calibration.reference_rig_m(pictures.eye)[0]),
                gain=np.ones(3 if coloured else 1, dtype=np.float32),
            )
    return None


def match_brightness(
    wide: WideView,
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    *,
    chart: Chart,
    filled: NDArray[np.float32],
) -> WideView:
    """Return the wide view as bright as the foveae, by the median ratio over the middles of views."""
    ratios = []
    for view in views:
        column = round((view.box[0] + view.box[2]) / 2 - chart.u0_px) // CELL
        row = round((view.box[1] + view.box[3]) / 2 - chart.v0_px) // CELL
        rows, columns = (slice(k - HALF_CELLS, k + HALF_CELLS) for k in (row, column))
        patch = chart_patch(chart, filled, rows, columns)
        warped = warp_view(view, pictures.picture(view), patch)
        image, seen = wide.on_patch(patch)
        if warped is not None and seen.all():
            fovea = warped.image.reshape(*warped.image.shape[:2], -1).mean(axis=(0, 1))
            ratios.append(fovea / np.maximum(image.mean(axis=(0, 1)), 1.0))
    if not ratios:
        return wide
    return replace(wide, gain=np.asarray(np.median(np.array(ratios), axis=0), dtype=np.float32))
