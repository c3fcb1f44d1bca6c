"""What the sweep expects of a mirror: sober at first, good beside what was seen, and it follows a knock."""

import math

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.sweep.eye_prediction import (
    LINEAR_V,
    MEASURED_SIGMA_V,
    OFFSET_V,
    REACH_RAD,
    SATURATION_LENGTH,
    SATURATION_V,
    EyePrediction,
)

RAD_PER_V = (math.radians(0.055), math.radians(-0.057))
SIDE = np.radians(np.linspace(-8.0, 8.0, 9))
NODES = [np.array([x, y]) for row, y in enumerate(SIDE) for x in (SIDE if row % 2 == 0 else SIDE[::-1])]
KNOCK_V = np.array([5.5, -4.0])


def volts(gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """A mirror that saturates and couples its axes, in steps of some hundredths of a volt."""
    x, y = gaze_rad / np.array(RAD_PER_V)
    bent = np.array([x + 2e-4 * x * abs(x) + 0.03 * y, y - 1e-4 * y * abs(y) - 0.02 * x])
    return np.asarray(np.round(bent, 2) + np.array([1.5, -3.0]))


def test_a_gaze_beside_others_is_expected_within_a_volt() -> None:
    prediction = EyePrediction(RAD_PER_V)
    for node in NODES[:40]:
        prediction.learn(node, volts(node))
    assert np.abs(prediction.volts(NODES[40]) - volts(NODES[40])).max() < 1.0


def test_after_a_knock_the_next_gazes_are_expected_as_well_as_before() -> None:
    prediction = EyePrediction(RAD_PER_V)
    for node in NODES[:31]:
        prediction.learn(node, volts(node))
    missed_v = []
    for node in NODES[31:]:
        missed_v.append(float(np.abs(prediction.volts(node) - volts(node) - KNOCK_V).max()))
        prediction.learn(node, volts(node) + KNOCK_V)

    assert missed_v[0] > 5.0  # nobody could know
    assert max(missed_v[1:]) < 2.0  # 60 of the 1440 px of a fovea


def test_after_a_knock_that_also_rolls_the_eye_new_gazes_count_more_than_old_ones() -> None:
    prediction, roll_rad = EyePrediction(RAD_PER_V), math.radians(0.5)
    for node in NODES:
        prediction.learn(node, volts(node))
    turn = np.array([[math.cos(roll_rad), -math.sin(roll_rad)], [math.sin(roll_rad), math.cos(roll_rad)]])
    missed_v = []
    for node in NODES[:60]:
        knocked_v = volts(turn @ node) + KNOCK_V
        missed_v.append(float(np.abs(prediction.volts(node) - knocked_v).max()))
        prediction.learn(node, knocked_v)

    assert max(missed_v[30:]) < 1.1  # 1.5 where all gazes count alike


def test_the_error_beside_known_gazes_keeps_the_digits_that_the_cancellation_leaves() -> None:
    prediction = EyePrediction(RAD_PER_V)
    known, here = [node for node in NODES if abs(node).max() < math.radians(5.0)], NODES[41]
    for node in known:
        prediction._add(node, volts(node), MEASURED_SIGMA_V)

    with mpmath.workdps(50):
        kernel = mpmath.matrix([[kernel_v2(one, other) for other in known] for one in known])
        beside = mpmath.matrix([kernel_v2(here, node) for node in known])
        noise = mpmath.mpf(MEASURED_SIGMA_V) ** 2 * mpmath.eye(len(known))
        prior = kernel_v2(here, here)
        expected = prior - (beside.T * mpmath.lu_solve(kernel + noise, beside))[0]
    rounding = 4.0 * len(known) * np.finfo(np.float64).eps * float(prior / expected)
    assert rounding < 1e-6
    assert prediction._error_v(here) ** 2 == pytest.approx(float(expected), rel=rounding)


def kernel_v2(one: NDArray[np.float64], other: NDArray[np.float64]) -> mpmath.mpf:
    """The covariance of what two gazes need beyond the nominal volts, of the precision in force."""
    a, b = ([mpmath.mpf(each) / REACH_RAD for each in gaze.tolist()] for gaze in (one, other))
    apart = sum((x - y) ** 2 for x, y in zip(a, b, strict=True))
    bent = mpmath.exp(-apart / (2 * mpmath.mpf(SATURATION_LENGTH) ** 2))
    along = sum(x * y for x, y in zip(a, b, strict=True))
    return OFFSET_V**2 + LINEAR_V**2 * along + SATURATION_V**2 * bent
