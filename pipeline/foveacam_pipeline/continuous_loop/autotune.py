"""Autotuning on the rig: relay feedback for each axis, then optionally CMA-ES on the step-response cost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from foveacam_pipeline.continuous_loop.polish import search_gains
from foveacam_pipeline.continuous_loop.relay import MISSED_LOOKS, RelayResult, TuneRefused, relay
from foveacam_pipeline.continuous_loop.settings import AXES, Axis, Gains, LoopSettings
from foveacam_pipeline.continuous_loop.step_experiment import (
    StepFunction,
    cost_of,
    measure_steps,
    set_commands,
    settle,
)
from foveacam_pipeline.continuous_loop.step_response import StepResponse
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop

CANDIDATES = 48
OTHER_SHARE, OTHER_SIGMAS = 0.05, 5.0
"""A distance that differs by more than both is of another object (occlusion, or a mirror does not turn)."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneResult:
    """Tuned gains, relay results, and the step-response cost before tuning, after the relays, at the end."""

    settings: LoopSettings
    relays: tuple[RelayResult, ...]
    cost_before: float
    cost_relay: float
    cost: float
    candidates: int
    before: dict[Axis, StepResponse]
    after: dict[Axis, StepResponse]


def autotune(
    loop: VergenceLoop,
    step: StepFunction,
    *,
    polish: bool = False,
    candidates: int = CANDIDATES,
    seed: int = 0,
    on_progress: Progress | None = None,
) -> TuneResult:
    """Tune the gains and leave them in the loop; any exception restores gains and commands.

    `step`: makes one look of the loop. `polish`: improve the relays' gains by CMA-ES with `candidates`
    evaluations. Raise `TuneRefused` with the reason when the rig or the scene does not allow tuning.
    """
    settings, held, paused = loop.settings, set(loop.held), loop.paused
    before_rad = loop.command_rad
    progress = _Progress(on_progress, total=len(AXES) + 3 + (candidates if polish else 0))
    loop.held.clear()
    loop.paused = False
    loop.settings = replace(settings, correct_for_ms=None)
    try:
        found = _by_relays(loop, step, progress)
        if polish:
            found = _polished(loop, _SameTarget(step), found, candidates, seed, progress.advance)
        progress.end()
    except BaseException:
        loop.settings = settings
        set_commands(loop, AXES, before_rad)
        raise
    finally:
        loop.reference_rad[:] = 0.0
        loop.held, loop.paused = held, paused
        set_commands(loop, AXES if paused else held, before_rad)
    loop.settings = replace(found.settings, correct_for_ms=settings.correct_for_ms)
    return replace(found, settings=loop.settings)


def _by_relays(loop: VergenceLoop, step: StepFunction, progress: "_Progress") -> TuneResult:
    """Tune by relay feedback, with step responses before and after; leaves the gains in the loop."""
    settle(loop, step)
    step = _SameTarget(step)
    before = measure_steps(loop, step)
    progress.advance()
    settle(loop, step)
    relays = []
    for axis in AXES:
        relays.append(relay(loop, axis, step))
        progress.advance()
    loop.settings = _with_relays(loop.settings, relays)
    settle(loop, step)
    after = measure_steps(loop, step)
    progress.advance()
    return TuneResult(
        settings=loop.settings,
        relays=tuple(relays),
        cost_before=cost_of(before),
        cost_relay=cost_of(after),
        cost=cost_of(after),
        candidates=0,
        before=before,
        after=after,
    )


def _polished(
    loop: VergenceLoop,
    step: StepFunction,
    found: TuneResult,
    candidates: int,
    seed: int,
    on_candidate: Callable[[], None],
) -> TuneResult:
    """Return the CMA-ES result, or the relays' if a repeated step response does not confirm a lower cost."""
    loop.settings = search_gains(loop, step, found.settings, candidates, seed, on_candidate)
    settle(loop, step)
    after = measure_steps(loop, step)
    if cost_of(after) >= found.cost:
        return replace(found, candidates=candidates)
    return replace(found, settings=loop.settings, cost=cost_of(after), candidates=candidates, after=after)


class _Progress:
    """Reports the number of completed parts of a tuning."""

    def __init__(self, on_progress: Progress | None, *, total: int) -> None:
        self._on_progress = on_progress
        self._total = total
        self._done = 0

    def advance(self) -> None:
        """Count one part; the total is reported only by `end`, because CMA-ES may exceed its candidates."""
        self._done = min(self._done + 1, self._total - 1)
        if self._on_progress is not None:
            self._on_progress(self._done, self._total)

    def end(self) -> None:
        """Report that all parts are done."""
        if self._on_progress is not None:
            self._on_progress(self._total, self._total)


class _SameTarget:
    """Makes looks; raises `TuneRefused` after `MISSED_LOOKS` in a row at another distance than the first."""

    def __init__(self, step: StepFunction) -> None:
        self._step = step
        self._distance_m: float | None = None
        self._others = 0

    def __call__(self) -> LoopStep:
        done = self._step()
        point = None if done.errors is None else done.errors.point
        if point is None:
            return done
        if self._distance_m is None:
            self._distance_m = point.distance_m
        apart_m = abs(point.distance_m - self._distance_m)
        other = apart_m > max(OTHER_SHARE * self._distance_m, OTHER_SIGMAS * point.distance_sigma_m)
        self._others = self._others + 1 if other else 0
        if self._others >= MISSED_LOOKS:
            raise TuneRefused(
                f"the target was {self._distance_m:.2f} m away, and now {point.distance_m:.2f} m: something "
                "is in front of it, or a mirror does not turn; choose a target that stays in view, and check "
                "the mirrors"
            )
        return done


def _with_relays(settings: LoopSettings, relays: Sequence[RelayResult]) -> LoopSettings:
    """Return settings with the relays' gains; pan gets the smaller gain of its two axes."""
    by_axis = {one.axis: one.gains for one in relays}
    x, y = by_axis[Axis.PAN_X], by_axis[Axis.PAN_Y]
    pan = Gains(kp=min(x.kp, y.kp), ki=min(x.ki, y.ki), kd=min(x.kd, y.kd))
    return replace(settings, pan=pan, depth=by_axis[Axis.VERGE], vertical=by_axis[Axis.SHIFT_Y])
