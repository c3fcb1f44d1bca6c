"""How a plan's views cover its field, by one eye and by both, and how far neighbours overlap."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, StereoVolts
from foveacam_pipeline.capture.plan.plan_document import GridPoints, RasterPlan
from foveacam_pipeline.capture.plan.plan_points import PlanPoint, all_point_volts, points_of_scan
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.footprint import fovea_footprints_px

EYES = (Role.LEFT, Role.RIGHT)
SCALE = 0.5
"""Areas are counted on the wide image at half its size: cells of 2 x 2 px, 1/72 of a fovea's width."""
LEAST_COVERED = 0.995
"""A smaller covered share causes a warning; the rest is due to the size of the cells."""
LEAST_SEEN_BY_BOTH = 0.95
"""A smaller share causes a warning: a view's corners are rotated by up to 10° against the other eye's, so
that even single views overlap no better."""
_SHIFT = 4
"""Fractional bits of OpenCV's fixed-point coordinates."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanCoverage:
    """How the views of one scan lie in the wide image; every scan of a plan has the same views.

    `footprints_px`: (n, 2, 4, 2) float64 wide px: point, eye (left, right), corner (clockwise from the top
    left of its image), x and y; for the distance at which the eyes meet. `counts`: (2, h/2, w/2) uint16:
    number of views of each eye that contain a cell of the wide image at half size. `field`: (h/2, w/2)
    bool: the area between the outermost directions of the plan. `seen_either`, `seen_both`: shares of the
    field, 0 to 1. `overlap_across`, `overlap_down`: smallest share of a view that its neighbour contains
    too, over both eyes: for a grid along rows and along columns, for set points (both alike) with the
    nearest other; None without neighbours. `apart`: whether there are neighbours and no two of them overlap.
    `outside_wide`: number of points that look past the wide image.
    """

    footprints_px: NDArray[np.float64]
    counts: NDArray[np.uint16]
    field: NDArray[np.bool_]
    seen_either: float
    seen_both: float
    overlap_across: float | None
    overlap_down: float | None
    apart: bool
    outside_wide: int

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for the operator before the start; empty without problems."""
        warnings = list(self._gaps())
        if self.seen_either < LEAST_COVERED:
            warnings.append(f"{100.0 * (1.0 - self.seen_either):.1f} % of the field is seen by neither eye")
        elif self.seen_both < LEAST_SEEN_BY_BOTH:
            warnings.append(f"{100.0 * (1.0 - self.seen_both):.1f} % of the field is seen by one eye alone")
        if self.outside_wide:
            warnings.append(f"{self.outside_wide} points look past the wide image")
        return tuple(warnings)

    def _gaps(self) -> Iterator[str]:
        if self.apart:
            yield "no two views overlap: no mosaic can be made of them; take more points or a smaller field"
            return
        for overlap, neighbours in ((self.overlap_across, "beside"), (self.overlap_down, "below")):
            if overlap == 0.0:
                yield (
                    f"some views do not overlap those {neighbours} them: a mosaic will have gaps; "
                    "take more points or a smaller field"
                )


def coverage_of(plan: RasterPlan, calibration: Calibration) -> PlanCoverage:
    """Return how a plan's views lie in the wide image; raise OutOfRange for a point out of reach."""
    scan_points = points_of_scan(plan)
    volts = all_point_volts(scan_points, calibration)
    footprints = _footprints(scan_points, volts, calibration)
    shape = round(calibration.wide.height * SCALE), round(calibration.wide.width * SCALE)
    counts = np.stack([_view_counts(footprints[:, eye], shape) for eye in range(2)])
    middles = calibration.wide.pixels([(point.ax_rad, point.ay_rad) for point in scan_points])
    field = _field(middles, counts)
    across, down = (_overlaps(footprints, pairs) for pairs in _neighbours(plan, scan_points))
    size = max(1, int(field.sum()))
    either, both = (counts > 0).any(axis=0), (counts > 0).all(axis=0)
    return PlanCoverage(
        footprints_px=footprints,
        counts=counts,
        field=field,
        seen_either=float((either & field).sum() / size),
        seen_both=float((both & field).sum() / size),
        overlap_across=min(across, default=None),
        overlap_down=min(down, default=None),
        apart=bool(across or down) and not any(across + down),
        outside_wide=sum(not calibration.wide.contains(x, y) for x, y in middles.tolist()),
    )


