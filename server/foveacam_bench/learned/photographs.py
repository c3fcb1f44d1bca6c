"""Real photographs with truth; the right view is shifted, so that disparities have both signs.

The network was trained on simulated pairs alone; nothing is fitted to these.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from foveacam_bench.depth.dense import rectified_real
from foveacam_bench.depth.real_pairs import RealPair, real_pairs
from foveacam_bench.figures import Figures
from foveacam_bench.learned.accuracy import Accuracy, measure_accuracy
from foveacam_pipeline.learn.pair_folder import PairSample, PairTruth
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.stereo.search import MatchSettings


def photograph_figures(estimator: NetworkEstimator, data: Path | None) -> Figures:
    """Return end-point errors and shares above 1 px of each pair; `data`: folder of aloe/ and tsukuba/."""
    figures: Figures = {}
    for name, sample, settings in signed_photographs(data):
        found = measure_accuracy(estimator, [sample], settings=settings)
        figures |= {f"{name}_{key}": value for key, value in _figures(found).items()}
    return figures


def signed_photographs(data: Path | None) -> Iterator[tuple[str, PairSample, MatchSettings]]:
    """Yield each pair with its name and settings that search the range of its truth."""
    for real in real_pairs(data):
        yield (real.name, *_signed(real))


def _signed(real: RealPair) -> tuple[PairSample, MatchSettings]:
    known = np.isfinite(real.truth_px)
    shift_px = round(float(np.median(real.truth_px[known])))
    right = np.empty_like(real.right)
    right[:, shift_px:] = real.right[:, :-shift_px]
    right[:, :shift_px] = real.right[:, :1]
    truth_px = np.where(known, real.truth_px - np.float32(shift_px), np.float32(np.nan)).astype(np.float32)
    pair, settings = rectified_real(replace(real, right=right, truth_px=truth_px))
    pair.valid_right[:, :shift_px] = False
    truth = PairTruth(disparity_px=truth_px, both=known, occluded=np.zeros_like(known))
    return PairSample(pair=pair, truth=truth), settings


def _figures(found: Accuracy) -> Figures:
    return {
        "foveal_epe_px": found.network_all.epe_px,
        "sgbm_filled_epe_px": found.sgbm_filled.epe_px,
        "foveal_bad1": found.network_all.bad_1,
        "sgbm_filled_bad1": found.sgbm_filled.bad_1,
        "foveal_equal_density_epe_px": found.surest.epe_px,
        "sgbm_epe_px": found.sgbm.epe_px,
        "foveal_equal_density_bad1": found.surest.bad_1,
        "sgbm_bad1": found.sgbm.bad_1,
        "density": found.sgbm.answered,
        "foveal_within_1_sigma": found.network.within_1_sigma,
    }
