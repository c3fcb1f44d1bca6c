"""Prepares a capture: measures the scene's average distance by fixations, and checks the plan on the rig."""

import numpy as np

from foveacam_hardware.contract import Cancelled, InvalidInput, OutOfRange, RailLimits, ValueRange
from foveacam_pipeline.capture.plan import (
    RasterPlan,
    average_distance_m,
    check_plan,
    fill_in_plan,
    survey_directions_rad,
)
from foveacam_pipeline.capture.run.access import CaptureRig, CaptureWatcher, RigAccess
from foveacam_pipeline.capture.run.values import CapturePhase, CaptureReport
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import DirectionTarget

KNOWN_REACH_PX = 8.0
"""Radius about a survey direction within which a known depth replaces a fixation, wide px."""
KNOWN_SIGMA_SHARE = 0.05
"""Largest relative standard error of such a depth; the average of the scene needs no better one."""


def prepare_plan(
    access: RigAccess,
    plan: RasterPlan,
    calibration: Calibration,
    *,
    watch: CaptureWatcher,
    measured_m: tuple[float | None, ...] = (),
) -> tuple[RasterPlan, tuple[float | None, ...]]:
    """Return the plan, filled in and checked against the rig, and the distances measured, m.

    A distance is None where a fixation found none. `measured_m`: those of `measure_distances_m`, if they were
    measured before.
    """
    average_m = None
    if plan.needs_distance:
        measured_m = measured_m or measure_distances_m(access, plan, calibration, watch=watch)
        average_m = average_distance_m(measured_m)
    whole = fill_in_plan(plan, calibration, average_m=average_m)
    rail, exposures_ns = access.run_still(_limits)
    check_plan(whole, calibration, rail=rail)
    check_exposures(whole, exposures_ns)
    return whole, measured_m


def measure_distances_m(
    access: RigAccess,
    plan: RasterPlan,
    calibration: Calibration,
    *,
    watch: CaptureWatcher,
    context: DepthContext | None = None,
) -> tuple[float | None, ...]:
    """Return the distances, m, in the plan's survey directions; None where they cannot be found.

    Where `context` knows the depth no fixation is made.
    """
    directions = survey_directions_rad(plan, calibration).tolist()
    measured: list[float | None] = []
    for number, (ax_rad, ay_rad) in enumerate(directions):
        if (known_m := known_distance_m(context, calibration, (ax_rad, ay_rad))) is not None:
            measured.append(known_m)
            continue
        if watch.cancelled():
            raise Cancelled("the capture was cancelled before its first point")
        note = f"measuring the scene's distance, fixation {number + 1} of {len(directions)}"
        watch.progress(
            CaptureReport(phase=CapturePhase.SURVEY, done=number, total=len(directions), note=note)
        )
        measured.append(
            measure_distance_m(access, calibration, (ax_rad, ay_rad), watch=watch, context=context)
        )
    return tuple(measured)


def measure_distance_m(
    access: RigAccess,
    calibration: Calibration,
    direction_rad: tuple[float, float],
    *,
    watch: CaptureWatcher,
    context: DepthContext | None = None,
) -> float | None:
    """Return the distance in a direction, m; None when the eyes do not verge there."""
    target = DirectionTarget(ax_rad=direction_rad[0], ay_rad=direction_rad[1])
    try:
        found = fixate(
            access.head,
            calibration,
            target,
            clock=access.clock,
            known=PriorKnowledge(context=context),
            cancelled=watch.cancelled,
        )
    except OutOfRange:
        return None
    return found.distance_m


def known_directions(plan: RasterPlan, calibration: Calibration, context: DepthContext) -> int:
    """Return in how many of a plan's survey directions the depth is known, so that none is fixated."""
    if not plan.needs_distance:
        return 0
    directions = survey_directions_rad(plan, calibration).tolist()
    return sum(known_distance_m(context, calibration, (ax, ay)) is not None for ax, ay in directions)


def known_distance_m(
    context: DepthContext | None, calibration: Calibration, direction_rad: tuple[float, float]
) -> float | None:
    """Return the median of the distances measured about a direction, m; None where it is not known."""
    if context is None:
        return None
    target = np.tan(direction_rad)
    near = context.around(target, reach_tan=KNOWN_REACH_PX / calibration.wide.fx_px)
    near = near.only(near.sigma_per_m <= KNOWN_SIGMA_SHARE * near.inverse_z_per_m)
    if len(near) == 0:
        return None
    return float(np.sqrt(1.0 + target @ target) / np.median(near.inverse_z_per_m))


def check_exposures(plan: RasterPlan, spans_ns: tuple[ValueRange, ...]) -> None:
    """Raise OutOfRange for an exposure of the bracket that a camera cannot take."""
    for exposure_ms in plan.exposures_ms:
        for span in spans_ns:
            if not span.low <= 1e6 * exposure_ms <= span.high:
                raise OutOfRange(
                    f"raster plan: an exposure of {exposure_ms:g} ms was asked, the foveae take"
                    f" {span.low / 1e6:g} to {span.high / 1e6:g} ms; choose one inside"
                )


def _limits(rig: CaptureRig) -> tuple[RailLimits | None, tuple[ValueRange, ...]]:
    if not (rig.left.settings.triggered and rig.right.settings.triggered):
        raise InvalidInput("capture: both foveae must wait for their trigger; configure them as triggered")
    rail = None if rig.rail is None else rig.rail.limits
    return rail, (rig.left.ranges.exposure_ns, rig.right.ranges.exposure_ns)
