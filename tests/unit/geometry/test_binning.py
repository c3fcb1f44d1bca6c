"""Models of binned pictures: each commutes with the map of pixels, and the inverse undoes it."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.geometry import homography_apply
from foveacam_pipeline.geometry.binning import binning_of, enlarge, picture_px, sensor_from_picture, sensor_px
from foveacam_pipeline.models import Calibration, Intrinsics, load_calibration

CALIBRATION = load_calibration(Path(__file__).parents[2] / "data" / "rig120-calibration.json")
BINNED = CALIBRATION.binned(2)
pixel = st.tuples(st.floats(-100.0, 1600.0), st.floats(-100.0, 1200.0))
angle = st.floats(-0.15, 0.15)


@given(pixel)
def test_a_binned_pixel_is_the_mean_of_the_pixels_that_it_bins(at: tuple[float, float]) -> None:
    first = np.floor(at)
    four = [2 * first + np.array([x, y]) for x in (0, 1) for y in (0, 1)]
    assert sensor_px(first, 2) == pytest.approx(np.mean(four, axis=0))
    assert picture_px(sensor_px(np.array(at), 2), 2) == pytest.approx(at)
    assert homography_apply(sensor_from_picture(2), np.array([at])) == pytest.approx(
        sensor_px(np.array([at]), 2)
    )


@given(pixel)
def test_the_lens_of_binned_pictures_tells_the_same_angles(at: tuple[float, float]) -> None:
    pixels = np.array([at])
    angles = CALIBRATION.wide.angles_rad(pixels)
    assert BINNED.wide.angles_rad(picture_px(pixels, 2)) == pytest.approx(angles, abs=1e-12)
    assert sensor_px(BINNED.wide.pixels(angles), 2) == pytest.approx(
        CALIBRATION.wide.pixels(angles), abs=1e-9
    )


@given(pixel, angle, angle, st.floats(1.0, 50.0), st.sampled_from([Role.LEFT, Role.RIGHT]))
@settings(max_examples=60)
def test_rectification_of_binned_pictures_is_half_of_the_sensors(
    at: tuple[float, float], ax: float, ay: float, depth_m: float, role: Role
) -> None:
    raw = np.array([at])
    full = homography_apply(CALIBRATION.rectification(role, ax, ay, depth_m=depth_m), raw)
    binned = homography_apply(BINNED.rectification(role, ax, ay, depth_m=depth_m), picture_px(raw, 2))
    assert 2.0 * binned == pytest.approx(full, abs=1e-6)


def test_errors_and_sizes_scale_with_the_pixels_and_angles_do_not() -> None:
    assert (BINNED.fovea_width, BINNED.fovea_height) == (720, 540)
    assert (BINNED.wide.width, BINNED.wide.height) == (720, 540)
    assert BINNED.pose_sigma_px(3.0) == pytest.approx(CALIBRATION.pose_sigma_px(3.0) / 2.0)
    assert BINNED.epipolar_sigma_px(3.0) == pytest.approx(CALIBRATION.epipolar_sigma_px(3.0) / 2.0)
    assert BINNED.left.homography.loo_px == CALIBRATION.left.homography.loo_px / 2.0
    assert BINNED.wide.field_rad == pytest.approx(CALIBRATION.wide.field_rad, abs=1e-12)
    assert BINNED.reach_rad() == CALIBRATION.reach_rad()


def test_binning_of_one_changes_nothing() -> None:
    assert CALIBRATION.binned(1) is CALIBRATION
    assert CALIBRATION.wide.binned(1) is CALIBRATION.wide
    assert CALIBRATION.left.homography.binned(1) is CALIBRATION.left.homography
    assert BINNED.binned(2, made_at=2) is BINNED


def test_a_calibration_is_binned_once() -> None:
    binned = CALIBRATION.binned(2)
    assert CALIBRATION.binned(2) is binned


def test_a_calibration_made_from_binned_pictures_serves_the_sensor_by_the_inverse() -> None:
    assert BINNED.binned(1, made_at=2).id == CALIBRATION.id


def test_the_binning_of_a_picture_is_read_from_its_size() -> None:
    wide = CALIBRATION.wide
    assert wide.of_picture((1080, 1440, 3)) is wide
    assert wide.of_picture((540, 720)) == wide.binned(2)
    assert binning_of((540, 720), width=1441, height=1081) == 2  # an odd row and column are not read
    with pytest.raises(InvalidInput, match="720 x 480 px belongs to no binning"):
        wide.of_picture((480, 720))


def test_an_enlarged_picture_shows_things_at_pixels_of_the_sensor() -> None:
    full = np.tile(np.arange(0, 200, 2, dtype=np.uint8), (40, 1))
    binned = full.reshape(20, 2, 50, 2).mean(axis=(1, 3)).astype(np.uint8)
    enlarged = enlarge(binned, binning=2)
    assert np.abs(enlarged[:, 2:-2].astype(int) - full[:, 2:-2]).max() <= 1
    assert enlarge(full, binning=1) is full


def test_an_odd_sensor_bins_to_whole_pixels() -> None:
    odd = Intrinsics(width=1441, height=1081, fx_px=3150.0, fy_px=3150.0, cx_px=720.0, cy_px=540.0)
    assert (odd.binned(2).width, odd.binned(2).height) == (720, 540)


def test_calibrations_of_binned_pictures_keep_the_rig() -> None:
    assert isinstance(BINNED, Calibration)
    BINNED.check_rig(CALIBRATION.rig_id)
