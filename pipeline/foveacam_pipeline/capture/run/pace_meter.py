"""Measures how long the steps of a capture take, from its progress reports."""

from collections import Counter

from foveacam_hardware.contract import Clock, Frame
from foveacam_pipeline.capture.plan import CapturePace, RasterPlan, StepTimes, point_limit_ms
from foveacam_pipeline.capture.run.access import CaptureWatcher
from foveacam_pipeline.capture.run.values import CapturePhase, CaptureReport


class PaceMeter:
    """Implements `CaptureWatcher`: passes everything on to another, and measures by a clock of real time.

    The time between two reports belongs to the phase of the first, so that pauses and moves are left out.
    """

    def __init__(self, watch: CaptureWatcher, *, clock: Clock) -> None:
        self._watch, self._clock = watch, clock
        self._spent_ns: Counter[CapturePhase] = Counter()
        self._steps: Counter[CapturePhase] = Counter()
        self._last: CaptureReport | None = None
        self._last_ns = clock.now_ns()

    def progress(self, report: CaptureReport) -> None:
        """Measure the time since the last report, and pass the report on."""
        self._account(done=report.done)
        self._last = report
        self._watch.progress(report)

    def cancelled(self) -> bool:
        """Return whether the capture is to end."""
        return self._watch.cancelled()

    def paused(self) -> bool:
        """Return whether the capture is to wait."""
        return self._watch.paused()

    def ask_operator(self, request: str) -> None:
        """Pass the request on."""
        self._watch.ask_operator(request)

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Pass the frames on."""
        self._watch.show_frames(frames)

    def fixation_s(self) -> float | None:
        """Return the mean time of a fixation before the first point, until now; None without any."""
        if self._last is not None and self._last.phase is CapturePhase.SURVEY:
            self._account(done=self._last.total)
            self._last = None
        return self._mean_s(CapturePhase.SURVEY)

    def step_times(self, plan: RasterPlan, pace: CapturePace) -> StepTimes | None:
        """Return the times of the steps of a capture of this plan; None without a point."""
        point_s = self._mean_s(CapturePhase.POINTS)
        if point_s is None:
            return None
        added_s = point_s - 1e-3 * point_limit_ms(plan, pace)
        closing_s = self._mean_s(CapturePhase.CLOSING)
        if plan.verging.each_point:  # a fixation and its shots are not told apart
            return StepTimes(fixation_s=max(0.0, added_s), shot_s=None, closing_s=closing_s)
        shots = plan.exposures_per_point * plan.stack_frames
        return StepTimes(fixation_s=self.fixation_s(), shot_s=max(0.0, added_s) / shots, closing_s=closing_s)

    def _account(self, *, done: int) -> None:
        """Add the time since the last report to its phase; points by their count, others by their reports."""
        now_ns, last = self._clock.now_ns(), self._last
        if last is not None:
            self._spent_ns[last.phase] += now_ns - self._last_ns
            counted = last.phase is CapturePhase.POINTS
            self._steps[last.phase] += max(0, done - last.done) if counted else 1
        self._last_ns = now_ns

    def _mean_s(self, phase: CapturePhase) -> float | None:
        steps = self._steps[phase]
        return self._spent_ns[phase] / 1e9 / steps if steps else None
