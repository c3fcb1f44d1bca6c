"""Sec. 4.2: equal pixels spent two ways, where patches go, and sizes that keep disparity true."""

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.tradeoff.outcomes import SemiGlobal, StereoView
from foveacam_pipeline.study.tradeoff.patches import (
    PictureSize,
    budget,
    choose_patches,
    covered_mask,
    enlarged,
    filled,
    resized,
    scaled,
)
from foveacam_pipeline.study.tradeoff.streets import CAMERA

NATIVE = PictureSize(width=CAMERA.width, height=CAMERA.height)
RNG = np.random.default_rng


@pytest.mark.parametrize("share", [0.04, 0.0625, 0.11, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("patches", [1, 4])
def test_both_configurations_spend_the_same_pixels(share: float, patches: int) -> None:
    sizes = budget(NATIVE, share, patches=patches)
    assert abs(sizes.imbalance) < 0.005  # half a row of every patch, rounded
    assert sizes.medium.pixels == pytest.approx(share * NATIVE.pixels, rel=0.01)
    assert sizes.backdrop.pixels == pytest.approx(0.75 * sizes.medium.pixels, rel=0.01)
    assert sizes.count * sizes.patch.pixels == pytest.approx(0.25 * sizes.medium.pixels, rel=0.03)


def test_budgets_that_cannot_be_spent_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"shares of 1\.5 and 0\.25"):
        budget(NATIVE, 1.5, patches=4)
    with pytest.raises(InvalidInput, match="0 patches were asked for"):
        budget(NATIVE, 0.25, patches=0)
    with pytest.raises(InvalidInput, match="give more pixels or fewer patches"):
        budget(NATIVE, 0.01, patches=40)


def test_patches_go_to_what_is_farthest_and_never_twice_to_the_same() -> None:
    depth_m = np.full((60, 80), 5.0)
    depth_m[10:22, 40:56] = 50.0
    depth_m[40:52, 4:20] = 40.0
    depth_m[0:8] = np.nan  # the sky
    size = PictureSize(width=16, height=12)
    first, second = choose_patches(depth_m, size, count=2)
    assert (first.x_px, first.y_px) == (40, 10)
    assert (second.x_px, second.y_px) == (4, 40)
    assert covered_mask((first, second), size, PictureSize(width=80, height=60)).sum() == 2 * 16 * 12
    with pytest.raises(InvalidInput, match="do not fit into 80 x 60 px"):
        choose_patches(depth_m, PictureSize(width=81, height=12), count=1)


def test_a_little_that_is_far_outweighs_much_that_is_near() -> None:
    """Errors of depth grow with its square: 30 m on a quarter of a patch against 10 m on all of it."""
    depth_m = np.full((60, 80), 1.0)
    depth_m[4:16, 4:20] = 10.0
    depth_m[40:46, 50:58] = 30.0
    (first,) = choose_patches(depth_m, PictureSize(width=16, height=12), count=1)
    assert first.x_px >= 42 and first.y_px >= 34


def test_a_patch_may_lie_at_the_last_pixel() -> None:
    depth_m = np.ones((30, 40))
    depth_m[-10:, -16:] = 9.0
    assert choose_patches(depth_m, PictureSize(width=16, height=10), count=1)[0].window(
        PictureSize(width=16, height=10)
    ) == (slice(20, 30), slice(24, 40))


def test_holes_are_filled_from_the_background() -> None:
    nan = np.nan
    disparity = np.array([[nan, 8.0, nan, 3.0, nan], [nan] * 5, [2.0, nan, nan, 7.0, nan]], dtype=np.float32)
    np.testing.assert_array_equal(filled(disparity), [[8, 8, 3, 3, 3], [8, 8, 3, 3, 3], [2, 2, 2, 7, 7]])
    with pytest.raises(InvalidInput, match="found no disparity at all"):
        filled(np.full((3, 4), nan, dtype=np.float32))


def test_disparity_grows_by_the_ratio_that_came_about() -> None:
    small = np.full((33, 111), 5.0, dtype=np.float32)
    grown = enlarged(small, NATIVE)
    assert grown.shape == (NATIVE.height, NATIVE.width)
    np.testing.assert_allclose(grown, 5.0 * NATIVE.width / 111, rtol=1e-6)


@pytest.mark.parametrize("share", [0.25, 0.11])
def test_a_reduced_pair_keeps_its_disparity(share: float) -> None:
    wide = RNG(4).integers(0, 256, (120, 340, 3), dtype=np.uint8)
    left, right = wide[:, :320], wide[:, 20:]  # what is at x in the left is at x - 20 in the right
    size = scaled(PictureSize(width=320, height=120), share)
    view = StereoView(
        left=resized(left, size),
        right=resized(right, size),
        f_px=100.0,
        baseline_m=1.0,
        near_m=5.0,
    )
    found = enlarged(SemiGlobal().disparity_px(view), PictureSize(width=320, height=120))
    assert np.nanmedian(found) == pytest.approx(20.0, abs=0.06 * 320 / size.width)  # sub-pixel steps
