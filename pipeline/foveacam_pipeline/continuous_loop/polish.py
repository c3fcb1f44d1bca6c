"""Refines the gains of a running loop by CMA-ES on the step-response cost.

CMA-ES suits nine gains and a noisy cost; it is that of the package `cma`, by its author.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.continuous_loop.relay import TuneRefused
from foveacam_pipeline.continuous_loop.settings import AXES, MOST_GAIN, GainGroup, Gains, LoopSettings
from foveacam_pipeline.continuous_loop.step_experiment import (
    StepFunction,
    cost_of,
    measure_steps,
    set_commands,
    settle,
)
from foveacam_pipeline.continuous_loop.vergence_loop import VergenceLoop

LEAST_GAIN = 1e-4
"""Start of the search for a gain of 0, which has no logarithm."""
LOST_COST = 10.0
"""Cost assigned to gains with which the loop loses the target."""
SIGMA_DECADES = 1.0 / 3.0


def search_gains(
    loop: VergenceLoop,
    step: StepFunction,
    seed_settings: LoopSettings,
    candidates: int,
    seed: int,
    on_candidate: Callable[[], None],
) -> LoopSettings:
    """Return the best of `candidates` settings within a decade of the seed; leaves the last in the loop."""
    start = _logs(seed_settings)
    options = {
        "bounds": [(start - 1.0).tolist(), np.minimum(start + 1.0, math.log10(MOST_GAIN)).tolist()],
        "seed": seed + 1,
        "verbose": -9,
    }
    import cma  # here, because the import takes a second

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
            on_candidate()
            if costs[-1] < best_cost:
                best, best_cost = _of_logs(seed_settings, point), costs[-1]
        search.tell(points, costs)
    return best


def _tried(loop: VergenceLoop, step: StepFunction, safe: LoopSettings, at_rest: NDArray[np.float64]) -> float:
    """Return the cost of the loop's gains, or `LOST_COST` if they lose the target.

    In that case let the loop settle with the `safe` gains from the commands `at_rest`; raise `TuneRefused`
    if it does not settle.
    """
    try:
        return cost_of(measure_steps(loop, step))
    except TuneRefused:
        loop.settings = safe
        set_commands(loop, AXES, at_rest)
        settle(loop, step)
        return LOST_COST


def _logs(settings: LoopSettings) -> NDArray[np.float64]:
    """Return the decimal logarithms of all gains, (9,)."""
    all_gains = [settings.gains(group) for group in GainGroup]
    values = [value for gains in all_gains for value in (gains.kp, gains.ki, gains.kd)]
    return np.asarray(np.log10(np.maximum(LEAST_GAIN, values)))


def _of_logs(settings: LoopSettings, logs: NDArray[np.float64]) -> LoopSettings:
    values = np.minimum(10.0**logs, MOST_GAIN).reshape(3, 3)  # 10 ** log10(bound) may round up
    gains = [Gains(kp=kp, ki=ki, kd=kd) for kp, ki, kd in values.tolist()]
    return replace(settings, pan=gains[0], depth=gains[1], vertical=gains[2])
