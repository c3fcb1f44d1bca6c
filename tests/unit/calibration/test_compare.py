"""Comparison of calibrations: known differences come out in pixels, and only comparable ones compare."""

import io
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.records.compare import compare, comparison_picture
from foveacam_pipeline.models import Calibration, EyeCalibration, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

A = load_calibration(Path(__file__).parents[2] / "data" / "rig120-calibration.json")
NODES = 5


def shifted(eye: EyeCalibration, *, ax_rad: float = 0.0, ay_rad: float = 0.0) -> EyeCalibration:
    """Return an eye whose gaze is said to be shifted by constant angles."""
    forward = eye.mirror.forward
    coefficients = forward.coefficients.copy()
    coefficients[0] += (ax_rad, ay_rad)
    mirror = replace(eye.mirror, forward=replace(forward, coefficients=coefficients))
    return replace(eye, mirror=mirror)


def test_a_calibration_does_not_differ_from_itself() -> None:
    same = compare(A, A, nodes=NODES)
    assert same.pointing.max_px < 1e-6
    assert same.epipolar.max_px < 1e-6
    assert same.disparity.max_px < 1e-6
    assert same.wide.max_px < 1e-6
    assert same.baseline_m == 0.0


def test_a_shift_of_one_eye_is_seen_in_gaze_and_rows() -> None:
    px = 3.0
    b = replace(A, left=shifted(A.left, ay_rad=px / A.fovea_f_px))
    found = compare(A, b, nodes=NODES)
    # Over the field f (1 + tan² a) grows from 1 to 1.023: a constant angle is 2 % more pixels at the rim.
    np.testing.assert_allclose(found.gaze_left_px[:, 1], px, rtol=0.03)
    np.testing.assert_allclose(found.gaze_right_px, 0.0, atol=1e-6)
    np.testing.assert_allclose(found.epipolar_px, px, rtol=0.05)
    assert found.pointing.rms_px == pytest.approx(px / math.sqrt(2.0), rel=0.02)


def test_a_common_shift_sideways_leaves_rows_and_disparity() -> None:
    shift = 5.0 / A.fovea_f_px
    b = replace(A, left=shifted(A.left, ax_rad=shift), right=shifted(A.right, ax_rad=shift))
    found = compare(A, b, nodes=NODES)
    assert found.pointing.rms_px == pytest.approx(5.0, rel=0.02)
    # 5 px of 28760 move the rectification by its slope: some 1e-4 of a 500 px corner, and both alike.
    assert found.epipolar.max_px < 0.2
    assert found.disparity.max_px < 0.2


def test_opposite_shifts_are_a_disparity() -> None:
    shift = 2.0 / A.fovea_f_px
    b = replace(A, left=shifted(A.left, ax_rad=shift), right=shifted(A.right, ax_rad=-shift))
    np.testing.assert_allclose(compare(A, b, nodes=NODES).disparity_px, 4.0, rtol=0.06)


def test_wide_cameras_and_baselines_are_compared() -> None:
    b = replace(A, wide=replace(A.wide, cx_px=A.wide.cx_px + 1.5), baseline_m=A.baseline_m + 1e-3)
    found = compare(A, b, nodes=NODES)
    np.testing.assert_allclose(found.wide_px[:, 0], 1.5, atol=1e-6)
    assert found.baseline_m == pytest.approx(1e-3, rel=1e-9)


def test_only_calibrations_of_one_rig_compare() -> None:
    with pytest.raises(InvalidInput, match=r"rig 'sim-rig120' and .* of rig 'sim-paper' differ"):
        compare(A, load_calibration(SHIPPED / "sim-paper.json"))


def away(calibration: Calibration, *, ax_rad: float) -> Calibration:
    """Return a calibration whose field lies elsewhere."""
    eyes = [
        replace(
            shifted(eye, ax_rad=ax_rad),
            mirror=replace(
                shifted(eye, ax_rad=ax_rad).mirror, hull_rad=eye.mirror.hull_rad + np.array([ax_rad, 0.0])
            ),
        )
        for eye in (calibration.left, calibration.right)
    ]
    return replace(calibration, left=eyes[0], right=eyes[1])


def test_fields_apart_are_refused() -> None:
    with pytest.raises(InvalidInput, match="cover different fields"):
        compare(A, away(A, ax_rad=0.5), nodes=NODES)


@pytest.mark.parametrize("b", [A, replace(A, left=shifted(A.left, ay_rad=1e-4))])
def test_the_picture_is_a_picture(b: Calibration) -> None:
    data = comparison_picture(compare(A, b, nodes=NODES))
    image = cv2.imdecode(np.frombuffer(io.BytesIO(data).getvalue(), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape[0] > 600
    assert image.std() > 10.0
