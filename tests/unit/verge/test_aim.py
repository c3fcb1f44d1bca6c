"""Gazes at a target, by the calibration alone."""

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_pipeline.verge.aim import aim_at, centred_on_ray

TARGET = np.array([0.04, -0.07])
WITHIN_TAN = 3.0e-4


@pytest.mark.parametrize("inverse_z", [0.0, 0.125, 0.6])
@pytest.mark.parametrize("aside", [(0.0, 0.0), (2.0e-4, 0.0), (-1.0e-4, 2.9e-4)])
def test_gazes_that_pass_the_ray_are_moved_onto_it_and_meet_as_deep(
    inverse_z: float, aside: tuple[float, float]
) -> None:
    aimed = aim_at(CALIBRATION, TARGET, inverse_z)
    centred = centred_on_ray(
        CALIBRATION, aimed.moved(np.array(aside), np.array(aside)), TARGET, within_tan=WITHIN_TAN
    )
    assert centred.apart(aimed) < 1.0e-6  # a fortieth of a fovea px


@pytest.mark.parametrize("aside", [(3.1e-4, 0.0), (0.0, -5.0e-3)])
def test_gazes_farther_from_the_ray_stay(aside: tuple[float, float]) -> None:
    gazes = aim_at(CALIBRATION, TARGET, 0.125).moved(np.array(aside), np.array(aside))
    assert centred_on_ray(CALIBRATION, gazes, TARGET, within_tan=WITHIN_TAN) is gazes
