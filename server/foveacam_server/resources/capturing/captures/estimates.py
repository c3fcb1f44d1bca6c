"""Checks plans of captures and estimates their time and size from the rig's properties."""

import math
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path

from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.plan import (
    RasterPlan,
    StepTimes,
    capture_duration,
    check_plan,
    check_rail,
    coverage_of,
    fill_in_plan,
    survey_directions_rad,
)
from foveacam_pipeline.capture.run import check_exposures
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.datasets.capture_tools import CaptureRigFacts
from foveacam_server.resources.capturing.captures.schema import (
    CoverageDocument,
    EstimateDocument,
    KindDocument,
)


def check_possible(plan: RasterPlan, calibration: Calibration, facts: CaptureRigFacts) -> None:
    """Raise for a plan that the rig cannot capture at its distance, or at any where the plan has none."""
    check_rail(plan, facts.rail)
    check_exposures(plan, facts.exposures_ns)
    check_plan(fill_in_plan(plan, calibration, average_m=math.inf), calibration, rail=facts.rail)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanToEstimate:
    """A plan with the rig's properties and the times of its last captures.

    `assumed_m`: distance used where the plan has none. `surveyed`: fixations that have measured the distance
    of the plan; they count as part of the capture. `known`: directions whose depth is known without one.
    """

    plan: RasterPlan
    calibration: Calibration
    facts: CaptureRigFacts
    codec: ImageCodec
    folder: Path
    assumed_m: float | None = None
    runs: tuple[StepTimes, ...] = ()
    surveyed: int = 0
    known: int = 0

    @property
    def preparing_fixations(self) -> int:
        """Number of fixations before the first point, made or not."""
        if not self.plan.needs_distance:
            return self.surveyed
        return len(survey_directions_rad(self.plan, self.calibration)) - self.known


def estimate_plan(asked: PlanToEstimate) -> EstimateDocument:
    """Return time, size, warnings and footprints, which takes seconds for ten thousand points."""
    plan, calibration, facts = asked.plan, asked.calibration, asked.facts
    whole = fill_in_plan(plan, calibration, average_m=asked.assumed_m)
    check_plan(whole, calibration, rail=facts.rail)
    check_exposures(whole, facts.exposures_ns)
    cover = coverage_of(whole, calibration)
    needed = facts.estimate(whole, calibration, codec=asked.codec)
    preparing = asked.preparing_fixations
    expected = capture_duration(
        needed,
        asked.runs,
        fixations=preparing + (needed.points if whole.verging.each_point else 0),
        preparing=preparing,
    )
    return EstimateDocument(
        plan=whole.model_dump(mode="json"),
        distance_assumed=plan.needs_distance,
        points=needed.points,
        shots=needed.shots,
        total_s=round(needed.total_s, 3),
        duration_low_s=round(expected.total.low_s, 3),
        duration_high_s=round(expected.total.high_s, 3),
        preparing_low_s=round(expected.preparing.low_s, 3),
        preparing_high_s=round(expected.preparing.high_s, 3),
        preparing_fixations=preparing,
        timed_captures=expected.captures,
        limit_s=round(needed.limit_s, 3),
        reverge_s=round(needed.reverge_s, 3),
        rail_s=round(needed.rail_s, 3),
        hand_moves=needed.hand_moves,
        files=needed.files,
        raw_bytes=needed.raw_bytes,
        stored_bytes=needed.stored_bytes,
        free_bytes=shutil.disk_usage(asked.folder).free,
        kinds=[KindDocument(**asdict(kind)) for kind in needed.kinds],
        warnings=list(cover.warnings),
        coverage=CoverageDocument.of(cover),
    )
