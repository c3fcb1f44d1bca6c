"""The shift adapter: negative disparities become positive ones, and come back."""

import numpy as np
import torch
from tests.support.scenes.learning_pairs import scene, varied_sample

from foveacam_pipeline.learn.losses import warped
from foveacam_pipeline.learn.pairs import picture_planes, shifted_dataset, shifted_pair

SHIFT_PX = 16


def test_a_shifted_pair_has_no_negative_disparity_and_the_same_total() -> None:
    sample = varied_sample(3)
    assert sample.truth is not None and np.nanmin(sample.truth.disparity_px) < -2.0
    (moved,) = shifted_dataset(scene("a", seed=3, pairs=1, labelled=True), SHIFT_PX).pairs
    assert moved.truth is not None
    assert np.nanmin(moved.truth.disparity_px[moved.truth.both]) >= 0.0
    total = sample.truth.disparity_px + sample.pair.offset_px
    assert np.allclose(moved.truth.disparity_px + moved.pair.offset_px, total, atol=1e-3)
    assert not moved.pair.valid_right[:, -SHIFT_PX:].any()


def test_the_shifted_right_picture_is_found_at_the_shifted_disparity() -> None:
    (moved,) = shifted_dataset(scene("a", seed=3, pairs=1, labelled=True), SHIFT_PX).pairs
    assert moved.truth is not None
    left, right = (torch.from_numpy(picture_planes(p))[None] for p in (moved.pair.left, moved.pair.right))
    both = torch.from_numpy(moved.truth.both)[None, None]

    def off(disparity_px: torch.Tensor) -> float:
        rebuilt, _ = warped(right, disparity_px)
        return float((rebuilt - left).abs().mean(dim=1, keepdim=True)[both].mean())

    true_px = torch.from_numpy(np.nan_to_num(moved.truth.disparity_px))[None, None]
    assert off(true_px) < 0.3 * off(torch.zeros_like(true_px))


def test_no_shift_leaves_a_pair_as_it_is() -> None:
    pair = varied_sample(4).pair
    same = shifted_pair(pair, 0)
    assert np.array_equal(same.right, pair.right)
    assert np.array_equal(same.valid_right, pair.valid_right)
