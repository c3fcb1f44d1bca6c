"""Tunes all gains on the rig: a relay for each axis, then, where asked for, CMA-ES on the cost of steps.

CMA-ES is that of the package `cma`, by its author; nine gains and a noisy cost are what it is made for.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.loop.relay import MISSED_LOOKS, RelayResult, TuneRefused, relay, seen
from foveacam_pipeline.loop.settings import AXES, MOST_GAIN, Axis, GainGroup, Gains, LoopSettings
from foveacam_pipeline.loop.step_response import StepResponse, step_response
from foveacam_pipeline.loop.vergence_loop import LoopStep, VergenceLoop

STEP_RAD = math.radians(0.3)
WINDOW_LOOKS = 10
SETTLE_LOOKS = 30
"""Looks at most until the loop is at rest before the first step."""
REST_RAD = math.radians(0.02)
CANDIDATES = 48
LEAST_GAIN = 1e-4
"""A gain of 0 is searched from here."""
LOST_COST = 10.0
"""Cost of gains that lose the target."""
SIGMA_DECADES = 1.0 / 3.0
OTHER_SHARE, OTHER_SIGMAS = 0.05, 5.0
"""Another thing than the target is seen where its distance differs by both."""
STEPPED = (Axis.PAN_X, Axis.VERGE, Axis.SHIFT_Y)
"""Axes that are stepped: one of each loop."""

StepFunction = Callable[[], LoopStep]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneResult:
    """Gains that were found; the relay of each axis; cost of a step before, by the relays, and at the end."""

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
    """Find gains and leave them in the loop; whatever raises leaves gains and commands as they were.

    `step`: makes one look of the loop. `polish`: look for better gains than the relays' by CMA-ES with so
    many candidates. Raise `TuneRefused` with the reason where the rig or the scene does not allow it.
    """
    settings = loop.settings
    before_held, before_paused = set(loop.held), loop.paused
    before_rad = loop.command_rad
    total = len(AXES) + 3 + (candidates if polish else 0)
    told = on_progress or (lambda done, of: None)
    loop.held.clear()
    loop.paused = False
    loop.settings = always = replace(settings, correct_for_ms=None)
    try:
        settle(loop, step)
        step = _SameTarget(step)
        before = measure_steps(loop, step)
        told(1, total)
        settle(loop, step)
        relays = []
        for axis in AXES:
            relays.append(relay(loop, axis, step))
            told(1 + len(relays), total)
        tuned = _with_relays(always, relays)
        loop.settings = tuned
        settle(loop, step)
        after = best = measure_steps(loop, step)
        told(2 + len(AXES), total)
        if polish:
            found = _polished(
                loop, step, tuned, candidates, seed, lambda done: told(len(AXES) + 2 + done, total)
            )
            loop.settings = found
            settle(loop, step)
            best = measure_steps(loop, step)
            if cost_of(best) >= cost_of(after):  # a lucky measurement, not a better set
                found, best = tuned, after
            tuned = found
        told(total, total)
    except BaseException:
        loop.settings = settings
        _set_commands(loop, AXES, before_rad)
        raise
    finally:
        loop.reference_rad[:] = 0.0
        loop.held, loop.paused = before_held, before_paused
        _set_commands(loop, AXES if before_paused else before_held, before_rad)
    loop.settings = tuned = replace(tuned, correct_for_ms=settings.correct_for_ms)
    return TuneResult(
        settings=tuned,
        relays=tuple(relays),
        cost_before=cost_of(before),
        cost_relay=cost_of(after),
        cost=cost_of(best),
        candidates=candidates if polish else 0,
        before=before,
        after=best,
    )


def _set_commands(loop: VergenceLoop, axes: Iterable[Axis], commands_rad: NDArray[np.float64]) -> None:
    for axis in axes:
        loop.set_command(axis, float(commands_rad[AXES.index(axis)]))


def cost_of(responses: dict[Axis, StepResponse]) -> float:
    """Return the mean cost of the steps."""
    return float(np.mean([response.cost for response in responses.values()]))


def measure_steps(
    loop: VergenceLoop,
    step: StepFunction,
    *,
    step_rad: float = STEP_RAD,
    looks: int = WINDOW_LOOKS,
    axes: Sequence[Axis] = STEPPED,
) -> dict[Axis, StepResponse]:
    """Step the references of some axes at once, to the other side than last time, and return the answers."""
    indices = [AXES.index(axis) for axis in axes]
    sign = -1.0 if loop.reference_rad[indices[0]] > 0.0 else 1.0
    loop.reference_rad[indices] += sign * step_rad
    times_ns: list[int] = []
    missing: list[NDArray[np.float64]] = []
    misses = 0
    while len(times_ns) < looks:
        done = step()
        misses = seen(done, misses)
        if done.errors is None:
            continue
        times_ns.append(done.t_ns)
        missing.append((done.errors.values_rad + loop.reference_rad) / (sign * step_rad))
    return {
        axis: step_response(times_ns, [1.0 - float(look[index]) for look in missing])
        for axis, index in zip(axes, indices, strict=True)
    }


class _SameTarget:
    """Makes looks; raises `TuneRefused` where some in a row show another distance than the first."""

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
                "is in front of it, or a mirror does not turn; choose a target that nobody walks past, and "
                "check the mirrors"
            )
        return done


def settle(loop: VergenceLoop, step: StepFunction) -> None:
    """Look without a step until the loop is at rest; raise `TuneRefused` where it does not come to rest."""
    loop.reference_rad[:] = 0.0
    misses = 0
    for _ in range(SETTLE_LOOKS):
        done = step()
        misses = seen(done, misses)
        if done.errors is not None and float(np.abs(done.errors.values_rad).max()) < REST_RAD:
            return
    raise TuneRefused(
        f"the loop does not come to rest within {SETTLE_LOOKS} looks; lower its gains, or choose a target "
        "that stands still"
    )


def _with_relays(settings: LoopSettings, relays: Sequence[RelayResult]) -> LoopSettings:
    """Return settings with the relays' gains; of both pan axes the smaller gain counts."""
    by_axis = {one.axis: one.gains for one in relays}
    x, y = by_axis[Axis.PAN_X], by_axis[Axis.PAN_Y]
    pan = Gains(kp=min(x.kp, y.kp), ki=min(x.ki, y.ki), kd=min(x.kd, y.kd))
    return replace(settings, pan=pan, depth=by_axis[Axis.VERGE], vertical=by_axis[Axis.SHIFT_Y])


