"""Measure the vergence loop as an instrument, in virtual time (`foveacam bench loop`)."""

from foveacam_bench.figures import Figures, Report
from foveacam_bench.loop.refused_tuning import tune_with_dead_axis, tune_with_passer_by
from foveacam_bench.loop.tuned_steps import TunedRig, settle_ms, tune_rig
from foveacam_bench.loop.walker_lag import lag_mrad
from foveacam_bench.track.following import COMPUTE_S
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.presets import PRESETS
from foveacam_pipeline.continuous_loop.settings import AXES

POLISHED = "rig120"
CANDIDATES, QUICK_CANDIDATES = 40, 0
"""Of the polish; without any its figure is null."""
LOOKS, QUICK_LOOKS = 24, 12
"""Looks after a step; one that has not settled by then counts twice as long."""
SECONDS, QUICK_SECONDS = 6.0, 2.0
"""Half a circle of the walker."""


def run(*, quick: bool = False, binning: Binning = 1, report: Report = lambda progress: None) -> Figures:
    """Tune, step and polish; track a walker; try to tune where that must be refused."""
    candidates, looks = (QUICK_CANDIDATES, QUICK_LOOKS) if quick else (CANDIDATES, LOOKS)
    rigs: dict[str, TunedRig] = {}
    for preset in (POLISHED,) if quick else PRESETS:
        report(f"tuning {preset}")
        tried = candidates * (preset == POLISHED)
        rigs[preset] = tune_rig(preset, candidates=tried, looks=looks, binning=binning)
    report("tracking a walker")
    lag = _lag(QUICK_SECONDS if quick else SECONDS, binning)
    report("refusals")
    return _tuning(rigs) | lag | _refusals(binning)


def _tuning(rigs: dict[str, TunedRig]) -> Figures:
    ratios = {
        f"{preset} {axis}": settle_ms(rig.tuned[axis]) / settle_ms(rig.default[axis])
        for preset, rig in rigs.items()
        for axis in AXES
    }
    tuned = [response for rig in rigs.values() for response in rig.tuned.values()]
    polished = rigs[POLISHED].polished
    return {
        "settle_ratio": max(ratios.values()),
        "settle_ratio_worst": max(ratios, key=lambda name: ratios[name]),
        "settle_default_ms": max(settle_ms(one) for rig in rigs.values() for one in rig.default.values()),
        "settle_tuned_ms": max(map(settle_ms, tuned)),
        "overshoot": max(response.overshoot for response in tuned),
        "relay_cost_ratio": max(rig.result.cost_relay / rig.result.cost_before for rig in rigs.values()),
        "polish_cost_ratio": None if polished is None else polished.cost / polished.cost_relay,
        "compute_ms_per_step": max(rig.compute_ms for rig in rigs.values()),
        "compute_charged_s": COMPUTE_S,
    }


def _lag(seconds: float, binning: Binning) -> Figures:
    (off_mrad, on_mrad), (corrected_off, corrected_on) = (
        [lag_mrad(predict=on, pan_held=held, seconds=seconds, binning=binning) for on in (False, True)]
        for held in (True, False)
    )
    return {
        "lag_ratio": off_mrad / on_mrad,
        "lag_off_mrad": off_mrad,
        "lag_on_mrad": on_mrad,
        "lag_corrected_off_mrad": corrected_off,
        "lag_corrected_on_mrad": corrected_on,
    }


def _refusals(binning: Binning) -> Figures:
    dead, passed = tune_with_dead_axis("left x", binning=binning), tune_with_passer_by(binning=binning)
    return {
        "dead_axis_refused": dead.reason is not None,
        "dead_axis_reason": dead.reason,
        "passer_by_refused": passed.reason is not None,
        "passer_by_reason": passed.reason,
        "gains_restored": dead.restored and passed.restored,
    }
