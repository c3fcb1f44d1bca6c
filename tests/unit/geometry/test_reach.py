"""Outlines of where each eye can look, against the mirrors' own domain."""

import math

import numpy as np
import pytest

from foveacam_hardware.contract import OutOfRange, Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.models.reach import outline_margin_px, reach_outline_px
from foveacam_pipeline.verge.aim import aim_at
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

EDGE_PX = 6.0
"""The domain has a margin beyond its hull (0.1 degrees are 5.5 px); nearer to the outline either may hold."""


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
@pytest.mark.parametrize("z_m", [math.inf, 2.0])
def test_outline_holds_what_the_mirror_can_look_at(calibration: Calibration, role: Role, z_m: float) -> None:
    rng = np.random.default_rng(5)
    points_px = rng.uniform([0.0, 0.0], [1440.0, 1080.0], (300, 2))
    tangents = np.tan(calibration.wide.angles_rad(points_px))
    judged = 0
    for point_px, target in zip(points_px, tangents, strict=True):
        distance_m = z_m * math.sqrt(1.0 + float(target @ target))
        outline_px = reach_outline_px(calibration, role, distance_m=distance_m)
        margin_px = float(outline_margin_px(outline_px, point_px[None])[0])
        if abs(margin_px) < EDGE_PX:
            continue
        judged += 1
        gaze_rad = np.arctan(aim_at(calibration, target, 1.0 / z_m).eye(role))
        assert calibration.eye(role).mirror.contains(*gaze_rad.tolist()) == (margin_px > 0.0)
    assert judged > 0.9 * len(points_px)


def test_near_targets_are_reached_less_far_to_the_other_side(calibration: Calibration) -> None:
    far_px, near_px = (reach_outline_px(calibration, Role.LEFT, distance_m=d) for d in (math.inf, 1.0))
    shift_px = far_px[:, 0].max() - near_px[:, 0].max()
    assert shift_px == pytest.approx(0.1 * calibration.wide.fx_px, rel=0.05)  # 0.1 m of baseline at 1 m


def test_distance_nearer_than_the_eye_is_refused(calibration: Calibration) -> None:
    with pytest.raises(OutOfRange, match="nearer than the eye"):
        reach_outline_px(calibration, Role.LEFT, distance_m=0.05)
