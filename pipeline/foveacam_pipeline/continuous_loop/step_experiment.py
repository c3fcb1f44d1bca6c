"""Step-response experiment: steps the references of a running loop and records the response."""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.continuous_loop.relay import TuneRefused, seen
from foveacam_pipeline.continuous_loop.settings import AXES, Axis
from foveacam_pipeline.continuous_loop.step_response import StepResponse, step_response
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop

STEP_RAD = math.radians(0.3)
WINDOW_LOOKS = 10
SETTLE_LOOKS = 30
"""Largest number of looks for the loop to settle before the first step."""
REST_RAD = math.radians(0.02)
STEPPED = (Axis.PAN_X, Axis.VERGE, Axis.SHIFT_Y)
"""Default axes of the experiment: one of each loop."""

StepFunction = Callable[[], LoopStep]
"""Makes one look of the loop."""


def set_commands(loop: VergenceLoop, axes: Iterable[Axis], commands_rad: NDArray[np.float64]) -> None:
    """Set the commands of the given axes to their entries of (4,) `commands_rad`."""
    for axis in axes:
        loop.set_command(axis, float(commands_rad[AXES.index(axis)]))


def measure_steps(
    loop: VergenceLoop,
    step: StepFunction,
    *,
    step_rad: float = STEP_RAD,
    looks: int = WINDOW_LOOKS,
    axes: Sequence[Axis] = STEPPED,
) -> dict[Axis, StepResponse]:
    """Step the references of the given axes together, alternating the sign, and return the responses."""
    indices = [AXES.index(axis) for axis in axes]
    sign = -1.0 if loop.reference_rad[indices[0]] > 0.0 else 1.0
    loop.reference_rad[indices] += sign * step_rad
    times_ns: list[int] = []
    missing: list[NDArray[np.float64]] = []
    misses = 0
    while len(times_ns) < looks:
        done = step()
        misses = seen(done, misses)
        if misses or done.errors is None:
            continue
        times_ns.append(done.t_ns)
        missing.append((done.errors.values_rad + loop.reference_rad) / (sign * step_rad))
    return {
        axis: step_response(times_ns, [1.0 - float(look[index]) for look in missing])
        for axis, index in zip(axes, indices, strict=True)
    }


def cost_of(responses: dict[Axis, StepResponse]) -> float:
    """Return the mean cost of the steps."""
    return float(np.mean([response.cost for response in responses.values()]))


def settle(loop: VergenceLoop, step: StepFunction) -> None:
    """Reset the references and look until the errors are below `REST_RAD`; raise `TuneRefused` otherwise."""
    loop.reference_rad[:] = 0.0
    misses = 0
    for _ in range(SETTLE_LOOKS):
        done = step()
        misses = seen(done, misses)
        if not misses and done.errors is not None and float(np.abs(done.errors.values_rad).max()) < REST_RAD:
            return
    raise TuneRefused(
        f"the loop does not settle within {SETTLE_LOOKS} looks; lower its gains, or choose a target "
        "that stands still"
    )
