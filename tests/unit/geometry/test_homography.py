"""The homography field: fitted from noisy corners, predicted where none were seen."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.fit.fit_homography import fit_fields
from foveacam_pipeline.geometry import homography_apply
from foveacam_pipeline.models import HomographyField

WIDTH, HEIGHT = 1440, 1080
F_PX = 28_760.0
CENTRE = np.array([719.5, 539.5])


def true_homography(ax: float, ay: float) -> NDArray[np.float64]:
    """Raw px -> plane px about the gaze of a camera rolled and turned away from the plane's axis."""
    roll = 0.9 * ax + 0.1 * ay
    forward = np.array([math.tan(ax), math.tan(ay), 1.0])
    forward = forward / np.linalg.norm(forward)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward], axis=1)
    turn = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    inverse_k = np.array([[1 / F_PX, 0, -CENTRE[0] / F_PX], [0, 1 / F_PX, -CENTRE[1] / F_PX], [0, 0, 1]])
    plane = np.diag([F_PX, F_PX, 1.0]) @ axes @ turn @ inverse_k
    gaze = np.array([[1, 0, -F_PX * math.tan(ax)], [0, 1, -F_PX * math.tan(ay)], [0, 0, 1]]) @ plane
    scaled: NDArray[np.float64] = gaze / gaze[2, 2]
    return scaled


def inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def poses(side: int = 9) -> NDArray[np.float64]:
    line = np.deg2rad(np.linspace(-9.0, 9.0, side))
    return np.array([(x, y) for y in line for x in line])


def corners(
    angles: NDArray[np.float64], noise_px: float, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    board = np.array([(u, v) for v in (-450.0, 0.0, 450.0) for u in (-600.0, -200.0, 200.0, 600.0)])
    raw = np.array([homography_apply(inverse(true_homography(ax, ay)), board) for ax, ay in angles])
    noise = noise_px * np.random.default_rng(seed).standard_normal(raw.shape)
    return raw + noise, np.broadcast_to(board, raw.shape).copy()


def misses_px(field: HomographyField, *, seed: int = 1) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    pixels = rng.uniform([0, 0], [WIDTH - 1, HEIGHT - 1], (40, 2))
    return np.array(
        [
            homography_apply(field.at(ax, ay), pixels) - homography_apply(true_homography(ax, ay), pixels)
            for ax, ay in rng.uniform(-0.15, 0.15, (40, 2))
        ]
    )


@pytest.fixture(scope="module")
def field() -> HomographyField:
    return fit_fields(poses(), *corners(poses(), 0.3), width=WIDTH, height=HEIGHT).field


def test_noisy_corners_give_a_field_good_to_a_fraction_of_their_noise(field: HomographyField) -> None:
    # About 60 coefficients from 1944 coordinates of 0.3 px: sqrt(60 / 1944) 0.3 = 0.05 px.
    assert np.sqrt(np.mean(misses_px(field) ** 2)) < 0.06


def test_leave_one_out_error_is_the_noise_of_a_corner_in_two_directions(field: HomographyField) -> None:
    assert field.loo_px == pytest.approx(0.3 * math.sqrt(2.0), rel=0.1)


def test_a_mirrored_assembly_of_poses_needs_more_than_order_one() -> None:
    raw, plane = corners(poses(), 0.0)
    low = fit_fields(poses(), raw, plane, width=WIDTH, height=HEIGHT, orders=(1,)).field
    best = fit_fields(poses(), raw, plane, width=WIDTH, height=HEIGHT).field
    assert best.polynomial.order >= 3
    assert best.loo_px < 0.01 * low.loo_px


@settings(deadline=None, max_examples=50)
@given(ax=st.floats(-0.15, 0.15), ay=st.floats(-0.15, 0.15), x=st.floats(0, 1439), y=st.floats(0, 1079))
def test_pixels_survive_the_homography_and_its_inverse(
    field: HomographyField, ax: float, ay: float, x: float, y: float
) -> None:
    h = field.at(ax, ay)
    assert h[2, 2] == 1.0
    back = homography_apply(inverse(h), homography_apply(h, [[x, y]]))
    np.testing.assert_allclose(back, [[x, y]], atol=1e-8)


@settings(deadline=None, max_examples=20)
@given(ax=st.floats(-0.15, 0.15), ay=st.floats(-0.15, 0.15))
def test_the_image_centre_is_the_gaze(field: HomographyField, ax: float, ay: float) -> None:
    np.testing.assert_allclose(homography_apply(field.at(ax, ay), [CENTRE]), [[0.0, 0.0]], atol=1e-9)


def test_missing_corners_and_wrong_ones_are_survived() -> None:
    raw, plane = corners(poses(), 0.3)
    rng = np.random.default_rng(5)
    raw[rng.random(raw.shape[:2]) < 0.2] = np.nan
    raw[[3, 44, 70], 5] += 80.0  # three corners taken for their neighbours
    fitted = fit_fields(poses(), raw, plane, width=WIDTH, height=HEIGHT).field
    assert np.sqrt(np.mean(misses_px(fitted) ** 2)) < 0.08


def test_too_few_poses_are_refused_with_the_number_needed() -> None:
    few = poses(2)
    with pytest.raises(InvalidInput, match="order 1 need at least 6 poses with four corners each, 4 poses"):
        fit_fields(few, *corners(few, 0.3), width=WIDTH, height=HEIGHT)
