"""Rectification: a plane comes out flat, at its depth, in windows that share their rows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Frame, InvalidInput, Sighting
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import rectify, to_uint8
from foveacam_pipeline.stereo.values import RectifiedPair

LOOK = (math.radians(4.0), math.radians(-3.0))


def sighting(*, plane_z_m: float, verged_z_m: float) -> Sighting:
    distance_m = verged_z_m * math.hypot(1.0, math.tan(LOOK[0]), math.tan(LOOK[1]))
    volts = CALIBRATION.steer(*LOOK, distance_m=distance_m)
    return PlaneHead(z_m=plane_z_m, texture=noise_texture()).look(volts)


def tinted(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.stack([image, image // 2, image // 4], axis=2)


def median_residual_px(pair: RectifiedPair) -> float:
    return float(np.nanmedian(match(pair).residual_px))


def test_a_plane_at_the_verged_depth_has_no_residual() -> None:
    pair = rectify(sighting(plane_z_m=6.0, verged_z_m=6.0), CALIBRATION)
    assert pair.verged_z_m == pytest.approx(
        6.0, rel=1e-3
    )  # the middle of the frame, not the gaze, to a pixel
    residual_px = match(pair).residual_px
    assert abs(float(np.nanmedian(residual_px))) < 0.1
    assert float(np.nanstd(residual_px)) < 0.2  # flat: neither tilted nor bent by pupil, roll or keystone


@pytest.mark.parametrize("plane_z_m", [5.6, 6.5])
def test_a_plane_before_or_behind_shows_in_the_residual(plane_z_m: float) -> None:
    pair = rectify(sighting(plane_z_m=plane_z_m, verged_z_m=6.0), CALIBRATION)
    total_px = median_residual_px(pair) + pair.offset_px
    assert pair.f_px * pair.baseline_m / total_px == pytest.approx(plane_z_m, rel=1e-3)


def test_full_scale_has_twice_the_disparity_of_half_scale() -> None:
    look = sighting(plane_z_m=6.2, verged_z_m=6.0)
    half, full = rectify(look, CALIBRATION), rectify(look, CALIBRATION, scale=1.0)
    assert half.left.shape == (540, 720) and full.left.shape == (1080, 1440)
    assert full.f_px == pytest.approx(2.0 * half.f_px)
    assert full.offset_px == pytest.approx(2.0 * half.offset_px)
    assert full.pose_sigma_px == pytest.approx(2.0 * half.pose_sigma_px)
    assert median_residual_px(full) == pytest.approx(2.0 * median_residual_px(half), abs=0.15)


def test_rows_match_between_the_windows() -> None:
    pair = rectify(sighting(plane_z_m=6.0, verged_z_m=6.0), CALIBRATION)
    both = pair.valid_left & pair.valid_right
    aligned, shifted = (
        float(np.abs(pair.left.astype(int) - np.roll(pair.right, rows, axis=0))[both].mean())
        for rows in (0, 1)
    )
    assert aligned < 0.6 * shifted


def test_the_corners_that_roll_uncovers_are_not_valid() -> None:
    pair = rectify(sighting(plane_z_m=6.0, verged_z_m=6.0), CALIBRATION)
    for valid in (pair.valid_left, pair.valid_right):
        assert 0.8 < valid.mean() < 0.999
        assert valid[270, 360]
        assert not valid[[0, 0, -1, -1], [0, -1, 0, -1]].all()


def test_colour_frames_give_colour_windows() -> None:
    look = sighting(plane_z_m=6.0, verged_z_m=6.0)
    left, right = (replace(frame, image=tinted(to_uint8(frame))) for frame in (look.left, look.right))
    pair = rectify(replace(look, left=left, right=right), CALIBRATION)
    assert pair.left.shape == (540, 720, 3)
    middle = pair.left[200:340, 260:460].astype(float).mean(axis=(0, 1))
    np.testing.assert_allclose(middle[1:] / middle[0], [0.5, 0.25], atol=0.01)


def test_twelve_bits_keep_their_upper_eight() -> None:
    look = sighting(plane_z_m=6.0, verged_z_m=6.0)
    deep = look.left.image.astype(np.uint16) * 16 + 5
    frame = Frame(
        image=deep,
        role=look.left.role,
        seq=1,
        t_ns=look.left.t_ns,
        exposure_ns=look.left.exposure_ns,
        bits=12,
    )
    np.testing.assert_array_equal(to_uint8(frame), look.left.image)


def test_other_scales_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"only 0\.5 and 1\.0"):
        rectify(sighting(plane_z_m=6.0, verged_z_m=6.0), CALIBRATION, scale=0.25)
