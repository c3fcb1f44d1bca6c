"""Judge a calibration by the simulation's truth: pointing, rectification and depth at poses not measured.

Our model and the paper's are judged in the same way. `bench calibration` prints the result.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.judging import rms
from foveacam_hardware.contract import MirrorVolts, OutOfRange, Role, StereoVolts
from foveacam_hardware.sim.optics import FOVEA_HEIGHT, FOVEA_WIDTH, EyeProjection
from foveacam_pipeline.geometry import homography_apply
from foveacam_pipeline.models import Calibration, Intrinsics, eye_volts

EYES = (Role.LEFT, Role.RIGHT)
CENTRE_PX = np.array([(FOVEA_WIDTH - 1) / 2, (FOVEA_HEIGHT - 1) / 2])
FIELD_DEG = 9.0
NEAREST_M, FARTHEST_M = 2.5, 30.0
COMMON_POINTS = 20
TRIES = 40


class TruthQueries(Protocol):
    """The queries to the simulation that judging needs."""

    def static_projection(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        """Return an eye's projection with its mirror at rest under `volts`; with the drift of `t_ns`."""
        ...

    def wide_rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit rays (n, 3), rig frame, of raw wide px (n, 2)."""
        ...


@dataclass(frozen=True, slots=True)
class TruthAtMoment:
    """The truth at one moment, since the mounts drift."""

    truth: TruthQueries
    t_ns: int

    def static_projection(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        """Return an eye's projection with the drift of that moment, or of `t_ns`."""
        return self.truth.static_projection(role, volts, t_ns=self.t_ns if t_ns is None else t_ns)

    def wide_rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit rays (n, 3), rig frame, of raw wide px (n, 2)."""
        return self.truth.wide_rays(pixels)


class JudgedModel(Protocol):
    """A calibrated model of the rig, ours or another."""

    @property
    def wide(self) -> Intrinsics:
        """The wide camera."""
        ...

    @property
    def fovea_f_px(self) -> float:
        """Focal length of the virtual pinholes, px."""
        ...

    @property
    def baseline_m(self) -> float:
        """Distance of the eyes' reference points, m."""
        ...

    def steer(self, ax_rad: float, ay_rad: float, *, distance_m: float) -> StereoVolts:
        """Return the volts with which both eyes look at a direction and distance from the rig's origin."""
        ...

    def plane_px(
        self, role: Role, volts: StereoVolts, *, raw_px: NDArray[np.float64], depth_m: float
    ) -> NDArray[np.float64]:
        """Return (n, 2) positions of raw px (n, 2) on an eye's virtual pinhole plane, px."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationModel:
    """A `Calibration` as a `JudgedModel`."""

    calibration: Calibration

    @property
    def wide(self) -> Intrinsics:
        """The wide camera."""
        return self.calibration.wide

    @property
    def fovea_f_px(self) -> float:
        """Focal length of the virtual pinholes, px."""
        return self.calibration.fovea_f_px

    @property
    def baseline_m(self) -> float:
        """Distance of the eyes' reference points, m."""
        return self.calibration.baseline_m

    def steer(self, ax_rad: float, ay_rad: float, *, distance_m: float) -> StereoVolts:
        """Return the volts for a target."""
        return self.calibration.steer(ax_rad, ay_rad, distance_m=distance_m)

    def plane_px(
        self, role: Role, volts: StereoVolts, *, raw_px: NDArray[np.float64], depth_m: float
    ) -> NDArray[np.float64]:
        """Return positions on the virtual pinhole plane."""
        ax_rad, ay_rad = self.calibration.eye(role).mirror.angles_rad(eye_volts(volts, role))
        homography = self.calibration.rectification(role, ax_rad, ay_rad, depth_m=depth_m)
        gaze = self.fovea_f_px * np.array([math.tan(ax_rad), math.tan(ay_rad)])
        return np.asarray(gaze + homography_apply(homography, raw_px), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedPose:
    """A target that a wide pixel shows, and the volts with which a model looks at it."""

    point_rig_m: NDArray[np.float64]
    distance_m: float
    volts: StereoVolts


def random_poses(
    model: JudgedModel,
    truth: TruthQueries,
    *,
    rng: np.random.Generator,
    count: int,
    distance_m: float | None = None,
) -> list[JudgedPose]:
    """Return targets at random wide pixels within ±9 degrees that both eyes can reach."""
    limit = math.radians(FIELD_DEG)
    low, high = model.wide.pixels([[-limit, -limit], [limit, limit]]).tolist()
    poses: list[JudgedPose] = []
    for _ in range(TRIES * count):
        if len(poses) == count:
            break
        pixel = rng.uniform(low, high)
        far_m = distance_m or math.exp(rng.uniform(math.log(NEAREST_M), math.log(FARTHEST_M)))
        ax_rad, ay_rad = model.wide.angles_rad(pixel[None])[0].tolist()
        try:
            volts = model.steer(ax_rad, ay_rad, distance_m=far_m)
        except OutOfRange:
            continue
        point = far_m * truth.wide_rays(pixel[None])[0]
        poses.append(JudgedPose(point_rig_m=point, distance_m=far_m, volts=volts))
    return poses


def pointing_errors_px(
    truth: TruthQueries, poses: list[JudgedPose], *, t_ns: int | None = None
) -> NDArray[np.float64]:
    """Return (n, 2 eyes, 2) true offsets of the targets from each fovea's image centre, px."""
    errors = [
        [
            truth.static_projection(role, eye_volts(pose.volts, role), t_ns=t_ns).pixels(
                pose.point_rig_m[None]
            )[0]
            - CENTRE_PX
            for role in EYES
        ]
        for pose in poses
    ]
    return np.array(errors)


def epipolar_errors_px(
    model: JudgedModel, truth: TruthQueries, poses: list[JudgedPose], *, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return (n, m) differences of rows, left minus right, of points seen by both rectified foveae, px."""
    return np.array([_rows_apart(model, truth, pose, rng=rng) for pose in poses])


def _rows_apart(
    model: JudgedModel, truth: TruthQueries, pose: JudgedPose, *, rng: np.random.Generator
) -> NDArray[np.float64]:
    depth_m = float(pose.point_rig_m[2])
    left = truth.static_projection(Role.LEFT, pose.volts.left)
    pixels = rng.uniform((0.0, 0.0), 2.0 * CENTRE_PX, (COMMON_POINTS, 2))
    rays = np.array([left.direction(x, y) for x, y in pixels.tolist()])
    points = left.centre_m + (depth_m - left.centre_m[2]) / rays[:, 2:] * rays
    rows = []
    for role in EYES:
        raw = truth.static_projection(role, eye_volts(pose.volts, role)).pixels(points)
        rows.append(model.plane_px(role, pose.volts, raw_px=raw, depth_m=depth_m)[:, 1])
    return np.asarray(rows[0] - rows[1], dtype=np.float64)


def depth_errors(model: JudgedModel, truth: TruthQueries, poses: list[JudgedPose]) -> NDArray[np.float64]:
    """Return (n,) relative errors of Z of targets whose pixels in both foveae are known exactly."""
    errors = []
    for pose in poses:
        depth_m = float(pose.point_rig_m[2])
        columns = []
        for role in EYES:
            raw = truth.static_projection(role, eye_volts(pose.volts, role)).pixels(pose.point_rig_m[None])
            columns.append(model.plane_px(role, pose.volts, raw_px=raw, depth_m=depth_m)[0, 0])
        found_m = model.fovea_f_px * model.baseline_m / float(columns[0] - columns[1])
        errors.append(found_m / depth_m - 1.0)
    return np.array(errors)


def judge(model: JudgedModel, truth: TruthQueries, *, seed: int, count: int) -> dict[str, float]:
    """Return the figures of a model at `count` poses; pointing: distance of each eye's error, fovea px."""
    rng = np.random.default_rng(seed)
    poses = random_poses(model, truth, rng=rng, count=count)
    misses = np.linalg.norm(pointing_errors_px(truth, poses), axis=2)
    rows = epipolar_errors_px(model, truth, poses, rng=rng)
    figures = {
        "poses": len(poses),
        "pointing_rms_px": rms(misses),
        "pointing_p95_px": float(np.quantile(misses, 0.95)),
        "epipolar_rms_px": rms(rows),
        "epipolar_p95_px": float(np.quantile(np.abs(rows), 0.95)),
    }
    for distance_m in (5, 10, 15):
        at = random_poses(model, truth, rng=rng, count=count // 2, distance_m=float(distance_m))
        errors = depth_errors(model, truth, at)
        figures[f"depth_bias_rel_{distance_m}m"] = abs(float(np.mean(errors)))
        figures[f"depth_rms_rel_{distance_m}m"] = rms(errors)
    return figures
