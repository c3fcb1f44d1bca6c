"""The duration of a capture as a range: assumed at first, then from the times of the rig's last captures."""

import math

import pytest

from foveacam_hardware.contract import Cancelled, Frame, InvalidInput, VirtualClock
from foveacam_pipeline.capture.plan import (
    CapturePace,
    ImageSize,
    RasterPlan,
    StepTimes,
    TimeRange,
    Verging,
    capture_duration,
    estimate_capture,
    point_limit_ms,
)
from foveacam_pipeline.capture.run import CapturePhase, CaptureReport, PaceMeter

GREY = ImageSize(width=1440, height=1080)
RIG120 = CapturePace(settle_ms=10.0, exposure_ms=5.0)
ROOMY = RasterPlan(wide="scan")
EACH = RasterPlan(wide="scan", verging=Verging(each_point=True))
STEPS = StepTimes(fixation_s=1.2, shot_s=0.25, closing_s=0.4)


class Watch:
    """A watcher that remembers what it was told."""

    def __init__(self) -> None:
        self.reports: list[CaptureReport] = []

    def progress(self, report: CaptureReport) -> None:
        self.reports.append(report)

    def cancelled(self) -> bool:
        return False

    def paused(self) -> bool:
        return True

    def ask_operator(self, request: str) -> None:
        raise Cancelled(request)

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        raise Cancelled("frames")


def duration(plan: RasterPlan, *runs: StepTimes, survey: int = 9, done: int = 0) -> TimeRange:
    needed = estimate_capture(plan, RIG120, fovea=GREY, wide=GREY, done=done)
    fixations = survey + (needed.points if plan.verging.each_point else 0)
    return capture_duration(needed, runs, fixations=fixations).total


def true_s(plan: RasterPlan, steps: StepTimes, *, survey: int = 9) -> float:
    """Return how long a capture takes whose steps take exactly as long as stated."""
    points = plan.scans * plan.points_per_scan
    fixations = survey + (points if plan.verging.each_point else 0)
    shot_s = 1e-3 * point_limit_ms(plan, RIG120) + (steps.shot_s or 0.0)
    return fixations * (steps.fixation_s or 0.0) + points * shot_s + (steps.closing_s or 0.0)


def drive(
    meter: PaceMeter, clock: VirtualClock, plan: RasterPlan, steps: StepTimes, *, survey: int = 9
) -> float:
    """Report a capture as `run_capture` does, by a clock that every step moves on; return its duration."""
    begin_ns = clock.now_ns()

    def pass_s(seconds: float | None) -> None:
        clock.sleep_until_ns(clock.now_ns() + round(1e9 * (seconds or 0.0)))

    points = plan.scans * plan.points_per_scan
    for done in range(survey):
        meter.progress(CaptureReport(phase=CapturePhase.SURVEY, done=done, total=survey))
        pass_s(steps.fixation_s)
    meter.progress(CaptureReport(phase=CapturePhase.POINTS, done=0, total=points))
    for done in range(points):
        if done == 2:  # neither a pause nor a move of the rail is part of the pace
            for phase in (CapturePhase.PAUSED, CapturePhase.RAIL):
                meter.progress(CaptureReport(phase=phase, done=done, total=points))
                pass_s(300.0)
                begin_ns += 300_000_000_000
        each = steps.fixation_s if plan.verging.each_point else 0.0
        pass_s((steps.shot_s or 0.0) + (each or 0.0) + 1e-3 * point_limit_ms(plan, RIG120))
        meter.progress(CaptureReport(phase=CapturePhase.POINTS, done=done + 1, total=points))
    meter.progress(CaptureReport(phase=CapturePhase.CLOSING, done=points, total=points))
    pass_s(steps.closing_s)
    meter.progress(CaptureReport(phase=CapturePhase.POINTS, done=points, total=points))
    return (clock.now_ns() - begin_ns) / 1e9


@pytest.mark.parametrize(
    ("plan", "survey"),
    [(ROOMY, 9), (ROOMY, 0), (EACH, 9), (RasterPlan(wide="scan", stack_frames=4), 9)],
    ids=["surveyed", "given", "each point", "stacks"],
)
def test_an_estimate_by_one_measured_capture_holds_the_duration_of_the_next(
    plan: RasterPlan, survey: int
) -> None:
    clock = VirtualClock()
    meter = PaceMeter(Watch(), clock=clock)
    took_s = drive(meter, clock, plan, STEPS, survey=survey)
    measured = meter.step_times(plan, RIG120)
    assert measured is not None

    found = duration(plan, measured, survey=survey)

    assert found.low_s < took_s < found.high_s
    assert found.high_s < 4.0 * found.low_s