def _polished(
    loop: VergenceLoop,
    step: StepFunction,
    seed_settings: LoopSettings,
    candidates: int,
    seed: int,
    on_candidate: Callable[[int], None],
) -> LoopSettings:
    """Return the best of so many gains within a decade of the relays'."""
    start = _logs(seed_settings)
    options = {
        "bounds": [(start - 1.0).tolist(), np.minimum(start + 1.0, math.log10(MOST_GAIN)).tolist()],
        "seed": seed + 1,
        "verbose": -9,
    }
    import cma  # loads for a second

    settle(loop, step)
    at_rest = loop.command_rad
    search = cma.CMAEvolutionStrategy(start, SIGMA_DECADES, options)
    best, best_cost, tried = seed_settings, cost_of(measure_steps(loop, step)), 0
    while tried < candidates:
        points = search.ask()
        costs = []
        for point in points:
            loop.settings = _of_logs(seed_settings, point)
            costs.append(_tried(loop, step, seed_settings, at_rest))
            tried += 1
            on_candidate(min(tried, candidates))
            if costs[-1] < best_cost:
                best, best_cost = _of_logs(seed_settings, point), costs[-1]
        search.tell(points, costs)
    return best


def _tried(loop: VergenceLoop, step: StepFunction, safe: LoopSettings, at_rest: NDArray[np.float64]) -> float:
    """Return the cost of the loop's gains.

    Where they lose the target, the loop comes to rest with `safe` gains from the commands `at_rest` first;
    raise `TuneRefused` where it does not.
    """
    try:
        return cost_of(measure_steps(loop, step))
    except TuneRefused:
        loop.settings = safe
        _set_commands(loop, AXES, at_rest)
        settle(loop, step)
        return LOST_COST


def _logs(settings: LoopSettings) -> NDArray[np.float64]:
    """Return the decimal logarithms of all gains, (9,)."""
    all_gains = [settings.gains(group) for group in GainGroup]
    values = [value for gains in all_gains for value in (gains.kp, gains.ki, gains.kd)]
    return np.asarray(np.log10(np.maximum(LEAST_GAIN, values)))


def _of_logs(settings: LoopSettings, logs: NDArray[np.float64]) -> LoopSettings:
    values = np.minimum(10.0**logs, MOST_GAIN).reshape(3, 3)  # the logarithm of the bound may round up
    gains = [Gains(kp=kp, ki=ki, kd=kd) for kp, ki, kd in values.tolist()]
    return replace(settings, pan=gains[0], depth=gains[1], vertical=gains[2])
