"""What the sweep expects of a mirror: sober at first, good beside what was seen, and it follows a knock."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.sweep.eye_prediction import EyePrediction

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