def _footprints(
    scan_points: tuple[PlanPoint, ...], volts: tuple[StereoVolts, ...], calibration: Calibration
) -> NDArray[np.float64]:
    """Return (n, 2, 4, 2) wide px: point, eye, corner."""
    distances_m = np.array([point.distance_m for point in scan_points])
    drives = [[(drive.x_v, drive.y_v) for drive in (both.left, both.right)] for both in volts]
    volts_v = np.array(drives).reshape(-1, 2, 2)
    return np.stack(
        [
            fovea_footprints_px(calibration, role, volts_v[:, eye], distances_m=distances_m)
            for eye, role in enumerate(EYES)
        ],
        axis=1,
    )


def _cells(polygon_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return wide px as px of the image at half size; in both the first pixel's centre is (0, 0)."""
    cells: NDArray[np.float64] = (polygon_px + 0.5) * SCALE - 0.5
    return cells


def _view_counts(polygons_px: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.uint16]:
    counts = np.zeros(shape, dtype=np.uint16)
    for polygon in polygons_px:
        cells = _cells(polygon)
        left, top = np.maximum(0, np.floor(cells.min(axis=0))).astype(int).tolist()
        right, bottom = np.minimum((shape[1], shape[0]), np.ceil(cells.max(axis=0)) + 1).astype(int).tolist()
        if right > left and bottom > top:
            mask = np.zeros((bottom - top, right - left), dtype=np.uint8)
            _fill(mask, cells - (left, top))
            counts[top:bottom, left:right] += mask
    return counts


def _fill(mask: NDArray[np.uint8], cells: NDArray[np.float64]) -> None:
    fixed_point = np.rint(cells * (1 << _SHIFT)).astype(np.int32)
    cv2.fillConvexPoly(mask, fixed_point, 1, cv2.LINE_8, _SHIFT)


def _field(middles_px: NDArray[np.float64], counts: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Return the cells between the outermost directions; for points on one line, all cells that are seen."""
    hull = cv2.convexHull(middles_px.astype(np.float32))[:, 0, :]
    if len(hull) < 3 or cv2.contourArea(hull) < 1.0:
        return np.asarray((counts > 0).any(axis=0))
    mask = np.zeros(counts.shape[1:], dtype=np.uint8)
    _fill(mask, _cells(hull.astype(np.float64)))
    return mask > 0


def _neighbours(
    plan: RasterPlan, scan_points: tuple[PlanPoint, ...]
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return the pairs of points that are horizontal neighbours, and those that are vertical neighbours."""
    if not isinstance(plan.points, GridPoints):
        nearest = _nearest(scan_points)
        return nearest, nearest
    at = {(point.column, point.row): point.point for point in scan_points}
    across = [(k, at[column + 1, row]) for (column, row), k in at.items() if (column + 1, row) in at]
    down = [(k, at[column, row + 1]) for (column, row), k in at.items() if (column, row + 1) in at]
    return across, down


def _nearest(scan_points: tuple[PlanPoint, ...]) -> list[tuple[int, int]]:
    if len(scan_points) < 2:
        return []
    from scipy.spatial import cKDTree  # half a second, saved by servers that plan nothing

    tangents = np.tan([(point.ax_rad, point.ay_rad) for point in scan_points])
    indices = np.asarray(cKDTree(tangents).query(tangents, k=2)[1])
    return [(k, other if other != k else first) for k, (first, other) in enumerate(indices.tolist())]


def _overlaps(footprints_px: NDArray[np.float64], pairs: list[tuple[int, int]]) -> list[float]:
    return [
        _overlap(footprints_px[one, eye], footprints_px[other, eye])
        for one, other in pairs
        for eye in range(2)
    ]


def _overlap(one_px: NDArray[np.float64], other_px: NDArray[np.float64]) -> float:
    """Return the share of one view's area that another view contains too."""
    polygon, other = one_px.astype(np.float32), other_px.astype(np.float32)
    area = float(cv2.contourArea(polygon))
    common = float(cv2.intersectConvexConvex(polygon, other)[0])
    return min(1.0, common / area) if area > 0.0 and math.isfinite(common) else 0.0
