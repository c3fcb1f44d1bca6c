"""The points of a plan in order, and the gaze and volts of each eye at a point.

The sequence depends on the plan alone, so that an interrupted capture continues at the exact next point.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput, MirrorVolts, OutOfRange, Role, StereoVolts
from foveacam_pipeline.capture.plan.plan_document import GridPoints, RasterPlan
from foveacam_pipeline.capture.plan.set_points import SetPoint, metres
from foveacam_pipeline.geometry.verging import vergence_angles
from foveacam_pipeline.models.calibration import Calibration

Angles = tuple[float, float]
"""A direction (ax, ay), rad, rig axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanPoint:
    """One position of the mirrors.

    `index` counts all points of the plan in the order of capture, `point` those of one scan. `column`,
    `row`: position in the grid from its top left; for set points, their number and 0. `distance_m`: from
    the rig's origin to where the eyes meet, infinity when they look parallel. `shift_rad`: the left eye
    looks this much lower, the right eye this much higher. `rail_m`: position of the rig; None: wherever it
    is.
    """

    index: int
    scan: int
    point: int
    column: int
    row: int
    ax_rad: float
    ay_rad: float
    distance_m: float
    shift_rad: float = 0.0
    rail_m: float | None = None

    def __str__(self) -> str:
        place = f"ax {math.degrees(self.ax_rad):.2f}°, ay {math.degrees(self.ay_rad):.2f}°"
        how = "parallel" if math.isinf(self.distance_m) else f"at {self.distance_m:g} m"
        return f"point {self.point} (column {self.column}, row {self.row}; {place}, {how})"


def points_of_plan(plan: RasterPlan) -> tuple[PlanPoint, ...]:
    """Return all points of all scans in the order of capture.

    Raise InvalidInput while the distance or the size of the field is not filled in (`fill_in_plan`).
    """
    scan_points = points_of_scan(plan)
    places_mm: tuple[float | None, ...] = plan.rail_positions_mm or (None,)
    return tuple(
        _in_scan(point, scan, len(scan_points), place_mm)
        for scan, place_mm in enumerate(places_mm)
        for point in scan_points
    )


def points_of_scan(plan: RasterPlan) -> tuple[PlanPoint, ...]:
    """Return the points of the first scan; all others are the same from other positions of the rail."""
    _check_filled_in(plan)
    source = plan.points
    places = (
        _grid_order(source) if isinstance(source, GridPoints) else [(k, 0) for k in range(len(source.points))]
    )
    return tuple(
        _point(plan, number, place, where)
        for number, (place, where) in enumerate(zip(places, _set_points(plan), strict=True))
    )


def gazes_rad(point: PlanPoint, calibration: Calibration) -> tuple[Angles, Angles]:
    """Return the (ax, ay), rad, of the left and of the right eye that meet on a point."""
    pivots = calibration.pivot_rig_m(Role.LEFT), calibration.pivot_rig_m(Role.RIGHT)
    try:
        left, right = vergence_angles(point.ax_rad, point.ay_rad, point.distance_m, pivots_rig_m=pivots)
    except OutOfRange as error:
        raise OutOfRange(f"{point}: {error}") from error
    return (left[0], left[1] + point.shift_rad), (right[0], right[1] - point.shift_rad)


def point_volts(point: PlanPoint, calibration: Calibration) -> StereoVolts:
    """Return the volts that make both eyes meet on a point; raise OutOfRange naming the point."""
    left, right = gazes_rad(point, calibration)
    try:
        return StereoVolts(
            left=calibration.left.mirror.volts(*left), right=calibration.right.mirror.volts(*right)
        )
    except OutOfRange as error:
        raise OutOfRange(f"{point}: {error}") from error


def all_point_volts(sequence: Sequence[PlanPoint], calibration: Calibration) -> tuple[StereoVolts, ...]:
    """Return the volts of many points, vectorised; raise OutOfRange naming the first point out of reach."""
    gazes = np.array([gazes_rad(point, calibration) for point in sequence]).reshape(-1, 2, 2)
    mirrors = calibration.left.mirror, calibration.right.mirror
    inside = mirrors[0].inside(gazes[:, 0]) & mirrors[1].inside(gazes[:, 1])
    if not inside.all():
        point_volts(sequence[int(np.argmin(inside))], calibration)
    left, right = (mirror.volts_for(gazes[:, eye]).tolist() for eye, mirror in enumerate(mirrors))
    return tuple(
        StereoVolts(left=MirrorVolts(x_v=lx_v, y_v=ly_v), right=MirrorVolts(x_v=rx_v, y_v=ry_v))
        for (lx_v, ly_v), (rx_v, ry_v) in zip(left, right, strict=True)
    )


def _check_filled_in(plan: RasterPlan) -> None:
    if plan.needs_distance:
        raise InvalidInput(
            "raster plan: the distance at which the eyes verge is to be the scene's average and is not"
            " measured yet; measure it and fill it in, or give distance_m"
        )
    if plan.needs_field:
        raise InvalidInput(
            "raster plan: the size of the grid is not filled in yet; fill it in from the calibration, or give"
            " half_width_deg and half_height_deg"
        )


def _grid_order(grid: GridPoints) -> list[tuple[int, int]]:
    """Return (column, row) of every node in the order of capture."""
    places = []
    for row in range(grid.rows):
        back = grid.order == "serpentine" and row % 2 == 1
        columns = range(grid.columns)[::-1] if back else range(grid.columns)
        places += [(column, row) for column in columns]
    return places


def _set_points(plan: RasterPlan) -> tuple[SetPoint, ...]:
    source = plan.points
    if not isinstance(source, GridPoints):
        return source.points
    across = _nodes_deg(source.columns, source.centre_ax_deg, source.half_width_deg or 0.0)
    down = _nodes_deg(source.rows, source.centre_ay_deg, source.half_height_deg or 0.0)
    return tuple(SetPoint(ax_deg=across[column], ay_deg=down[row]) for column, row in _grid_order(source))


def _nodes_deg(count: int, centre_deg: float, half_deg: float) -> list[float]:
    if count == 1:
        return [centre_deg]
    return [centre_deg + half_deg * (2 * k - (count - 1)) / (count - 1) for k in range(count)]


def _point(plan: RasterPlan, number: int, place: tuple[int, int], where: SetPoint) -> PlanPoint:
    distance = where.distance_m if where.distance_m is not None else plan.verging.distance_m
    if distance is None:
        raise AssertionError("checked when the plan was found filled in")
    return PlanPoint(
        index=number,
        scan=0,
        point=number,
        column=place[0],
        row=place[1],
        ax_rad=math.radians(where.ax_deg),
        ay_rad=math.radians(where.ay_deg),
        distance_m=metres(distance),
        shift_rad=math.radians(where.shift_deg),
    )


def _in_scan(point: PlanPoint, scan: int, per_scan: int, place_mm: float | None) -> PlanPoint:
    return PlanPoint(
        index=scan * per_scan + point.point,
        scan=scan,
        point=point.point,
        column=point.column,
        row=point.row,
        ax_rad=point.ax_rad,
        ay_rad=point.ay_rad,
        distance_m=point.distance_m,
        shift_rad=point.shift_rad,
        rail_m=None if place_mm is None else 1e-3 * place_mm,
    )
