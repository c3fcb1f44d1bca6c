"""Gazes at a target, by the calibration alone, and the point where they meet with its error."""

import math

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, MEASURED

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge.aim import EYES, aim_at, centred_on_ray, clamp_gazes
from foveacam_pipeline.verge.distance import triangulate
from foveacam_pipeline.verge.matching.fine import FineMatch
from foveacam_pipeline.verge.measure import point_sigma_px
from foveacam_pipeline.verge.settings import VergeSettings

TARGET = np.array([0.04, -0.07])
WITHIN_TAN = 3.0e-4
DRAWN = 1500
SPREAD = 0.08
"""Four standard errors of a standard deviation of so many draws."""


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


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
@pytest.mark.parametrize("beyond", [(0.6, 0.0), (-0.3, 0.4), (0.0, -0.7)])
def test_an_eye_that_cannot_turn_so_far_turns_as_far_as_it_can(
    role: Role, beyond: tuple[float, float]
) -> None:
    mirror = CALIBRATION.eye(role).mirror
    gazes = aim_at(CALIBRATION, np.array(beyond), 0.0)
    gaze = clamp_gazes(CALIBRATION, gazes).eye(role)
    assert mirror.contains(*np.arctan(gaze).tolist())
    middle = np.tan(mirror.hull_rad.mean(axis=0))
    farther = gaze + np.radians(0.3) * (gaze - middle) / np.linalg.norm(gaze - middle)
    assert not mirror.contains(*np.arctan(farther).tolist())
    way, asked = gaze - middle, gazes.eye(role) - middle
    assert way[0] * asked[1] == pytest.approx(way[1] * asked[0], abs=1e-12)


def test_gazes_within_the_field_are_left_as_they_are() -> None:
    gazes = aim_at(CALIBRATION, TARGET, 0.2)
    assert clamp_gazes(CALIBRATION, gazes).apart(gazes) == 0.0


@pytest.mark.parametrize("z_m", [2.0, 9.0])
def test_errors_of_a_distance_are_as_large_as_stated(z_m: float) -> None:
    rng, f_px = np.random.default_rng(4), MEASURED.fovea_f_px
    match_px = MEASURED.pose_sigma_px(z_m)  # so that both parts count
    aimed = aim_at(MEASURED, TARGET, 1.0 / z_m)
    stated = triangulate(MEASURED, aimed, sigma_px=match_px)
    turned = {role: MEASURED.eye(role).angle_sigma_rad(z_m)[0] * rng.standard_normal(DRAWN) for role in EYES}
    matched = match_px / f_px * rng.standard_normal(DRAWN)

    def spread_m(left: np.ndarray, right: np.ndarray) -> float:
        """Return the standard deviation of the distances of lines of sight turned by so much, rad."""
        aside = [(np.array([a, 0.0]), np.array([b, 0.0])) for a, b in zip(left, right, strict=True)]
        points = [triangulate(MEASURED, aimed.moved(*each), sigma_px=match_px) for each in aside]
        return float(np.std([point.distance_m for point in points if point is not None]))

    half = matched / 2.0
    assert stated is not None
    assert stated.distance_m == pytest.approx(z_m * math.hypot(1.0, *TARGET), rel=1e-6)
    assert stated.distance_sigma_random_m == pytest.approx(spread_m(half, -half), rel=SPREAD)
    whole_m = spread_m(turned[Role.LEFT] + half, turned[Role.RIGHT] - half)
    assert stated.distance_sigma_m == pytest.approx(whole_m, rel=SPREAD)


@pytest.mark.parametrize(("slope", "placed_px"), [((0.0, 0.0), 0.0), ((0.3, -0.4), 0.5)])
def test_a_point_on_a_slope_is_as_uncertain_as_its_place(
    slope: tuple[float, float], placed_px: float
) -> None:
    fine = FineMatch(
        residual_x_px=0.0,
        residual_y_px=0.0,
        score=1.0,
        sigma_x_px=0.2,
        sigma_y_px=0.2,
        contrast=1.0,
        slope=slope,
    )
    beside_px = 0.35 * MEASURED.fovea_f_px / MEASURED.wide.fx_px  # a third of a wide px, about 3 fovea px
    assert 2.5 < beside_px < 4.0
    found = point_sigma_px(fine, MEASURED, VergeSettings())
    assert found == pytest.approx(math.hypot(0.2, placed_px * beside_px), rel=0.01)
