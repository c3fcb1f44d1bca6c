"""The fit of a whole rig from a sweep: pivots, pupil, baseline, orders, refusals."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.fit.fit import PIVOT_TOLERANCE_M, fit_calibration
from foveacam_pipeline.calibrate.fit.pivot import fit_pivot
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, RigSweep
from foveacam_pipeline.models import Calibration, Intrinsics

F_PX = 28_760.0
WIDTH, HEIGHT = 1440, 1080
CENTRE = np.array([719.5, 539.5])
BOARD_PX = np.array([(u, v) for v in (-400.0, 0.0, 400.0) for u in (-550.0, 0.0, 550.0)])
WIDE = Intrinsics(width=WIDTH, height=HEIGHT, fx_px=3155.0, fy_px=3155.0, cx_px=719.5, cy_px=539.5)


@dataclass(frozen=True, kw_only=True)
class Eye:
    """An eye whose camera only rolls: enough to tell pivot, pupil and homography apart."""

    pivot_m: tuple[float, float, float]
    side: float
    pupil_m: float = 0.035

    def gaze_rad(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y = np.deg2rad(0.058) * volts[:, 0], np.deg2rad(0.051) * volts[:, 1]
        return np.column_stack([x - 2.0 * x**3 + self.side * 0.3 * y**2, y - self.side * 0.2 * x * y + 1e-3])

    def look(
        self, volts: NDArray[np.float64], depth_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the points (n, 3) at Z = `depth_m` that the image centre sees, and the board's raw px."""
        tangents = np.tan(self.gaze_rad(volts))
        pivot = np.array(self.pivot_m)
        middle = np.column_stack([pivot[:2] + (depth_m - pivot[2]) * tangents, np.full(len(volts), depth_m)])
        forward = np.column_stack([tangents, np.ones(len(volts))])
        unit = forward / np.linalg.norm(forward, axis=1, keepdims=True)
        reach_m = depth_m - pivot[2] + self.pupil_m * unit[:, 2]
        raw = []
        for z_m, (ax, ay) in zip(reach_m, self.gaze_rad(volts), strict=True):
            roll = 0.8 * ax - 0.2 * self.side * ay
            turn = np.array([[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]])
            raw.append(CENTRE + (BOARD_PX * depth_m / z_m) @ turn.T)
        return middle, np.array(raw)


LEFT = Eye(pivot_m=(-0.1003, 0.0002, 0.0001), side=-1.0)
RIGHT = Eye(pivot_m=(0.0998, -0.0003, 0.0002), side=1.0)


def eye_sweep(eye: Eye, depths_m: tuple[float, ...], *, seed: int, side: int = 13) -> EyeSweep:
    line = np.linspace(-168.0, 168.0, side)
    grid = np.array([(x, y) for y in line for x in line])
    rng = np.random.default_rng(seed)
    reference = np.array([math.copysign(0.1, eye.pivot_m[0]), 0.0, 0.0])
    angles, raw = [], []
    for depth_m in depths_m:
        middle, corners = eye.look(grid, depth_m)
        angles.append(np.arctan((middle - reference)[:, :2] / depth_m))
        raw.append(corners)
    all_angles, all_raw = np.vstack(angles), np.concatenate(raw)
    return EyeSweep(
        volts_v=np.tile(grid, (len(depths_m), 1)),
        angles_rad=all_angles + np.deg2rad(0.005) * rng.standard_normal(all_angles.shape),
        depth_m=np.repeat(depths_m, len(grid)),
        raw_px=all_raw + 0.3 * rng.standard_normal(all_raw.shape),
        plane_px=np.broadcast_to(BOARD_PX, all_raw.shape).copy(),
    )


def rig_sweep(depths_m: tuple[float, ...]) -> RigSweep:
    return RigSweep(
        rig_id="bench-3",
        created_utc="2026-01-31T12:00:00+00:00",
        origin="measured",
        label="two boards",
        wide=WIDE,
        left=eye_sweep(LEFT, depths_m, seed=1),
        right=eye_sweep(RIGHT, depths_m, seed=2),
        baseline_m=0.2,
        fovea_f_px=F_PX,
        fovea_width=WIDTH,
        fovea_height=HEIGHT,
        pupil_m=0.04,
    )


@pytest.fixture(scope="module")
def two_depths() -> Calibration:
    return fit_calibration(rig_sweep((2.5, 10.0)))