def test_the_times_of_the_steps_are_measured_without_pauses_and_moves() -> None:
    clock = VirtualClock()
    meter = PaceMeter(Watch(), clock=clock)
    drive(meter, clock, ROOMY, STEPS)
    found = meter.step_times(ROOMY, RIG120)
    assert found is not None
    assert (found.fixation_s, found.shot_s, found.closing_s) == pytest.approx((1.2, 0.25, 0.4))


def test_the_times_of_a_capture_of_9_points_hold_for_81() -> None:
    steps = [StepTimes(fixation_s=f, shot_s=s, closing_s=0.3) for f, s in ((1.0, 0.2), (1.4, 0.3))]
    between = StepTimes(fixation_s=1.2, shot_s=0.24, closing_s=0.3)
    found = duration(ROOMY, *steps)
    assert found.low_s < true_s(ROOMY, between) < found.high_s
    alone = duration(ROOMY, steps[0])
    assert (alone.low_s, alone.high_s < found.high_s) == (found.low_s, True)


def test_nothing_measured_gives_what_is_assumed_from_the_physical_limit_on() -> None:
    needed = estimate_capture(ROOMY, RIG120, fovea=GREY, wide=GREY)
    found = capture_duration(needed, (), fixations=9)
    assert found.captures == 0
    assert found.total.low_s > needed.limit_s
    assert found.total.low_s < true_s(ROOMY, STEPS) < found.total.high_s


def test_a_range_never_begins_below_the_physical_limit() -> None:
    fast = StepTimes(fixation_s=None, shot_s=0.0, closing_s=0.0)
    needed = estimate_capture(ROOMY, RIG120, fovea=GREY, wide=GREY)
    assert duration(ROOMY, fast, survey=0).low_s == pytest.approx(needed.limit_s)


def test_the_preparing_part_is_stated_beside_the_total() -> None:
    needed = estimate_capture(ROOMY, RIG120, fovea=GREY, wide=GREY)
    found = capture_duration(needed, (STEPS,), fixations=9, preparing=9)
    assert found.preparing.low_s < 9 * 1.2 < found.preparing.high_s
    assert found.preparing.high_s < found.total.high_s
    assert capture_duration(needed, (STEPS,), fixations=0).preparing == TimeRange(low_s=0.0, high_s=0.0)


def test_a_capture_that_took_no_point_measured_nothing() -> None:
    meter = PaceMeter(Watch(), clock=VirtualClock())
    assert meter.step_times(ROOMY, RIG120) is None
    meter.progress(CaptureReport(phase=CapturePhase.SURVEY, done=0, total=9))
    assert meter.step_times(ROOMY, RIG120) is None


def test_fixations_alone_are_measured_before_the_first_point() -> None:
    clock = VirtualClock()
    meter = PaceMeter(Watch(), clock=clock)
    for done in range(3):
        meter.progress(CaptureReport(phase=CapturePhase.SURVEY, done=done, total=3))
        clock.sleep_until_ns(clock.now_ns() + 1_500_000_000)
    assert meter.fixation_s() == pytest.approx(1.5)


def test_the_meter_passes_everything_on() -> None:
    watch = Watch()
    meter = PaceMeter(watch, clock=VirtualClock())
    report = CaptureReport(phase=CapturePhase.POINTS, done=0, total=1)
    meter.progress(report)
    assert watch.reports == [report]
    assert (meter.cancelled(), meter.paused()) == (False, True)
    with pytest.raises(Cancelled, match="push"):
        meter.ask_operator("push")
    with pytest.raises(Cancelled, match="frames"):
        meter.show_frames(())


@pytest.mark.parametrize("fixation_s", [-1.0, math.nan, math.inf])
def test_times_that_cannot_be_are_refused(fixation_s: float) -> None:
    with pytest.raises(InvalidInput, match="cannot be"):
        StepTimes(fixation_s=fixation_s, shot_s=0.1, closing_s=0.1)
