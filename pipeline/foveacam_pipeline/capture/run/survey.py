"""Prepares a capture: measures the scene's average distance by fixations, and checks the plan on the rig."""

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
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget


def prepare_plan(
    access: RigAccess, plan: RasterPlan, calibration: Calibration, *, watch: CaptureWatcher
) -> tuple[RasterPlan, tuple[float | None, ...]]:
    """Return the plan, filled in and checked against the rig, and the distances measured, m.

    A distance is None where a fixation found none.
    """
    measured: tuple[float | None, ...] = ()
    average_m = None
    if plan.needs_distance:
        measured = measure_distances_m(access, plan, calibration, watch=watch)
        average_m = average_distance_m(measured)
    whole = fill_in_plan(plan, calibration, average_m=average_m)
    rail, exposures_ns = access.run_still(_limits)
    check_plan(whole, calibration, rail=rail)
    check_exposures(whole, exposures_ns)
    return whole, measured


def measure_distances_m(
    access: RigAccess, plan: RasterPlan, calibration: Calibration, *, watch: CaptureWatcher
) -> tuple[float | None, ...]:
    """Return the distances, m, of fixations in the plan's survey directions; None where one failed."""
    directions = survey_directions_rad(plan, calibration).tolist()
    measured: list[float | None] = []
    for number, (ax_rad, ay_rad) in enumerate(directions):
        if watch.cancelled():
            raise Cancelled("the capture was cancelled before its first point")
        note = f"measuring the scene's distance, fixation {number + 1} of {len(directions)}"
        watch.progress(
            CaptureReport(phase=CapturePhase.SURVEY, done=number, total=len(directions), note=note)
        )
        measured.append(measure_distance_m(access, calibration, (ax_rad, ay_rad), watch=watch))
    return tuple(measured)


def measure_distance_m(
    access: RigAccess, calibration: Calibration, direction_rad: tuple[float, float], *, watch: CaptureWatcher
) -> float | None:
    """Return the distance in a direction, m; None when the eyes do not verge there."""
    target = DirectionTarget(ax_rad=direction_rad[0], ay_rad=direction_rad[1])
    try:
        found = fixate(access.head, calibration, target, clock=access.clock, cancelled=watch.cancelled)
    except OutOfRange:
        return None
    return found.distance_m


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
