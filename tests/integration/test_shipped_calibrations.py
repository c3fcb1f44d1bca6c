"""The calibrations that ship, measured by the procedures, against the truth at poses never swept."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from foveacam_bench.calibration.procedures import roundtrip_lsb, wide_rms_px
from foveacam_bench.calibration.truth import CalibrationModel, depth_errors, judge, random_poses
from foveacam_hardware.contract import Role
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

PRESETS = ("rig120", "paper")


@pytest.fixture(scope="module", params=PRESETS)
def preset(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def truth(preset: str) -> Iterator[Truth]:
    with open_simulated(preset=preset, inline=True) as rig:
        assert rig.truth is not None
        yield rig.truth


@pytest.fixture(scope="module")
def calibration(preset: str) -> Calibration:
    return load_calibration(SHIPPED / f"sim-{preset}.json")


def test_it_was_measured_by_the_procedures(calibration: Calibration, preset: str) -> None:
    assert (calibration.rig_id, calibration.origin) == (f"sim-{preset}", "measured")
    assert calibration.session_id is not None


def test_eyes_point_match_rows_and_range_within_the_goals(calibration: Calibration, truth: Truth) -> None:
    figures = judge(CalibrationModel(calibration), truth, seed=5, count=80)
    assert figures["poses"] == 80
    assert figures["pointing_rms_px"] <= 2.0
    assert figures["pointing_p95_px"] <= 4.0
    assert figures["epipolar_rms_px"] <= 0.3
    assert figures["epipolar_p95_px"] <= 0.8
    for distance_m, goal in ((5, 0.003), (10, 0.005), (15, 0.008)):
        assert figures[f"depth_bias_rel_{distance_m}m"] <= goal


def test_a_field_of_nine_degrees_is_reached(calibration: Calibration) -> None:
    ax_deg, ay_deg = np.rad2deg(np.abs(calibration.left.mirror.hull_rad).max(axis=0))
    assert ax_deg >= 9.0
    assert ay_deg >= 7.9  # +-170 V reach no farther down, as on the published rig


@pytest.mark.parametrize("distance_m", [2.5, 5.0, 15.0])
def test_disparities_are_within_the_stated_error(
    calibration: Calibration, truth: Truth, distance_m: float
) -> None:
    poses = random_poses(
        CalibrationModel(calibration), truth, rng=np.random.default_rng(6), count=40, distance_m=distance_m
    )
    errors = depth_errors(CalibrationModel(calibration), truth, poses)
    depths = np.array([pose.point_rig_m[2] for pose in poses])
    missed_px = errors * calibration.fovea_f_px * calibration.baseline_m / depths
    stated_px = calibration.pose_sigma_px(distance_m)
    assert np.mean(np.abs(missed_px) < 3.0 * stated_px) >= 0.95
    assert stated_px < 2.0  # nor is the statement timid


def test_the_wide_lens_is_known_to_a_fraction_of_a_pixel(calibration: Calibration, truth: Truth) -> None:
    assert wide_rms_px(calibration, truth) < 0.15


def test_volts_come_back_from_angles_to_a_step_of_the_dac(calibration: Calibration) -> None:
    assert roundtrip_lsb(calibration) < 1e-3


def test_the_eyes_are_not_taken_for_each_other(calibration: Calibration, truth: Truth) -> None:
    for role in (Role.LEFT, Role.RIGHT):
        offset_m = calibration.pivot_rig_m(role) - truth.pivot(role)
        assert math.sqrt(float(offset_m @ offset_m)) < 1e-3
