"""Stereo on a real pair with ground truth: the Motorcycle of Middlebury 2014, from scikit-image."""

import numpy as np

from foveacam_bench.depth.dense import rectified_real
from foveacam_bench.depth.real_pairs import real_pairs
from foveacam_bench.depth.stereo import motorcycle, motorcycle_figures
from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, match_errors
from foveacam_pipeline.stereo.match import find_and_refine, match


def test_the_real_pair_is_matched_densely_and_well() -> None:
    found = motorcycle_figures()
    assert found["density"] >= 0.84
    assert found["epe_px"] <= 1.1
    assert found["bad1"] <= 0.09


def test_the_ground_truth_is_what_the_figures_are_about() -> None:
    pair, truth_px = motorcycle()
    known = np.isfinite(truth_px)
    assert pair.left.shape == (500, 741, 3)
    assert 0.9 < known.mean() < 0.95
    assert 7.0 < truth_px[known].min() < truth_px[known].max() < 60.0


def test_errors_and_wrong_matches_are_as_frequent_as_stated() -> None:
    real = next(real_pairs(None))
    pair, settings = rectified_real(real)
    found, refinement = find_and_refine(pair, settings)
    odds = match_errors(found, refinement, SEMI_GLOBAL).wrong_log_odds[::2, ::2]
    error = (refinement.residual_px - real.truth_px)[::2, ::2]
    judged = np.isfinite(error) & np.isfinite(found[::2, ::2]) & refinement.seen[::2, ::2]
    stated, wrong = 1.0 / (1.0 + np.exp(-odds[judged])), np.abs(error[judged]) > 1.0

    assert 0.8 <= stated.mean() / wrong.mean() <= 1.25
    for low, high in ((0.0, 0.1), (0.1, 0.3), (0.3, settings.max_wrong)):  # more is never answered
        these = (stated >= low) & (stated < high)
        assert abs(stated[these].mean() - wrong[these].mean()) <= 0.08

    answer = match(pair, settings)
    assert answer.wrong is not None
    known = np.isfinite(answer.residual_px) & np.isfinite(real.truth_px)
    beyond = np.abs(answer.residual_px - real.truth_px)[known] > 3.0 * answer.sigma_px[known]
    assert 0.6 <= beyond.mean() / answer.wrong[known].mean() <= 1.4  # the tail is what is told as wrong
    ratio = (np.abs(answer.residual_px - real.truth_px) / answer.sigma_px)[np.isfinite(real.truth_px)]
    ratio = ratio[np.isfinite(ratio)]
    assert 0.8 <= np.quantile(ratio, 0.683) <= 1.2
