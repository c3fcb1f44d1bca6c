"""Measure the depth of the steering field after looking around, and judge it by the simulation's truth.

The rig runs in virtual time with the shipped calibration.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_hardware.contract import Binning
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.attention.look_around import look_around
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.resources.studying.studies.judged_clicks import WRONG_SHARE, WRONG_SIGMA
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

SCENES = ("bench", "street")
FIELD_DEG = (8.0, 7.5)
"""Half width and half height of the steering field, about the rig's axis."""
JUDGED = 400
LATER_S = 10
SEED = 20_25


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedContext:
    """One survey compared with the truth.

    `coverage`: share of the steering field's cells with a depth. `rel_error`, `sigmas`: (n,), sampled cells.
    `later_wrong`: share of wrong cells among those with a depth `LATER_S` later; `lost`: share of cells that
    lost their depth in that time.
    """

    coverage: float
    rel_error: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    survey_s: float
    compute_s: float
    looks: int
    later_wrong: float
    lost: float


def run(*, quick: bool = False, binning: Binning = 1) -> Figures:
    """Return the figures of both scenes together, and each scene's; `binning`: of all cameras."""
    count = JUDGED // 4 if quick else JUDGED
    scenes = {scene: survey(scene, count, binning=binning) for scene in SCENES}
    every = list(scenes.values())
    rel = np.concatenate([one.rel_error for one in every])
    sigmas = np.concatenate([one.sigmas for one in every])
    return {
        "context_coverage": float(np.mean([one.coverage for one in every])),
        "context_rel_error_median": float(np.median(rel)),
        "context_within_3_sigma": float(np.mean(sigmas <= 3.0)),
        "context_within_1_sigma": float(np.mean(sigmas <= 1.0)),
        "context_wrong_fraction": float(np.mean(wrong(rel, sigmas))),
        "context_later_wrong_fraction": max(one.later_wrong for one in every),
        "context_survey_s": max(one.survey_s for one in every),
        "context_compute_s": max(one.compute_s for one in every),
    } | {f"context_{scene}": _scene_figures(one) for scene, one in scenes.items()}


def survey(scene: str, count: int, *, binning: Binning = 1) -> JudgedContext:
    """Look around in one scene and judge `count` cells of the resulting depth."""
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(scene=scene, inline=True) as rig:
        truth = truth_of(rig)
        bin_cameras(rig, binning)
        context = WideContext(calibration.wide, now_s=lambda: rig.clock.now_ns() / 1e9)
        began_s = time.perf_counter()
        looked = look_around(rig.head, calibration, context, clock=rig.clock)
        compute_s = time.perf_counter() - began_s
        _detect_changes(context, rig)
        rel, sigmas = _judge(context, truth, calibration, t_ns=rig.clock.now_ns(), count=count)
        coverage, known = _coverage(context, calibration), len(context.samples())
        for _ in range(LATER_S):
            rig.clock.sleep_until_ns(rig.clock.now_ns() + 1_000_000_000)
            _detect_changes(context, rig)
        later = _judge(context, truth, calibration, t_ns=rig.clock.now_ns(), count=count)
        return JudgedContext(
            coverage=coverage,
            rel_error=rel,
            sigmas=sigmas,
            survey_s=looked.duration_s,
            compute_s=compute_s,
            looks=looked.looks,
            later_wrong=float(np.mean(wrong(*later))),
            lost=1.0 - len(context.samples()) / max(1, known),
        )


def wrong(rel_error: NDArray[np.float64], sigmas: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which depths have errors above both 3 % and 5 standard errors."""
    return np.asarray((rel_error > WRONG_SHARE) & (sigmas > WRONG_SIGMA), dtype=np.bool_)


def _detect_changes(context: WideContext, rig: Rig) -> None:
    context.detect_changes(gray(to_uint8(rig.wide.latest(max_age_ms=500.0))))


def _scene_figures(judged: JudgedContext) -> dict[str, float]:
    return {
        "coverage": judged.coverage,
        "rel_error_median": float(np.median(judged.rel_error)),
        "rel_error_p95": float(np.quantile(judged.rel_error, 0.95)),
        "wrong_fraction": float(np.mean(wrong(judged.rel_error, judged.sigmas))),
        "later_wrong_fraction": judged.later_wrong,
        "lost_fraction": judged.lost,
        "within_1_sigma": float(np.mean(judged.sigmas <= 1.0)),
        "within_3_sigma": float(np.mean(judged.sigmas <= 3.0)),
        "survey_s": judged.survey_s,
        "compute_s": judged.compute_s,
        "looks": float(judged.looks),
    }


def _judge(
    context: WideContext, truth: Truth, calibration: Calibration, *, t_ns: int, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return relative errors of depth, and errors over standard errors, of random nearest surfaces."""
    known = context.snapshot()
    row, column = np.nonzero(known.known[0])
    chosen = np.random.default_rng(SEED).choice(len(row), size=min(count, len(row)), replace=False)
    at = (0, row[chosen], column[chosen])
    pixels = calibration.wide.pixels(np.arctan(known.tangents[at]))
    rel, sigmas = [], []
    for pixel, q, sigma in zip(
        pixels.tolist(), known.inverse_z_per_m[at], known.sigma_per_m[at], strict=True
    ):
        seen = truth.depth_at(pixel[0], pixel[1], t_ns)
        true_q = 0.0 if seen is None else 1.0 / seen.point_rig_m[2]
        rel.append(abs(q - true_q) / q)
        sigmas.append(abs(q - true_q) / sigma)
    return np.array(rel), np.array(sigmas)


def _coverage(context: WideContext, calibration: Calibration) -> float:
    """Return the share of the steering field's cells that have a depth."""
    half_px = context.cell_px / 2.0
    x, y = np.meshgrid(np.arange(context.columns), np.arange(context.rows))
    middles = np.column_stack([x.ravel(), y.ravel()]) * context.cell_px + half_px - 0.5
    tangents = tan_from_angles(calibration.wide.angles_rad(middles))
    limits = np.tan(np.radians(FIELD_DEG))
    inside = np.all(np.abs(tangents) <= limits, axis=1)
    known = context.snapshot().known.any(axis=0).ravel()
    return float(np.count_nonzero(known & inside) / np.count_nonzero(inside))
