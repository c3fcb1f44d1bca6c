"""Axis-wise angles, rays, virtual pinhole planes and their windows."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import InvalidInput, OutOfRange
from foveacam_pipeline.geometry import (
    PinholeWindow,
    angles_from_rays,
    angles_from_tan,
    ray,
    rays_from_angles,
    tan_from_angles,
)

ANGLE = st.floats(-1.2, 1.2)


@settings(deadline=None)
@given(ax=ANGLE, ay=ANGLE)
def test_angles_survive_rays_and_tangents(ax: float, ay: float) -> None:
    angles = np.array([[ax, ay]])
    np.testing.assert_allclose(angles_from_rays(7.0 * rays_from_angles(angles)), angles, atol=1e-14)
    np.testing.assert_allclose(angles_from_tan(tan_from_angles(angles)), angles, atol=1e-14)


def test_positive_angles_look_right_and_down() -> None:
    direction = ray(math.radians(10.0), math.radians(5.0))
    assert direction[0] > 0 and direction[1] > 0
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert direction[0] / direction[2] == pytest.approx(math.tan(math.radians(10.0)))


def test_angles_are_axis_wise_not_polar() -> None:
    both = angles_from_rays([[math.tan(0.1), math.tan(0.2), 1.0]])
    np.testing.assert_allclose(both, [[0.1, 0.2]], atol=1e-15)


def test_a_ray_that_looks_back_is_refused() -> None:
    with pytest.raises(OutOfRange, match="ray 1"):
        angles_from_rays([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])


def test_a_wrong_shape_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"angles_rad: shape \(n, 2\)"):
        rays_from_angles([0.1, 0.2])


def test_window_pixels_and_plane_are_inverse() -> None:
    window = PinholeWindow(u0_px=-700.25, v0_px=31.5, width=1440, height=1080, f_px=28_760.0)
    pixels = np.array([[0.0, 0.0], [12.5, 7.0]])
    np.testing.assert_allclose(window.plane_from_pixels(pixels)[0], [-700.25, 31.5])
    np.testing.assert_allclose(window.pixels_from_plane(window.plane_from_pixels(pixels)), pixels)
