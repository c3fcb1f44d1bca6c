"""Looks and recorded steps of one fixation, ended by its limits, its deadline or a request to cancel."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from foveacam_hardware.contract import Cancelled, Clock, Frame, Head, OutOfRange, Role, Sighting, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import Gazes, clamp_gazes, gazes_under, volts_for
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.looking.passing_detector import PassingDetector, wait_until_still
from foveacam_pipeline.verge.matching.row_spectra import LookRows
from foveacam_pipeline.verge.matching.survey import ReducedLook, even_look, shrink_look
from foveacam_pipeline.verge.matching.target_offset import TargetOffset
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import Basis, FixationState, VergePhase, VergeStep

EDGE_TOLERANCE = 1.0e-3
"""Tolerance of gazes beyond the edge of the field, as a share of the gaze: half a wide px."""
FIRST_LEAD_NS = 20_000_000
"""Time from the request of a look to mid-exposure, assumed until measured (settling, exposure)."""


class FixationEnded(Exception):
    """The fixation ended without verging; `state` and `reason` say how.

    `target_offset`: how far both eyes show the target from its place, if that is the cause. `missing`: the
    eye without a camera, if that is the cause.
    """

    def __init__(
        self,
        state: FixationState,
        reason: str,
        *,
        target_offset: TargetOffset | None = None,
        missing: Role | None = None,
    ) -> None:
        super().__init__(reason)
        self.state = state
        self.reason = reason
        self.target_offset = target_offset
        self.missing = missing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observation:
    """One look: its frames, and the gazes in force during the exposure."""

    phase: VergePhase
    gazes: Gazes
    sighting: Sighting
    _shrunk: dict[float, ReducedLook] = field(default_factory=dict, init=False, repr=False)
    _reduced: dict[float, ReducedLook] = field(default_factory=dict, init=False, repr=False)
    _rows: dict[float, LookRows] = field(default_factory=dict, init=False, repr=False)

    def shrunk(self, calibration: Calibration, *, f_px: float) -> ReducedLook:
        """Return both foveae at survey scale, not equalised; computed once a look."""
        if f_px not in self._shrunk:
            self._shrunk[f_px] = shrink_look(self.sighting, calibration, f_px=f_px)
        return self._shrunk[f_px]

    def reduced(self, calibration: Calibration, *, f_px: float) -> ReducedLook:
        """Return both foveae at survey scale with contrast equalised; computed once a look."""
        if f_px not in self._reduced:
            self._reduced[f_px] = even_look(self.shrunk(calibration, f_px=f_px))
        return self._reduced[f_px]

    def rows(self, calibration: Calibration, *, f_px: float) -> LookRows:
        """Return the spectra of the rows of `shrunk`; computed once a look."""
        if f_px not in self._rows:
            self._rows[f_px] = LookRows.of(self.shrunk(calibration, f_px=f_px))
        return self._rows[f_px]


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult:
    """Result of a step: left minus right place, fovea px (None if not matched), and the correlation."""

    score: float
    residual_x_px: float | None = None
    residual_y_px: float | None = None


class FixationHead:
    """Makes looks with the head within the limits of one fixation, and records its steps."""

    def __init__(
        self,
        head: Head,
        calibration: Calibration,
        *,
        clock: Clock,
        limits: VergeSettings,
        on_step: Callable[[VergeStep], None] | None,
        on_estimate: Callable[[DistanceEstimate], None] | None = None,
        cancelled: Callable[[], bool] | None,
    ) -> None:
        self._head = head
        self._calibration = calibration
        self._clock = clock
        self._max_looks = limits.max_looks
        self._deadline_ms = 1e3 * limits.timeout_s
        self._on_step = on_step
        self._on_estimate = on_estimate
        self._estimated_looks = 0
        self._cancelled = cancelled
        self._started_ns = clock.now_ns()
        self._own = _Stopwatch()
        self._steps: list[VergeStep] = []
        self._lead_ns = FIRST_LEAD_NS
        self._covered_in: Callable[[Frame], bool] | None = None
        self.last: Observation | None = None
        self.covered = False
        """Whether something was in front of the target in any look since `watch`."""

    @property
    def steps(self) -> tuple[VergeStep, ...]:
        """The steps so far."""
        return tuple(self._steps)

    @property
    def missing(self) -> Role | None:
        """The eye without a camera in the last look, if any."""
        return None if self.last is None else self.last.sighting.missing

    @property
    def elapsed_ms(self) -> float:
        """Time since the fixation began, on the rig's clock."""
        return (self._clock.now_ns() - self._started_ns) / 1e6

    @property
    def next_ns(self) -> int:
        """Predicted exposure time of the next look, from the delay of the last one."""
        return self._clock.now_ns() + self._lead_ns

    def wide(self) -> Frame:
        """Return a recent wide frame."""
        self._check()
        with self._own.paused():
            return self._head.wide()

    def wait_until_still(self, around: PassingDetector, *, shown: Callable[[Frame], bool]) -> None:
        """Wait until nothing moves about a target, or until it is shown again."""
        with self._own.paused():
            wait_until_still(around, self.wide, self._clock, shown=shown)

    def watch(self, covered_in: Callable[[Frame], bool]) -> None:
        """From now on, note whether the wide frame of any look shows something in front of the target."""
        self._covered_in, self.covered = covered_in, False

    def look_clamped(self, gazes: Gazes, phase: VergePhase) -> Observation:
        """Look with each gaze clamped to its eye's field; raise FixationEnded at the limits."""
        return self.look(clamp_gazes(self._calibration, gazes), phase)

    def grant(self, *, looks: int, seconds: float) -> None:
        """Allow this many further looks and seconds, counted from now."""
        self._max_looks = len(self._steps) + looks
        self._deadline_ms = self.elapsed_ms + 1e3 * seconds

    def look(self, gazes: Gazes, phase: VergePhase) -> Observation:
        """Steer both eyes and look; raise FixationEnded beyond the calibrated field or the limits."""
        self._check()
        if len(self._steps) >= self._max_looks:
            raise FixationEnded(
                FixationState.TIMED_OUT,
                f"Not settled after {len(self._steps)} looks: the target may move too fast; try again.",
            )
        volts = self._volts(gazes)
        requested_ns = self._clock.now_ns()
        with self._own.paused():
            sighting = self._head.look(volts)
        self._lead_ns = max(0, sighting.left.t_ns - requested_ns)
        self.last = Observation(
            phase=phase, gazes=gazes_under(self._calibration, sighting.volts), sighting=sighting
        )
        if self._covered_in is not None and not self.covered:
            self.covered = self._covered_in(sighting.wide)
        return self.last

    def record(self, observation: Observation, measured: StepResult) -> None:
        """Record the step of a look, with the computing time since the previous step."""
        left, right = observation.gazes.left, observation.gazes.right
        step = VergeStep(
            index=len(self._steps),
            phase=observation.phase,
            left_ax_rad=math.atan(left[0]),
            left_ay_rad=math.atan(left[1]),
            right_ax_rad=math.atan(right[0]),
            right_ay_rad=math.atan(right[1]),
            residual_x_px=measured.residual_x_px,
            residual_y_px=measured.residual_y_px,
            score=measured.score,
            compute_ms=self._own.lap_ms(),
        )
        self._steps.append(step)
        if self._on_step is not None:
            with self._own.paused():
                self._on_step(step)

    def report_estimate(self, basis: Basis, point: LocatedPoint | None) -> None:
        """Report an estimate of the target's point, at most once a look; ignore None."""
        if self._on_estimate is None or point is None or len(self._steps) == self._estimated_looks:
            return
        self._estimated_looks = len(self._steps)
        with self._own.paused():
            self._on_estimate(DistanceEstimate(looks=len(self._steps), basis=basis, point=point))

    def _volts(self, gazes: Gazes) -> StereoVolts:
        """Return the volts for both gazes; gazes just beyond the field are moved to its edge."""
        nearer = Gazes(left=gazes.left * (1.0 - EDGE_TOLERANCE), right=gazes.right * (1.0 - EDGE_TOLERANCE))
        with suppress(OutOfRange):
            return volts_for(self._calibration, gazes)
        try:
            return volts_for(self._calibration, nearer)
        except OutOfRange as error:
            raise FixationEnded(FixationState.OUT_OF_RANGE, f"Out of reach: {error}.") from error

    def _check(self) -> None:
        if self._cancelled is not None and self._cancelled():
            raise Cancelled(f"fixation cancelled after {len(self._steps)} looks; ask again to resume")
        if self.elapsed_ms > self._deadline_ms:
            raise FixationEnded(
                FixationState.TIMED_OUT,
                f"No result after {self.elapsed_ms / 1e3:.1f} s and {len(self._steps)} looks; try again.",
            )


class _Stopwatch:
    """Wall time of the fixation's computation; paused while devices or callbacks work."""

    def __init__(self) -> None:
        self._since = time.perf_counter()
        self._pauses = 0

    def lap_ms(self) -> float:
        now = time.perf_counter()
        spent_s, self._since = now - self._since, now
        return 1e3 * spent_s

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Pause; nested pauses count once."""
        began = time.perf_counter()
        self._pauses += 1
        try:
            yield
        finally:
            self._pauses -= 1
            if not self._pauses:
                self._since += time.perf_counter() - began
