"""The experiment: a figurine in the slots of the rail, localised by the foveae and by the moved wide camera.

The rig is an argument (`RailRig`), real or simulated; only its frames, its calibration and the design of the
rail are used.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled, Clock, DeviceFault, Frame, Head, Rail, Role, Sighting
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.study.localisation.estimator import (
    LocalisedTarget,
    TargetTemplate,
    disparity_bound_px,
    fovea_view,
    localise,
    mark_target,
    wide_view,
    window_at,
)
from foveacam_pipeline.study.localisation.rail import CENTRE, RailPosition, slots
from foveacam_pipeline.study.tradeoff.depth_error import RAIL_M
from foveacam_pipeline.study.visibility.observed import REST_NS
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget, Fixation, FixationState
from foveacam_pipeline.workers.progress import ProgressSteps, ProgressWatcher

CLICK_SIGMA_PX = 1.0
"""Clicks miss the target's centre by this standard deviation, wide px, along each axis."""
BOUND_FRAMES = 6
"""Repeated frames from which noise and texture are measured."""
POLL_NS = 50_000_000
NEAR_M = 1e-3
"""Largest distance of the rail from where it was sent."""


class Pair(StrEnum):
    """The pairs compared: the wide camera, moved half a baseline to each side, and the verged foveae."""

    WIDE = "wide"
    FOVEA = "fovea"


