"""Raster plans: the points of a capture and their order, its duration, size and coverage.

No device is used.
"""

from foveacam_pipeline.capture.plan.plan_coverage import PlanCoverage, coverage_of
from foveacam_pipeline.capture.plan.plan_document import (
    GridPoints,
    RasterPlan,
    SetPoints,
    Verging,
    plan_from,
)
from foveacam_pipeline.capture.plan.plan_duration import (
    CaptureDuration,
    StepTimes,
    TimeRange,
    capture_duration,
)
from foveacam_pipeline.capture.plan.plan_estimate import (
    CaptureEstimate,
    CapturePace,
    ImageSize,
    KindSize,
    assumed_ratio,
    check_disk,
    estimate_capture,
    point_limit_ms,
    shot_limit_ms,
)
from foveacam_pipeline.capture.plan.plan_field import largest_field_deg
from foveacam_pipeline.capture.plan.plan_points import (
    PlanPoint,
    all_point_volts,
    gazes_rad,
    point_volts,
    points_of_plan,
    points_of_scan,
)
from foveacam_pipeline.capture.plan.plan_reach import (
    average_distance_m,
    check_plan,
    check_rail,
    fill_in_plan,
    survey_directions_rad,
)
from foveacam_pipeline.capture.plan.set_points import SetPoint, parse_set_points

__all__ = [
    "CaptureDuration",
    "CaptureEstimate",
    "CapturePace",
    "GridPoints",
    "ImageSize",
    "KindSize",
    "PlanCoverage",
    "PlanPoint",
    "RasterPlan",
    "SetPoint",
    "SetPoints",
    "StepTimes",
    "TimeRange",
    "Verging",
    "all_point_volts",
    "assumed_ratio",
    "average_distance_m",
    "capture_duration",
    "check_disk",
    "check_plan",
    "check_rail",
    "coverage_of",
    "estimate_capture",
    "fill_in_plan",
    "gazes_rad",
    "largest_field_deg",
    "parse_set_points",
    "plan_from",
    "point_limit_ms",
    "point_volts",
    "points_of_plan",
    "points_of_scan",
    "shot_limit_ms",
    "survey_directions_rad",
]
