"""Measure fixations of seeded clicks on both simulated scenes, in virtual time (`foveacam bench verge`).

The verge loop has the data of a real rig and the shipped calibration; the simulation's truth judges it.
Fractions are of textured clicks, as defined in `ClickKind`.
"""

import math
from collections import Counter
from collections.abc import Iterator
from statistics import median

import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.verge.knock import knock_figures
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import ClickKind
from foveacam_server.resources.studying.studies.judged_clicks import SEED, ClickResult, judged_clicks
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CERTIFICATE = SHIPPED / "sim-rig120.json"
SCENES = ("bench", "street")
QUOTA = {ClickKind.TEXTURED: 75, ClickKind.PLAIN: 15, ClickKind.AWKWARD: 10}
QUICK_QUOTA = {ClickKind.TEXTURED: 3, ClickKind.PLAIN: 1, ClickKind.AWKWARD: 1}


def run(*, quick: bool = False, binning: Binning = 1) -> Figures:
    """Click, judge, and return the figures; `failures` lists the failed clicks."""
    quota = QUICK_QUOTA if quick else QUOTA
    results = [result for scene in SCENES for result in fixations(scene, quota, binning=binning)]
    return click_figures(results) | knock_figures(load_calibration(CERTIFICATE), SCENES, quick=quick)


def fixations(
    scene: str, quota: dict[ClickKind, int], *, seed: int = SEED, binning: Binning = 1
) -> Iterator[ClickResult]:
    """Yield the judged clicks on a simulated scene."""
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(scene=scene, inline=True) as rig:
        bin_cameras(rig, binning)
        yield from judged_clicks(rig, calibration, scene=scene, quota=quota, seed=seed)


def click_figures(results: list[ClickResult]) -> Figures:
    """Return the figures of a list of results."""
    textured = [r for r in results if r.click.kind is ClickKind.TEXTURED]
    verged = [r for r in textured if r.verged]
    good = [r for r in verged if not r.wrong]
    residuals = [r.residual_px for r in verged]
    own = [r.fixation.residual_px for r in verged if r.fixation.residual_px is not None]
    steps_ms = [step.compute_ms for r in results for step in r.fixation.steps]
    return {
        "clicks": len(results),
        "textured_clicks": len(textured),
        "verged_fraction": len(verged) / max(1, len(textured)),
        "false_verged": sum(r.wrong for r in results if r.click.kind is ClickKind.PLAIN),
        "false_verged_textured": sum(r.wrong for r in textured),
        "false_verged_awkward": sum(r.wrong for r in results if r.click.kind is ClickKind.AWKWARD),
        "knock_claimed": sum(r.fixation.target_offset is not None for r in results),
        "residual_median_px": median(residuals),
        "residual_p95_px": float(np.quantile(residuals, 0.95)),
        "own_residual_median_px": median(own),
        "steps_median": median(len(r.fixation.steps) for r in verged),
        "within_3_sigma_fraction": sum(abs(r.sigmas) <= 3.0 for r in verged) / max(1, len(verged)),
        "sigmas_rms": float(np.sqrt(np.mean([r.sigmas**2 for r in good]))),
        "compute_ms_per_step": median(steps_ms),
        "compute_p95_ms_per_step": float(np.quantile(steps_ms, 0.95)),
        "distance_rel_error_median": median(abs(r.error_m) / r.click.range_m for r in verged),
        "duration_median_ms": median(r.fixation.duration_ms for r in verged),
        **{f"{kind}_states": _states(results, kind) for kind in ClickKind},
        "failures": [_click_record(r) for r in results if _failed(r)],
    }


def _states(results: list[ClickResult], kind: ClickKind) -> dict[str, int]:
    return dict(Counter(r.fixation.state.value for r in results if r.click.kind is kind))


def _failed(result: ClickResult) -> bool:
    if result.click.kind is ClickKind.TEXTURED:
        return not result.verged or abs(result.sigmas) > 3.0 or result.residual_px > 1.0
    return result.wrong


def _click_record(result: ClickResult) -> Figures:
    """Return the details of one click, for diagnosis."""
    click, fixation = result.click, result.fixation
    return {
        "scene": click.scene,
        "kind": click.kind.value,
        "name": click.name,
        "x_px": round(click.x_px, 1),
        "y_px": round(click.y_px, 1),
        "t_ns": click.t_ns,
        "range_m": round(click.range_m, 4),
        "state": fixation.state.value,
        "reason": fixation.reason,
        "distance_m": fixation.distance_m,
        "distance_sigma_m": fixation.distance_sigma_m,
        "residual_px": None if math.isnan(result.residual_px) else round(result.residual_px, 3),
        "steps": [
            [s.phase.value, s.residual_x_px, s.residual_y_px, round(s.score, 3), round(s.compute_ms)]
            for s in fixation.steps
        ],
    }
