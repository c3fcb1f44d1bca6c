"""Plans against a rig: fills in what its calibration determines, and refuses what it cannot reach."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, OutOfRange, RailLimits, Role
from foveacam_pipeline.capture.plan.plan_document import GridPoints, RasterPlan
from foveacam_pipeline.capture.plan.plan_field import EYES, beyond_hull_rad, largest_field_deg
from foveacam_pipeline.capture.plan.plan_points import PlanPoint, gazes_rad, points_of_scan
from foveacam_pipeline.capture.plan.set_points import document_distance, metres
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.mirror import MirrorModel

SURVEY_SHARE = 2.0 / 3.0
RAIL_SLACK_M = 1e-6


def average_distance_m(distances_m: Sequence[float | None]) -> float:
    """Return the average distance of a scene: the harmonic mean over its fixations.

    The remaining disparities are then as often near as far, as they are proportional to 1 / Z. None:
    nothing was found there; infinity counts as 1 / Z = 0. Raise InvalidInput when nothing was found at all.
    """
    found = [distance_m for distance_m in distances_m if distance_m is not None]
    if not found:
        raise InvalidInput(
            f"scene's average distance: none of {len(distances_m)} fixations found a distance; give"
            " distance_m yourself, or light the scene better"
        )
    if not all(distance_m > 0.0 for distance_m in found):  # NaN too
        raise InvalidInput(f"scene's average distance: {found} m were measured; every one must lie above 0 m")
    inverse = sum(1.0 / distance_m for distance_m in found) / len(found)
    return 1.0 / inverse if inverse > 0.0 else math.inf


def survey_directions_rad(plan: RasterPlan, calibration: Calibration) -> NDArray[np.float64]:
    """Return (n, 2) float64 (ax, ay), rad: where to fixate to measure the scene's average distance.

    A 3 x 3 grid over two thirds of the plan's field, or of what both eyes reach while the field is unknown.
    """
    left, right, top, bottom = _extent_rad(plan, calibration)
    across = _middle_part(left, right)
    down = _middle_part(top, bottom)
    return np.array([(x, y) for y in down for x in across])


def fill_in_plan(plan: RasterPlan, calibration: Calibration, *, average_m: float | None = None) -> RasterPlan:
    """Return the plan with its distance and the size of its grid filled in; given values stay.

    `average_m`: the scene's average distance, for a plan that `needs_distance`.
    """
    if plan.needs_distance:
        if average_m is None or not average_m > 0.0:
            raise InvalidInput(
                f"raster plan: the scene's average distance is needed, {average_m} was given; measure it by"
                " fixations, or give distance_m"
            )
        verging = plan.verging.model_copy(update={"distance_m": document_distance(average_m)})
        plan = plan.model_copy(update={"verging": verging})
    grid = plan.points
    if isinstance(grid, GridPoints) and grid.half_width_deg is None:
        centre_deg = grid.centre_ax_deg, grid.centre_ay_deg
        field = largest_field_deg(calibration, _distance_m(plan), centre_deg=centre_deg)
        sized = {"half_width_deg": field[0], "half_height_deg": field[1]}
        plan = plan.model_copy(update={"points": grid.model_copy(update=sized)})
    return plan


def check_plan(plan: RasterPlan, calibration: Calibration, *, rail: RailLimits | None) -> None:
    """Raise OutOfRange for the first point or rail position out of reach: which one, and how far beyond.

    `rail`: None on a rig without one. Raise InvalidInput for a plan that is not filled in.
    """
    check_rail(plan, rail)
    scan_points = points_of_scan(plan)
    gazes = np.array([gazes_rad(point, calibration) for point in scan_points])
    inside = np.column_stack(
        [calibration.eye(role).mirror.inside(gazes[:, k]) for k, role in enumerate(EYES)]
    )
    beyond = np.flatnonzero(~inside.all(axis=1))
    if len(beyond) == 0:
        return
    first = int(beyond[0])
    eye = int(np.argmin(inside[first]))
    mirror = calibration.eye(EYES[eye]).mirror
    found = _out_of_reach(scan_points[first], EYES[eye], gazes[first, eye], mirror)
    raise OutOfRange(
        f"raster plan: {found}; {len(beyond)} of {len(scan_points)} points are beyond reach;"
        f" {_remedy(plan, calibration)}"
    )


def check_rail(plan: RasterPlan, rail: RailLimits | None) -> None:
    """Raise OutOfRange when the plan needs a rail that does not exist, or a position beyond its ends."""
    if not plan.rail_positions_mm:
        return
    if rail is None:
        raise OutOfRange(
            f"raster plan: {len(plan.rail_positions_mm)} places on the rail were asked, this rig has no rail;"
            " leave rail_positions_mm empty, or add the rail to the rig's file"
        )
    for number, place_mm in enumerate(plan.rail_positions_mm):
        beyond_m = max(rail.min_m - 1e-3 * place_mm, 1e-3 * place_mm - rail.max_m)
        if beyond_m > RAIL_SLACK_M:
            raise OutOfRange(
                f"raster plan: place {number} of the rail, {place_mm:g} mm, is {1e3 * beyond_m:.3g} mm beyond"
                f" its end (it reaches from {1e3 * rail.min_m:g} to {1e3 * rail.max_m:g} mm);"
                " choose one inside"
            )


def _distance_m(plan: RasterPlan) -> float:
    distance = plan.verging.distance_m
    if distance is None:
        raise AssertionError("filled in before the field")
    return metres(distance)


def _extent_rad(plan: RasterPlan, calibration: Calibration) -> tuple[float, float, float, float]:
    source = plan.points
    if not isinstance(source, GridPoints):
        angles = np.deg2rad([(point.ax_deg, point.ay_deg) for point in source.points])
        (left, top), (right, bottom) = angles.min(axis=0).tolist(), angles.max(axis=0).tolist()
        return left, right, top, bottom
    if source.half_width_deg is None or source.half_height_deg is None:
        return calibration.reach_rad()
    half_x, half_y = math.radians(source.half_width_deg), math.radians(source.half_height_deg)
    x, y = math.radians(source.centre_ax_deg), math.radians(source.centre_ay_deg)
    return x - half_x, x + half_x, y - half_y, y + half_y


def _middle_part(low: float, high: float) -> list[float]:
    middle, half = (low + high) / 2.0, SURVEY_SHARE * (high - low) / 2.0
    return [middle] if half == 0.0 else [middle - half, middle, middle + half]


def _out_of_reach(point: PlanPoint, role: Role, gaze_rad: NDArray[np.float64], mirror: MirrorModel) -> str:
    ax_deg, ay_deg = np.rad2deg(gaze_rad).tolist()
    wanted = f"{point} needs the {role} eye at ax {ax_deg:.2f}°, ay {ay_deg:.2f}°"
    beyond_rad = float(beyond_hull_rad(mirror, gaze_rad[None])[0])
    if beyond_rad > mirror.margin_rad:
        return f"{wanted}, {math.degrees(beyond_rad):.2f}° beyond its calibrated field"
    return f"{wanted}, which takes more volts than were calibrated"


def _remedy(plan: RasterPlan, calibration: Calibration) -> str:
    grid = plan.points
    if not isinstance(grid, GridPoints):
        return "move these points towards the middle, or give them a larger distance"
    distance_m = _distance_m(plan)
    try:
        width, height = largest_field_deg(
            calibration, distance_m, centre_deg=(grid.centre_ax_deg, grid.centre_ay_deg)
        )
    except OutOfRange as error:
        return str(error).removeprefix("raster plan: ")
    how = "in parallel" if math.isinf(distance_m) else f"at {distance_m:g} m"
    return f"{how} the grid may be ±{width:g}° x ±{height:g}°, or choose a larger distance"
