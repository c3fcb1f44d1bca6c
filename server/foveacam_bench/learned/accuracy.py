"""Compares a stereo network with semi-global matching on pairs with truth, where both eyes see the surface.

Matching leaves pixels out, so there are three comparisons: matching with its holes filled against all pixels
of the network; matching as it is against as many pixels of the network, those with the least stated error;
and both with the pixels that they would show, each by its own rule.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.learn.truth_figures import (
    BAD_PX,
    MethodAnswer,
    TruthFigures,
    TruthSums,
    filled,
    truth_figures,
    truth_sums,
)
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Figures of the network, of matching, and of each with all pixels filled.

    `surest`: of the network's pixels with the least stated error, as many as matching has.
    """

    network: TruthFigures
    network_all: TruthFigures
    surest: TruthFigures
    sgbm: TruthFigures
    sgbm_filled: TruthFigures
    pairs: int


def measure_accuracy(
    estimator: NetworkEstimator, samples: Iterable[PairSample], *, settings: MatchSettings = DEFAULT
) -> Accuracy:
    """Return the figures over all pairs; raise ValueError where none has truth."""
    rows: dict[str, list[TruthSums]] = {}
    errors: list[NDArray[np.float32]] = []
    sigmas: list[NDArray[np.float32]] = []
    for sample in samples:
        truth = sample.truth
        if truth is None:
            continue
        answers = _answers(estimator, sample.pair, settings)
        for name, answer in answers.items():
            rows.setdefault(name, []).append(truth_sums(answer, truth, offset_px=sample.pair.offset_px))
        network = answers["network_all"]
        errors.append(np.abs(network.disparity_px - truth.disparity_px)[truth.both])
        sigmas.append(np.zeros(0, np.float32) if network.sigma_px is None else network.sigma_px[truth.both])
    found = {name: figures for name, sums in rows.items() if (figures := truth_figures(sums)) is not None}
    if not found:
        raise ValueError("accuracy needs pairs with truth")
    answered = sum(row.answered for row in rows["sgbm"])
    surest = _surest(np.concatenate(errors), np.concatenate(sigmas), answered)
    return Accuracy(**found, surest=surest, pairs=len(rows["sgbm"]))


def accuracy_figures(found: Accuracy) -> Figures:
    """Return the figures by name, ratios to matching first."""
    return {
        "foveal_epe_over_sgbm_equal_density": found.surest.epe_px / found.sgbm.epe_px,
        "foveal_bad1_over_sgbm_equal_density": found.surest.bad_1 / found.sgbm.bad_1,
        "foveal_epe_over_sgbm": found.network_all.epe_px / found.sgbm_filled.epe_px,
        "foveal_bad1_over_sgbm": found.network_all.bad_1 / found.sgbm_filled.bad_1,
        "foveal_within_1_sigma": found.network.within_1_sigma,
        "sgbm_within_1_sigma": found.sgbm.within_1_sigma,
        **_named("foveal", found.network),
        **_named("foveal_all", found.network_all),
        **_named("sgbm", found.sgbm),
        **_named("sgbm_filled", found.sgbm_filled),
        "pairs": found.pairs,
    }


def _answers(
    estimator: NetworkEstimator, pair: RectifiedPair, settings: MatchSettings
) -> dict[str, MethodAnswer]:
    disparity_px, sigma_px = estimator.answer(pair)
    kept, matched = estimator.estimate(pair), match(pair, settings)
    return {
        "network": MethodAnswer(disparity_px=kept.residual_px, sigma_px=kept.sigma_px),
        "network_all": MethodAnswer(disparity_px=disparity_px, sigma_px=sigma_px),
        "sgbm": MethodAnswer(disparity_px=matched.residual_px, sigma_px=matched.sigma_px),
        "sgbm_filled": MethodAnswer(disparity_px=filled(matched.residual_px)),
    }


def _surest(error_px: NDArray[np.float32], sigma_px: NDArray[np.float32], count: int) -> TruthFigures:
    """Return the figures of the `count` pixels with the least sigma; of all in order without sigmas."""
    order = np.argsort(sigma_px, kind="stable")[:count] if sigma_px.size else slice(None, count)
    off_px = error_px[order].astype(np.float64)
    return TruthFigures(
        epe_px=float(off_px.mean()),
        bad_1=float((off_px > BAD_PX).mean()),
        answered=count / max(1, error_px.size),
    )


def _named(name: str, found: TruthFigures) -> Figures:
    return {
        f"{name}_epe_px": found.epe_px,
        f"{name}_bad1": found.bad_1,
        f"{name}_density": found.answered,
    }
