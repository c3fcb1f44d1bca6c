"""Steps of one degree, axis by axis, with the default gains and with gains that were tuned on the rig."""

import math
from dataclasses import dataclass
from statistics import median

from foveacam_bench.loop.charged_loop import ChargedLoop
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.continuous_loop.autotune import TuneResult, autotune
from foveacam_pipeline.continuous_loop.settings import AXES, Axis, LoopSettings
from foveacam_pipeline.continuous_loop.step_experiment import measure_steps, settle
from foveacam_pipeline.continuous_loop.step_response import StepResponse

POSTER_PX = (850.0, 400.0)
"""On the poster of the scene `bench`, 8 m away: texture on all sides, and both eyes can turn a degree on."""
POSTER_PER_M = 0.125
STEP_RAD = math.radians(1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class TunedRig:
    """Step responses of every axis before and after tuning; `polished`: the result of CMA-ES from there."""

    default: dict[Axis, StepResponse]
    tuned: dict[Axis, StepResponse]
    result: TuneResult
    polished: TuneResult | None
    compute_ms: float


def tune_rig(preset: str, *, candidates: int, looks: int, binning: Binning) -> TunedRig:
    """Tune a simulated rig; `candidates` of the polish, 0 for none; `looks` after each step."""
    with open_simulated(scene="bench", preset=preset, inline=True) as rig:
        charged = ChargedLoop(rig, preset=preset, settings=LoopSettings(tracker=None), binning=binning)
        charged.choose(POSTER_PX, inverse_z_per_m=POSTER_PER_M)
        settle(charged.loop, charged.step)
        default = _steps(charged, looks)
        result = autotune(charged.loop, charged.step)
        settle(charged.loop, charged.step)
        tuned = _steps(charged, looks)
        polished = None
        if candidates:
            polished = autotune(charged.loop, charged.step, polish=True, candidates=candidates)
    return TunedRig(
        default=default,
        tuned=tuned,
        result=result,
        polished=polished,
        compute_ms=median(charged.compute_ms),
    )


def settle_ms(response: StepResponse) -> float:
    """Return the time in which a step settles."""
    if response.settle_s is None:
        return 2e3 * float(response.t_s[-1])
    return 1e3 * response.settle_s


def _steps(charged: ChargedLoop, looks: int) -> dict[Axis, StepResponse]:
    rest_rad = charged.loop.command_rad
    responses: dict[Axis, StepResponse] = {}
    for axis in AXES:
        responses |= measure_steps(charged.loop, charged.step, step_rad=STEP_RAD, looks=looks, axes=(axis,))
        charged.rest_at(rest_rad)
    return responses