@dataclass(frozen=True, slots=True, kw_only=True)
class RailRig:
    """A rig on a linear stage before the figurine's rail.

    `set_standoff` puts the figurine's rail at a distance; `place` puts the figurine on it.
    """

    head: Head
    stage: Rail
    calibration: Calibration
    clock: Clock
    set_standoff: Callable[[float], None]
    place: Callable[[RailPosition], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentPlan:
    """What is measured: `trials` runs over all slots at each standoff; `seed` of the clicks."""

    standoffs_m: tuple[float, ...] = RAIL_M
    slots: int = 16
    trials: int = 6
    seed: int = 0

    @property
    def positions(self) -> tuple[RailPosition, ...]:
        """The slots in order."""
        return slots(self.slots)

    @property
    def estimates(self) -> int:
        """The number of estimates of both pairs."""
        return len(Pair) * len(self.standoffs_m) * self.trials * self.slots


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetEstimate:
    """One estimate: by which pair, where the figurine stood, and the target found, None where it was not."""

    pair: Pair
    standoff_m: float
    trial: int
    slot: int
    found: LocalisedTarget | None


@dataclass(slots=True, kw_only=True)
class ExperimentRecord:
    """What was measured so far: the estimates, and the bound of the disparity by pair and standoff, px.

    `scene`: a look of the foveae at the middle of the rail at the middle standoff, for a picture.
    """

    plan: ExperimentPlan
    estimates: list[TargetEstimate] = field(default_factory=list)
    bounds_px: dict[tuple[Pair, float], float] = field(default_factory=dict)
    scene: Sighting | None = None

    @property
    def complete(self) -> bool:
        """Whether every planned estimate was made."""
        return len(self.estimates) == self.plan.estimates

    def points_m(self, pair: Pair, standoff_m: float) -> NDArray[np.float64]:
        """Return (trials, slots, 3) of the complete trials, NaN where the target was not found."""
        points = np.full((self.plan.trials, self.plan.slots, 3), np.nan)
        visited = np.zeros(points.shape[:2], dtype=np.bool_)
        for one in self.estimates:
            if (one.pair, one.standoff_m) == (pair, standoff_m):
                visited[one.trial, one.slot] = True
                if one.found is not None:
                    points[one.trial, one.slot] = one.found.point_rig_m
        return points[visited.all(axis=1)]


def run_experiment(rig: RailRig, plan: ExperimentPlan, *, watch: ProgressWatcher) -> ExperimentRecord:
    """Localise the figurine in every slot by both pairs.

    When the watcher cancels, return the record so far, whose `complete` is false; raise Cancelled where it
    has no complete trial yet.
    """
    record = ExperimentRecord(plan=plan)
    steps = ProgressSteps(
        watch,
        len(plan.standoffs_m) * plan.slots * (plan.trials + 1),
        ended="ended before one trial was complete; run it again",
    )
    rng = np.random.default_rng(plan.seed)
    try:
        for standoff_m in plan.standoffs_m:
            rig.set_standoff(standoff_m)
            at = _Standoff(rig=rig, record=record, standoff_m=standoff_m, rng=rng, steps=steps)
            at.run_foveae()
            at.run_wide()
    except Cancelled:
        if not any(len(record.points_m(pair, z_m)) for pair in Pair for z_m in plan.standoffs_m):
            raise
    return record


@dataclass(frozen=True, slots=True, kw_only=True)
class _Standoff:
    """The measurements at one standoff."""

    rig: RailRig
    record: ExperimentRecord
    standoff_m: float
    rng: np.random.Generator
    steps: ProgressSteps

    def run_foveae(self) -> None:
        """Run all trials with the foveae, each in one go: mounts drift by temperature."""
        slide_to(self.rig.stage, self.rig.clock, 0.0)
        self._place(CENTRE)
        reference = self._fixate(self._clicked_m(CENTRE, jitter=False))
        if reference.sighting is None or reference.volts is None:
            raise DeviceFault(f"the foveae did not verge at {self.standoff_m:g} m: {reference.reason}")
        middle = self.record.plan.standoffs_m[len(self.record.plan.standoffs_m) // 2]
        if self.standoff_m == middle:
            self.record.scene = reference.sighting
        template = mark_target(
            fovea_view(reference.sighting, self.rig.calibration), CENTRE.target_m(self.standoff_m)
        )
        looks = [self.rig.head.look(reference.volts) for _ in range(BOUND_FRAMES)]
        self._keep_bound(Pair.FOVEA, [look.left for look in looks], self._raw_left_px(looks[0]))
        for trial in range(self.record.plan.trials):
            for slot, position in enumerate(self.record.plan.positions):
                self._place(position)
                found = self._by_foveae(self._clicked_m(position), template)
                self._keep(Pair.FOVEA, trial, slot, found)
                self.steps.step(f"foveae, {self.standoff_m:g} m, run {trial + 1}")

    def run_wide(self) -> None:
        """Run all trials with the wide camera: at each slot all frames from the left, then from the right."""
        half_m = self.rig.calibration.baseline_m / 2.0
        self._place(CENTRE)
        slide_to(self.rig.stage, self.rig.clock, -half_m)
        frames = self._wide_frames(BOUND_FRAMES)
        view = wide_view(
            frames[0], frames[0], self.rig.calibration
        )  # the template needs its left picture only
        template = mark_target(view, CENTRE.target_m(self.standoff_m))
        self._keep_bound(Pair.WIDE, frames, template.at_px)
        for slot, position in enumerate(self.record.plan.positions):
            self._place(position)
            sides = []
            for x_m in (-half_m, half_m):
                slide_to(self.rig.stage, self.rig.clock, x_m)
                sides.append(self._wide_frames(self.record.plan.trials))
            for trial, (left, right) in enumerate(zip(*sides, strict=True)):
                view = wide_view(left, right, self.rig.calibration)
                clicked_px = view.left_pixel(self._clicked_m(position))
                found = localise(view, template, clicked_px, standoff_m=self.standoff_m)
                self._keep(Pair.WIDE, trial, slot, found)
            self.steps.step(f"wide pair, {self.standoff_m:g} m")

    def _by_foveae(
        self, clicked_m: tuple[float, float, float], template: TargetTemplate
    ) -> LocalisedTarget | None:
        fixation = self._fixate(clicked_m)
        if fixation.state is not FixationState.VERGED or fixation.sighting is None:
            return None
        view = fovea_view(fixation.sighting, self.rig.calibration)
        return localise(view, template, view.left_pixel(clicked_m), standoff_m=self.standoff_m)

    def _fixate(self, clicked_m: tuple[float, float, float]) -> Fixation:
        x_m, y_m, z_m = clicked_m
        target = DirectionTarget(ax_rad=math.atan2(x_m, z_m), ay_rad=math.atan2(y_m, z_m))
        return fixate(self.rig.head, self.rig.calibration, target, clock=self.rig.clock)

    def _place(self, position: RailPosition) -> None:
        self.rig.place(position)
        self.rig.clock.sleep_until_ns(self.rig.clock.now_ns() + REST_NS)

    def _clicked_m(self, position: RailPosition, *, jitter: bool = True) -> tuple[float, float, float]:
        """Return the point that is clicked: the target's, missed by some wide px."""
        x_m, y_m, z_m = position.target_m(self.standoff_m)
        miss_m = z_m / self.rig.calibration.wide.fx_px * CLICK_SIGMA_PX
        right_m, down_m = (miss_m * self.rng.standard_normal(2) * jitter).tolist()
        return x_m + right_m, y_m + down_m, z_m

    def _wide_frames(self, count: int) -> list[Frame]:
        return [self.rig.head.wide(max_age_ms=0.0) for _ in range(count)]

    def _raw_left_px(self, look: Sighting) -> tuple[int, int]:
        """Return the raw left pixel at which the calibration expects the target on the middle of the rail."""
        x_m, y_m, z_m = CENTRE.target_m(self.standoff_m)
        calibration = self.rig.calibration
        plane = plane_from_raw(calibration, Role.LEFT, look.volts, depth_m=z_m)
        u = calibration.fovea_f_px * np.array([[(x_m + calibration.baseline_m / 2.0) / z_m, y_m / z_m]])
        x_px, y_px = homography_apply(np.asarray(np.linalg.inv(plane), dtype=np.float64), u)[0].tolist()
        return round(x_px), round(y_px)

    def _keep_bound(self, pair: Pair, frames: Sequence[Frame], at_px: tuple[int, int]) -> None:
        f_px = self.rig.calibration.wide.fx_px if pair is Pair.WIDE else self.rig.calibration.fovea_f_px
        half = window_at(f_px, self.standoff_m).half_px
        rows, columns = (slice(place - half, place + half + 1) for place in reversed(at_px))
        windows = np.array([gray(to_uint8(frame))[rows, columns] for frame in frames], dtype=np.float64)
        self.record.bounds_px[pair, self.standoff_m] = disparity_bound_px(windows)

    def _keep(self, pair: Pair, trial: int, slot: int, found: LocalisedTarget | None) -> None:
        self.record.estimates.append(
            TargetEstimate(pair=pair, standoff_m=self.standoff_m, trial=trial, slot=slot, found=found)
        )


def slide_to(stage: Rail, clock: Clock, x_m: float) -> None:
    """Move the rig along its stage and wait until it rests; home the stage before its first move.

    Raise DeviceFault where it does not arrive.
    """
    if not stage.state.homed:
        stage.home()
        _wait(stage, clock)
    stage.move_to(x_m)
    _wait(stage, clock)
    state = stage.state
    if state.position_m is None or abs(state.position_m - x_m) > NEAR_M:
        raise DeviceFault(
            f"the linear stage was sent to {1e3 * x_m:g} mm and did not arrive "
            f"({state.fault or 'it was held'}); free it and run the study again"
        )


def _wait(stage: Rail, clock: Clock) -> None:
    clock.sleep_until_ns(clock.now_ns() + POLL_NS)
    while stage.state.moving:
        clock.sleep_until_ns(clock.now_ns() + POLL_NS)
    clock.sleep_until_ns(clock.now_ns() + POLL_NS)
