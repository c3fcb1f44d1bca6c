"""Stereo on a real pair with ground truth: the Motorcycle of Middlebury 2014, from scikit-image."""

import numpy as np

from foveacam_bench.depth.stereo import motorcycle, motorcycle_figures


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
