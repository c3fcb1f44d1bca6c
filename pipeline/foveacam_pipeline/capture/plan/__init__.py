"""Raster plans: what a capture takes, in which order; how long, how large, how much of it. No device."""

from foveacam_pipeline.capture.plan.plan_coverage import PlanCoverage, coverage
from foveacam_pipeline.capture.plan.plan_document import (
    PAPER_RAIL_MM,
    GridPoints,
    RasterPlan,
    SetPoints,
    Verging,
    plan_from,
)
from foveacam_pipeline.capture.plan.plan_estimate import (
    CaptureEstimate,
    CapturePace,
    ImageSize,
    KindSize,
    assumed_ratio,
    check_disk,
    corrected_ratio,
    estimate,
    point_limit_ms,
    shot_limit_ms,
)
from foveacam_pipeline.capture.plan.plan_field import largest_field_deg
from foveacam_pipeline.capture.plan.plan_picture import draw_coverage
from foveacam_pipeline.capture.plan.plan_points import (
    PlanPoint,
    gazes_rad,
    points,
    points_of_scan,
    steer,
    steer_all,
)
from foveacam_pipeline.capture.plan.plan_reach import (
    average_distance_m,
    check_plan,
    check_rail,
    prepared,
    survey_directions_rad,
)
from foveacam_pipeline.capture.plan.set_point import SetPoint
from foveacam_pipeline.capture.plan.set_point_text import format_set_points, parse_set_points

__all__ = [
    "PAPER_RAIL_MM",
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
    "Verging",
    "assumed_ratio",
    "average_distance_m",
    "check_disk",
    "check_plan",
    "check_rail",
    "corrected_ratio",
    "coverage",
    "draw_coverage",
    "estimate",
    "format_set_points",
    "gazes_rad",
    "largest_field_deg",
    "parse_set_points",
    "plan_from",
    "point_limit_ms",
    "points",
    "points_of_scan",
    "prepared",
    "shot_limit_ms",
    "steer",
    "steer_all",
    "survey_directions_rad",
]