@pytest.fixture(scope="module")
def one_depth() -> Calibration:
    return fit_calibration(rig_sweep((6.0,)))


def test_two_depths_measure_baseline_pivots_and_pupil(two_depths: Calibration) -> None:
    calibration = two_depths
    sigma_m = calibration.left.pivot_sigma_m
    # 0.005 deg over sqrt(169) poses a depth, over 1/2.5 - 1/10 per metre: 0.03 mm.
    assert sigma_m == pytest.approx(math.radians(0.005) / 13 * math.sqrt(2) / 0.3, rel=0.3)
    assert calibration.baseline_m == pytest.approx(0.2001, abs=3 * math.sqrt(2) * sigma_m)
    for role, eye in ((Role.LEFT, LEFT), (Role.RIGHT, RIGHT)):
        missed = calibration.pivot_rig_m(role) - np.array(eye.pivot_m)
        assert np.abs(missed[:2]).max() < 3 * sigma_m
        assert np.abs(missed[2]) < 30 * sigma_m  # seen ten times less: by the tangent of the gaze
    # 0.3 px corners leave the scale of a board known to 1e-5: 0.05 mm of pupil over the two depths.
    assert calibration.pupil_m == pytest.approx(0.035, abs=0.3e-3)


@pytest.mark.parametrize("z_m", [-0.008, 0.008])
def test_a_pivot_behind_or_before_the_drawing_is_found_there(z_m: float) -> None:
    found = fit_pivot(eye_sweep(Eye(pivot_m=(-0.1, 0.0, z_m), side=-1.0), (2.5, 10.0), seed=1))
    assert found.offset_m[2] == pytest.approx(z_m, abs=30 * found.sigma_m)  # less than a millimetre
    assert found.sigma_m < 0.04e-3


def test_gaze_is_that_from_the_pivot_whatever_the_depth_of_the_target(two_depths: Calibration) -> None:
    unseen = np.random.default_rng(9).uniform(-160, 160, (200, 2))
    for role, eye in ((Role.LEFT, LEFT), (Role.RIGHT, RIGHT)):
        errors = two_depths.eye(role).mirror.angles_of(unseen) - eye.gaze_rad(unseen)
        assert np.sqrt(np.mean(errors**2)) < math.radians(0.002)  # sqrt(k / n) of the noise of one sample


def test_one_depth_keeps_the_drawing_and_says_how_far_it_is_trusted(one_depth: Calibration) -> None:
    assert one_depth.baseline_m == 0.2
    assert one_depth.pupil_m == 0.04
    assert one_depth.left.pivot_offset_m == (0.0, 0.0, 0.0)
    assert one_depth.left.pivot_sigma_m == PIVOT_TOLERANCE_M
    assert one_depth.left.reference_depth_m == pytest.approx(6.0)
    # the mirror's scatter of 0.005 degrees is part of both
    assert one_depth.pose_sigma_px(2.0) > 1.7 * one_depth.pose_sigma_px(6.0)


def test_orders_follow_the_law_not_the_noise(one_depth: Calibration) -> None:
    assert one_depth.left.mirror.forward.order in (3, 4)  # the law is a cubic
    assert one_depth.left.homography.polynomial.order in (2, 3)  # a small roll: sine and cosine


def test_the_calibration_says_where_it_comes_from(one_depth: Calibration) -> None:
    assert (one_depth.rig_id, one_depth.origin, one_depth.label) == (
        "bench-3",
        "measured",
        "two boards",
    )
    assert one_depth.wide == WIDE


def test_a_sweep_of_unequal_lengths_is_refused() -> None:
    whole = eye_sweep(LEFT, (6.0,), seed=1, side=4)
    with pytest.raises(InvalidInput, match="sweep of 16 poses"):
        EyeSweep(
            volts_v=whole.volts_v,
            angles_rad=whole.angles_rad[:-1],
            depth_m=whole.depth_m,
            raw_px=whole.raw_px,
            plane_px=whole.plane_px,
        )


def test_a_target_without_depth_is_refused() -> None:
    whole = eye_sweep(LEFT, (6.0,), seed=1, side=4)
    with pytest.raises(InvalidInput, match="depth above 0 m"):
        EyeSweep(
            volts_v=whole.volts_v,
            angles_rad=whole.angles_rad,
            depth_m=np.zeros(16),
            raw_px=whole.raw_px,
            plane_px=whole.plane_px,
        )
