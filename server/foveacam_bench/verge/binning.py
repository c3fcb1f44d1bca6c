"""Compare clicks at binning 2 with the same clicks at binning 1 (`foveacam bench binning`).

Textured clicks of both scenes are fixated on the simulated rig in virtual time, each at both binnings one
right after the other, with the shipped calibration; the simulation's truth judges them.
"""

import math
from collections.abc import Iterator
from itertools import islice
from statistics import median

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_bench.judging import rms
from foveacam_bench.verge.fixations import CERTIFICATE, SCENES
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.verge.values import Basis
from foveacam_server.resources.studying.studies.click_truth import ClickKind, classify_click, truth_of
from foveacam_server.resources.studying.studies.judged_clicks import (
    BORDER_PX,
    FARTHEST_M,
    NEAREST_M,
    SEED,
    ClickResult,
    judge_click,
)
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CLICKS, QUICK_CLICKS = 40, 6
"""Clicks on each scene."""
BINNINGS: tuple[Binning, Binning] = (1, 2)

Pair = tuple[ClickResult, ClickResult]
"""One click at binning 1 and at binning 2."""


def run(*, quick: bool = False) -> Figures:
    """Click at both binnings and compare."""
    count = QUICK_CLICKS if quick else CLICKS
    return binning_figures([pair for scene in SCENES for pair in pairs(scene, count)])


def pairs(scene: str, count: int) -> list[Pair]:
    """Return so many textured clicks of a scene at both binnings."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng([SEED, 2, *scene.encode()])
    size = np.array([calibration.wide.width, calibration.wide.height])
    with open_simulated(scene=scene, inline=True) as rig:
        truth = truth_of(rig)

        def judged(binning: Binning, pixel: tuple[float, float]) -> ClickResult | None:
            bin_cameras(rig, binning)
            now_ns = rig.clock.now_ns()
            click = classify_click(truth, calibration, scene=scene, pixel=pixel, t_ns=now_ns)
            if click is None or click.kind is not ClickKind.TEXTURED:
                return None
            return judge_click(rig, calibration, click) if NEAREST_M <= click.range_m <= FARTHEST_M else None

        def candidates() -> Iterator[Pair]:
            while True:
                x_px, y_px = rng.uniform(BORDER_PX, size - BORDER_PX).tolist()
                full, binned = (judged(binning, (x_px, y_px)) for binning in BINNINGS)
                if full is not None and binned is not None:
                    yield full, binned

        return list(islice(candidates(), count))


def binning_figures(found: list[Pair]) -> Figures:
    """Return the figures of clicks at both binnings."""
    figures: Figures = {"clicks": len(found)}
    for name, results in zip(("full", "binned"), zip(*found, strict=True), strict=True):
        verged = [result for result in results if result.verged]
        figures |= {
            f"{name}_verged_fraction": len(verged) / len(found),
            f"{name}_wrong": sum(result.wrong for result in results),
            f"{name}_within_3_sigma_fraction": float(
                np.mean([abs(result.sigmas) <= 3.0 for result in verged])
            ),
            f"{name}_sigmas_rms": rms(np.array([result.sigmas for result in verged if not result.wrong])),
            f"{name}_compute_ms_per_step": median(
                step.compute_ms for result in results for step in result.fixation.steps
            ),
        }
    errors = {basis: _errors(found, basis) for basis in (Basis.BOTH_FOVEAE, Basis.FOVEA_AND_WIDE, None)}
    for basis, (full, binned) in errors.items():
        name = "binned_over_full_error" if basis is None else f"{basis.value}_binned_over_full_error"
        figures[name] = rms(binned) / rms(full) if len(full) else math.nan
        figures[f"{basis.value if basis else 'all'}_compared"] = len(full)
    return figures


def _errors(found: list[Pair], basis: Basis | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the relative errors of distances known alike at both binnings, by one basis or by any."""
    kept = [
        pair
        for pair in found
        if all(result.fixation.distance_m is not None and abs(result.sigmas) <= 5.0 for result in pair)
        and pair[0].fixation.basis is pair[1].fixation.basis
        and (basis is None or pair[0].fixation.basis is basis)
    ]
    relative = np.array([[result.error_m / result.click.range_m for result in pair] for pair in kept])
    relative = relative.reshape(-1, 2)
    return relative[:, 0], relative[:, 1]
