"""Where a lens model has an inverse, and that it is exact there."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.models import Intrinsics
from foveacam_pipeline.models.distortion import WIDEST_TAN, largest_radius

FOLDING = Intrinsics(
    width=1280,
    height=960,
    fx_px=563.8,
    fy_px=564.7,
    cx_px=652.2,
    cy_px=500.8,
    distortion=(-0.2463, 0.0759, -0.0004, 0.0002, -0.0117),
)
"""A lens as fitted to photographs of an action camera: its radius grows up to 1.09 focal lengths, and the
image's corners are 1.46 from the centre."""
STRONG = Intrinsics(
    width=1280,
    height=960,
    fx_px=500.0,
    fy_px=500.0,
    cx_px=640.0,
    cy_px=480.0,
    distortion=(-0.3, 0.12, 0.0, 0.0, -0.01),
)
"""Grows to the very corners of the image, where a hundred rounds of iteration do not suffice."""
ROUND_TRIP_PX = 0.02


def _grid(lens: Intrinsics) -> NDArray[np.float64]:
    x, y = np.meshgrid(np.linspace(-0.5, lens.width - 0.5, 65), np.linspace(-0.5, lens.height - 0.5, 49))
    return np.column_stack([x.ravel(), y.ravel()])


def _largest_shown(lens: Intrinsics) -> float:
    """Return the largest radius that the lens reaches, focal lengths, by its series alone."""
    k1, k2, _, _, k3 = lens.distortion
    r = np.linspace(0.0, 2.0, 200_001)
    return float((r * (1.0 + k1 * r**2 + k2 * r**4 + k3 * r**6))[: np.searchsorted(r, 1.8)].max())


@pytest.mark.parametrize("lens", [FOLDING, STRONG, FOLDING.binned(2)])
def test_pixels_come_back_exactly_or_are_told_to_have_no_direction(lens: Intrinsics) -> None:
    pixels = _grid(lens)
    angles = lens.angles_rad(pixels)
    known = np.isfinite(angles).all(axis=1)
    assert np.abs(lens.pixels(angles[known]) - pixels[known]).max() <= ROUND_TRIP_PX
    assert np.isnan(angles[~known]).all()


def test_a_direction_is_missing_only_where_the_lens_reaches_no_pixel() -> None:
    pixels = _grid(FOLDING)
    away = (pixels - [FOLDING.cx_px, FOLDING.cy_px]) / [FOLDING.fx_px, FOLDING.fy_px]
    radius = np.linalg.norm(away, axis=1)
    known = np.asarray(np.isfinite(FOLDING.angles_rad(pixels)).all(axis=1))
    reach = _largest_shown(FOLDING)
    assert reach == pytest.approx(1.09, abs=0.01)
    assert known[np.less(radius, 0.99 * reach)].all()
    assert not known[np.greater(radius, 1.01 * reach)].any()


def test_every_pixel_of_a_lens_that_grows_to_the_corners_has_a_direction() -> None:
    assert np.isfinite(STRONG.angles_rad(_grid(STRONG))).all()


def test_directions_beyond_the_fold_have_no_pixel() -> None:
    beyond = np.arctan([[largest_radius(FOLDING.distortion) + 0.05, 0.0]])
    assert np.isnan(FOLDING.pixels(beyond)).all()
    assert np.isfinite(FOLDING.pixels(beyond / 2.0)).all()


def test_the_field_ends_where_the_lens_folds_back() -> None:
    left, right, top, bottom = FOLDING.field_rad
    widest = np.arctan(largest_radius(FOLDING.distortion))
    assert (left, right) == pytest.approx((-widest, widest), abs=0.02)
    assert -widest < top < 0.0 < bottom < widest


def test_a_pixel_without_a_direction_is_refused_by_name() -> None:
    FOLDING.check_pixel(652.0, 500.0)
    with pytest.raises(OutOfRange, match=r"pixel \(3, 3\) has no direction"):
        FOLDING.check_pixel(3.0, 3.0)


def test_the_rational_model_grows_as_far_as_its_denominator_is_positive() -> None:
    assert largest_radius((0.0,) * 8) == WIDEST_TAN
    assert largest_radius((0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0)) == pytest.approx(2.0, abs=0.01)
