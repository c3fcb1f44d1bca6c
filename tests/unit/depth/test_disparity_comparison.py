"""Comparing the disparities of two backends against the errors that they state."""

import numpy as np
import pytest

from foveacam_pipeline.stereo.comparison import (
    UNKNOWN_RGB,
    DisparityComparison,
    compare_disparities,
    difference_picture,
)
from foveacam_pipeline.stereo.values import DisparityMap

SHAPE = (120, 160)


def found(residual_px: np.ndarray[tuple[int, ...], np.dtype[np.float64]], sigma_px: float) -> DisparityMap:
    return DisparityMap(
        residual_px=residual_px.astype(np.float32),
        sigma_px=np.full(residual_px.shape, sigma_px, dtype=np.float32),
        compute_ms=1.0,
    )


def compared(first_sigma_px: float, second_sigma_px: float, *, stated_px: float = 0.1) -> DisparityComparison:
    rng = np.random.default_rng(3)
    first, second = (rng.normal(2.0, sigma, SHAPE) for sigma in (first_sigma_px, second_sigma_px))
    return compare_disparities(found(first, stated_px), found(second + 0.5, stated_px))


def test_rightly_stated_independent_errors_lie_within_as_often_as_a_normal_distribution_says() -> None:
    rng = np.random.default_rng(1)
    first, second = found(rng.normal(0.0, 0.3, SHAPE), 0.3), found(rng.normal(0.0, 0.4, SHAPE), 0.4)
    comparison = compare_disparities(first, second)

    assert comparison.within_1 == pytest.approx(0.683, abs=0.015)
    assert comparison.within_2 == pytest.approx(0.954, abs=0.01)
    assert comparison.spread_px == pytest.approx(0.5, rel=0.03)
    assert comparison.shares.sum() == pytest.approx(1.0)
    assert comparison.median_px == pytest.approx(0.0, abs=0.02)


def test_a_shift_and_understated_errors_show() -> None:
    comparison = compared(0.3, 0.3)

    assert comparison.median_px == pytest.approx(-0.5, abs=0.02)
    assert comparison.within_1 is not None and comparison.within_1 < 0.3
    assert comparison.shares[0] > 0.1  # beyond five of them: counted in the outermost bin


def test_unknown_pixels_of_either_count_for_neither() -> None:
    first, second = np.zeros(SHAPE), np.zeros(SHAPE)
    first[:30], second[:, :40] = np.nan, np.nan
    comparison = compare_disparities(found(first, 0.1), found(second, 0.1))

    assert (comparison.known_first, comparison.known_second, comparison.known_both) == (0.75, 0.75, 0.5625)
    picture = difference_picture(comparison, limit_px=1.0)
    assert tuple(picture[0, 0]) == UNKNOWN_RGB
    assert tuple(picture[-1, -1]) == (255, 255, 255)


def test_larger_disparities_of_the_first_are_red_and_of_the_second_blue() -> None:
    first = np.zeros(SHAPE)
    first[:60] = 2.0
    first[60:] = -2.0
    picture = difference_picture(compare_disparities(found(first, 0.1), found(first * 0, 0.1)), limit_px=1.0)

    assert tuple(picture[0, 0]) == (255, 0, 0)
    assert tuple(picture[-1, 0]) == (0, 0, 255)


def test_two_that_know_nothing_in_common_have_no_figures() -> None:
    nothing = found(np.full(SHAPE, np.nan), 0.1)
    comparison = compare_disparities(nothing, found(np.zeros(SHAPE), 0.1))

    assert (comparison.median_px, comparison.within_1, comparison.known_both) == (None, None, 0.0)
    assert not comparison.shares.any()
