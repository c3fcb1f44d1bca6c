"""The wide camera's pixels and angles."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.models import Intrinsics

LENS = Intrinsics(
    width=1440,
    height=1080,
    fx_px=3155.0,
    fy_px=3151.0,
    cx_px=723.0,
    cy_px=537.0,
    distortion=(-0.08, 0.05, 2e-4, -1e-4, 0.0),
)


@settings(deadline=None)
@given(x=st.floats(-0.5, 1439.5), y=st.floats(-0.5, 1079.5))
def test_pixels_survive_angles_to_a_millionth(x: float, y: float) -> None:
    np.testing.assert_allclose(LENS.pixels(LENS.angles_rad([[x, y]])), [[x, y]], atol=1e-6)


def test_the_principal_point_looks_straight_ahead() -> None:
    np.testing.assert_allclose(LENS.angles_rad([[723.0, 537.0]]), [[0.0, 0.0]], atol=1e-12)


def test_the_distortion_is_radial_and_tangential_as_published() -> None:
    # Brown's model, written out: the library must be called with the arguments meant.
    tx, ty = math.tan(0.2), math.tan(-0.15)
    k1, k2, p1, p2, k3 = LENS.distortion
    r2 = tx * tx + ty * ty
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    x = tx * radial + 2 * p1 * tx * ty + p2 * (r2 + 2 * tx * tx)
    y = ty * radial + p1 * (r2 + 2 * ty * ty) + 2 * p2 * tx * ty
    expected = [[723.0 + 3155.0 * x, 537.0 + 3151.0 * y]]
    np.testing.assert_allclose(LENS.pixels([[0.2, -0.15]]), expected, atol=1e-9)


def test_an_undistorted_field_is_that_of_a_pinhole() -> None:
    plain = Intrinsics(width=1440, height=1080, fx_px=3155.0, fy_px=3155.0, cx_px=719.5, cy_px=539.5)
    field_deg = np.rad2deg(plain.field_rad)
    np.testing.assert_allclose(field_deg, [-12.86, 12.86, -9.71, 9.71], atol=0.01)  # Table 2 within 0.1°


def test_no_points_give_no_points() -> None:
    assert LENS.pixels(np.empty((0, 2))).shape == (0, 2)
    assert LENS.angles_rad(np.empty((0, 2))).shape == (0, 2)


@pytest.mark.parametrize("pixel", [(1440.0, 10.0), (-0.6, 10.0), (10.0, 1079.6), (math.nan, 1.0)])
def test_a_pixel_outside_is_refused_with_the_range(pixel: tuple[float, float]) -> None:
    with pytest.raises(OutOfRange, match=r"x from -0\.5 to 1439\.5, y from -0\.5 to 1079\.5 px"):
        LENS.check_pixel(*pixel)


def test_the_outermost_pixels_are_allowed() -> None:
    LENS.check_pixel(-0.5, 1079.5)
    LENS.check_rectangle(0.0, 0.0, width_px=1439.5, height_px=1079.5)


def test_a_rectangle_that_leaves_the_image_or_is_empty_is_refused() -> None:
    with pytest.raises(OutOfRange, match="outside the image"):
        LENS.check_rectangle(1400.0, 10.0, width_px=50.0, height_px=10.0)
    with pytest.raises(OutOfRange, match="no area"):
        LENS.check_rectangle(10.0, 10.0, width_px=0.0, height_px=10.0)
