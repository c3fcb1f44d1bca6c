"""The fovea views of a mosaic: their projection, brightness and pictures, and their warping on the chart."""

from collections import OrderedDict
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role, StereoVolts
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.look import EyeLook, box_of
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.geometry.binning import enlarge
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import EDGE_PX, crossing_z_m, to_uint8

Picture = NDArray[np.uint8]
Floats = NDArray[np.float64]
CACHED_PICTURES = 12
"""Pictures in memory: tiles are rendered in an order in which neighbours follow each other."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MosaicView:
    """One fovea. `volts`: of both mirrors; `per_depth`: q where the gazes cross, 1/m; `gain`: a factor."""

    point: DatasetPoint
    volts: StereoVolts
    look: EyeLook
    box: tuple[float, float, float, float]
    per_depth: float
    gain: float = 1.0

    def with_adjustment(self, look: EyeLook, gain: float) -> "MosaicView":
        """Return a copy with an adjusted projection and gain."""
        return replace(self, look=look, gain=gain)


def mosaic_views(scan: Dataset, calibration: Calibration, settings: MosaicSettings) -> list[MosaicView]:
    """Return the views of an eye; points without its frame or its volts are left out."""
    views = []
    for point in scan:
        volts = point.pose.volts
        has = any(frame.role is settings.eye and frame.bracket == settings.bracket for frame in point.frames)
        if volts is None or not has:
            continue
        per_depth = 1.0 / crossing_z_m(calibration, volts)
        look = EyeLook.of(calibration, settings.eye, volts.left if settings.eye is Role.LEFT else volts.right)
        box = box_of(look.corners(calibration, per_depth))
        views.append(MosaicView(point=point, volts=volts, look=look, box=box, per_depth=per_depth))
    if not views:
        raise InvalidInput(
            f"{scan.folder}, scan {settings.scan} has no {settings.eye.value} frame of bracket "
            f"{settings.bracket} with the volts of its mirrors; choose another"
        )
    return views


def mosaic_calibration(dataset: Dataset) -> Calibration:
    """Return the dataset's calibration; raise NotCalibrated where it has none."""
    if dataset.calibration is None:
        raise NotCalibrated(f"{dataset.folder} has no calibration: its views cannot be warped side by side")
    return dataset.calibration


class ViewPictureCache:
    """Reads pictures of views on demand, and caches the latest."""

    def __init__(self, settings: MosaicSettings) -> None:
        self._settings = settings
        self._cache: OrderedDict[int, Picture] = OrderedDict()

    @property
    def eye(self) -> Role:
        """The eye whose pictures they are."""
        return self._settings.eye

    def picture(self, view: MosaicView) -> Picture:
        """Return (h, w) or (h, w, 3) RGB uint8, as the camera delivered it, at the size of its sensor."""
        index = view.point.index
        if index not in self._cache:
            frame = view.point.stacked(self._settings.eye, bracket=self._settings.bracket)
            self._cache[index] = enlarge(to_uint8(frame), binning=frame.binning)
            if len(self._cache) > CACHED_PICTURES:
                self._cache.popitem(last=False)
        self._cache.move_to_end(index)
        return self._cache[index]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChartPatch:
    """A rectangle of a chart with q of its cells and one cell around: (rows + 2, columns + 2), 1/m."""

    rows: slice
    columns: slice
    u_px: Floats
    v_px: Floats
    per_depth: Floats

    @property
    def size(self) -> tuple[int, int]:
        """(height, width), px."""
        return CELL * (self.rows.stop - self.rows.start), CELL * (self.columns.stop - self.columns.start)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom on the plane, px."""
        u, v = self.u_px[0], self.v_px[:, 0]
        return float(u[0]), float(v[0]), float(u[-1]), float(v[-1])

    def dense(self, nodes: Floats) -> NDArray[np.float32]:
        """Return (h, w) float32: values at the centres of cells, interpolated to every px."""
        height, width = self.size
        whole = cv2.resize(
            nodes.astype(np.float32), (width + 2 * CELL, height + 2 * CELL), interpolation=cv2.INTER_LINEAR
        )
        return np.ascontiguousarray(whole[CELL:-CELL, CELL:-CELL], dtype=np.float32)


def chart_patch(chart: Chart, filled: NDArray[np.float32], rows: slice, columns: slice) -> ChartPatch:
    """Return a patch of cells; `filled`: q of all cells of the chart."""
    about_rows, about_columns = (slice(cells.start - 1, cells.stop + 1) for cells in (rows, columns))
    u_px, v_px = chart.cell_centres(about_rows, about_columns)
    row = np.clip(np.arange(about_rows.start, about_rows.stop), 0, chart.rows - 1)
    column = np.clip(np.arange(about_columns.start, about_columns.stop), 0, chart.columns - 1)
    per_depth = filled[np.ix_(row, column)].astype(np.float64)
    return ChartPatch(rows=rows, columns=columns, u_px=u_px, v_px=v_px, per_depth=per_depth)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedView:
    """A view warped on a patch: (h, w) or (h, w, 3) float32, and each px's distance inside its frame, px."""

    image: NDArray[np.float32]
    inside_px: NDArray[np.float32]


def warp_view(view: MosaicView, picture: Picture, patch: ChartPatch) -> PlacedView | None:
    """Return a view warped on a patch; None where it does not cover it."""
    left, top, right, bottom = patch.box
    near = view.box[0] <= right and left <= view.box[2] and view.box[1] <= bottom and top <= view.box[3]
    if not near:
        return None
    x, y = (patch.dense(nodes) for nodes in view.look.raw(patch.u_px, patch.v_px, patch.per_depth))
    height, width = picture.shape[:2]
    inside = np.minimum(
        np.minimum(x, np.float32(width - 1) - x), np.minimum(y, np.float32(height - 1) - y)
    ) - np.float32(EDGE_PX)
    if not (inside > 0.0).any():
        return None
    image = cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    bright = np.asarray(image, dtype=np.float32)
    if view.gain != 1.0:
        bright *= np.float32(view.gain)
    return PlacedView(image=bright, inside_px=np.maximum(inside, np.float32(0.0)))
