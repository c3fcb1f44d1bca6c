"""The projection of a camera whose pixels are means of 2x2: x = 2 x_b + 0.5, with and without distortion."""

import numpy as np
import pytest

from foveacam_hardware.sim.optics import WIDE_HEIGHT, WIDE_WIDTH, WideLens, wide_projections
from foveacam_hardware.sim.render.projection import Projection

POINTS_M = np.array([[0.0, 0.0, 4.0], [1.0, -0.5, 6.0], [-0.9, 0.7, 3.5]])


def test_a_point_lies_at_half_its_pixel_but_for_a_quarter() -> None:
    M = np.array([[900.0, 3.0, 640.0], [-2.0, 910.0, 470.0], [0.01, 0.02, 1.0]])
    whole = Projection(M=M, C=np.array([0.1, 0.0, -0.2]), width=1281, height=960)
    half = whole.halved()

    assert (half.width, half.height) == (640, 480)
    assert 2.0 * half.project(POINTS_M) + 0.5 == pytest.approx(whole.project(POINTS_M), abs=1e-9)
    assert half.rays_at([[10.0, 20.0]]) == pytest.approx(whole.rays_at([[20.5, 40.5]]), abs=1e-12)
    assert half.key != whole.key


def test_a_distorted_pixel_looks_along_the_ray_of_the_middle_of_its_four() -> None:
    lens = WideLens()
    half = wide_projections(lens)[2]
    pixels = np.array([[0.0, 0.0], [100.0, 400.0], [719.0, 539.0], [350.0, 12.0]])
    straight = lens.undistorted_px(2.0 * pixels + 0.5)

    assert (half.width, half.height) == (WIDE_WIDTH // 2, WIDE_HEIGHT // 2)
    assert 2.0 * half.undistort(pixels) + 0.5 == pytest.approx(straight, abs=1e-4)
