"""How well a calibration predicts the simulated rig: angles, rectified pixels, rows, distances.

Everything is compared with the simulation's truth at volts, pixels and depths that the fit has not seen.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role, StereoVolts
from foveacam_hardware.sim.optics import View
from foveacam_pipeline.geometry import angles_from_rays, homography_apply
from foveacam_pipeline.models import Calibration, eye_volts

DISTANCES_M = (2.0, 5.0, 10.0, 20.0)
_EYES = (Role.LEFT, Role.RIGHT)


class Truth(Protocol):
    """What the check asks of the simulation."""

    def static_projection(self, role: Role, volts: MirrorVolts) -> View:
        """Return an eye's projection with its mirror at rest under `volts`."""
        ...

    def wide_rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit rays (n, 3), rig frame, of raw wide px (n, 2)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """One verged pair of eyes at a random target."""

    volts: StereoVolts
    point_rig_m: NDArray[np.float64]
    distance_m: float

    @property
    def depth_m(self) -> float:
        """Z of the target, m."""
        return float(self.point_rig_m[2])


def gaze_errors_rad(
    calibration: Calibration, truth: Truth, role: Role, *, rng: np.random.Generator, count: int
) -> NDArray[np.float64]:
    """Return (count, 2) predicted minus true gaze, rad, at random volts of the calibrated range."""
    mirror = calibration.eye(role).mirror
    volts = rng.uniform(-0.98, 0.98, (count, 2)) * np.array(mirror.max_v)
    rays = []
    for x_v, y_v in volts.tolist():
        view = truth.static_projection(role, MirrorVolts(x_v=x_v, y_v=y_v))
        rays.append(view.direction((calibration.fovea_width - 1) / 2, (calibration.fovea_height - 1) / 2))
    return mirror.angles_of(volts) - angles_from_rays(np.array(rays))


def wide_errors_px(
    calibration: Calibration, truth: Truth, *, rng: np.random.Generator, count: int
) -> NDArray[np.float64]:
    """Return (count, 2) predicted minus true wide px, at random px of the image."""
    pixels = rng.uniform(
        [-0.5, -0.5], [calibration.wide.width - 0.5, calibration.wide.height - 0.5], (count, 2)
    )
    return calibration.wide.pixels(angles_from_rays(truth.wide_rays(pixels))) - pixels


def random_looks(
    calibration: Calibration, *, distance_m: float, rng: np.random.Generator, count: int
) -> list[Look]:
    """Return `count` looks, steered by the calibration, at random targets within its reach."""
    ax_min, ax_max, ay_min, ay_max = calibration.reach_rad()
    aside = calibration.baseline_m / 2.0 / distance_m  # the eyes turn by so much from the wide direction
    looks: list[Look] = []
    for ax_rad, ay_rad in rng.uniform(
        [ax_min + aside, ay_min], [ax_max - aside, ay_max], (count, 2)
    ).tolist():
        direction = np.array([math.tan(ax_rad), math.tan(ay_rad), 1.0])
        point = distance_m * direction / np.linalg.norm(direction)
        volts = calibration.steer(ax_rad, ay_rad, distance_m=distance_m)
        looks.append(Look(volts=volts, point_rig_m=point, distance_m=distance_m))
    return looks


def plane_px(
    calibration: Calibration, role: Role, volts: StereoVolts, *, raw_px: NDArray[np.float64], depth_m: float
) -> NDArray[np.float64]:
    """Return where the calibration puts raw px (n, 2) on an eye's virtual pinhole plane, (n, 2) px."""
    ax_rad, ay_rad = calibration.eye(role).mirror.angles_rad(eye_volts(volts, role))
    homography = calibration.rectification(role, ax_rad, ay_rad, depth_m=depth_m)
    gaze = calibration.fovea_f_px * np.array([math.tan(ax_rad), math.tan(ay_rad)])
    return np.asarray(gaze + homography_apply(homography, raw_px), dtype=np.float64)


def rectification_errors_px(
    calibration: Calibration, truth: Truth, look: Look, *, rng: np.random.Generator, count: int
) -> NDArray[np.float64]:
    """Return (2, count, 2) placed minus true plane px of common points, left then right eye.

    The points lie on the plane Z = the target's, where the left fovea sees random pixels.
    """
    left = truth.static_projection(Role.LEFT, look.volts.left)
    size = calibration.fovea_width - 1.0, calibration.fovea_height - 1.0
    rays = np.array([left.direction(x, y) for x, y in rng.uniform((0.0, 0.0), size, (count, 2)).tolist()])
    points = left.centre_m + (look.depth_m - left.centre_m[2]) / rays[:, 2:] * rays
    errors = []
    for role in _EYES:
        raw = truth.static_projection(role, eye_volts(look.volts, role)).pixels(points)
        placed = plane_px(calibration, role, look.volts, raw_px=raw, depth_m=look.depth_m)
        seen = points - calibration.reference_rig_m(role)
        errors.append(placed - calibration.fovea_f_px * seen[:, :2] / seen[:, 2:])
    return np.array(errors)


def distance_error_m(calibration: Calibration, truth: Truth, look: Look) -> tuple[float, float]:
    """Return measured minus true distance and its stated standard error, m, of a target found exactly.

    The target's pixel in each fovea is the true one, so that the calibration alone errs.
    """
    meeting = calibration.meeting(look.volts)
    planes = []
    for role in _EYES:
        view = truth.static_projection(role, eye_volts(look.volts, role))
        raw = view.pixels(look.point_rig_m[None, :])
        planes.append(
            plane_px(calibration, role, look.volts, raw_px=raw, depth_m=float(meeting.point_m[2]))[0]
        )
    disparity = float(planes[0][0] - planes[1][0])
    z_m = calibration.fovea_f_px * calibration.baseline_m / disparity
    point = np.array([*(planes[0] / calibration.fovea_f_px * z_m), z_m]) + calibration.reference_rig_m(
        Role.LEFT
    )
    slope = look.distance_m / look.depth_m
    sigma = z_m**2 / (calibration.fovea_f_px * calibration.baseline_m) * calibration.pose_sigma_px(z_m)
    return float(np.linalg.norm(point)) - look.distance_m, slope * sigma


def assess(
    calibration: Calibration, truth: Truth, *, seed: int, looks: int = 60, pixels: int = 20
) -> dict[str, float]:
    """Return the figures of a calibration; keys carry their units."""
    rng = np.random.default_rng(seed)
    figures = {"wide_rms_px": _rms(wide_errors_px(calibration, truth, rng=rng, count=5 * looks))}
    for role in _EYES:
        errors = np.rad2deg(gaze_errors_rad(calibration, truth, role, rng=rng, count=5 * looks))
        figures[f"{role}_gaze_rms_deg"] = _rms(errors)
        figures[f"{role}_gaze_sigma_deg"] = math.degrees(
            math.hypot(*calibration.eye(role).mirror.sigma_rad) / math.sqrt(2.0)
        )
        figures[f"{role}_mirror_order"] = calibration.eye(role).mirror.forward.order
        figures[f"{role}_homography_order"] = calibration.eye(role).homography.polynomial.order
        figures[f"{role}_homography_loo_px"] = calibration.eye(role).homography.loo_px
    for distance_m in DISTANCES_M:
        figures |= _figures_at(calibration, truth, distance_m, rng=rng, looks=looks, pixels=pixels)
    return figures


def _figures_at(
    calibration: Calibration,
    truth: Truth,
    distance_m: float,
    *,
    rng: np.random.Generator,
    looks: int,
    pixels: int,
) -> dict[str, float]:
    placed, distances = [], []
    for look in random_looks(calibration, distance_m=distance_m, rng=rng, count=looks):
        placed.append(rectification_errors_px(calibration, truth, look, rng=rng, count=pixels))
        distances.append(distance_error_m(calibration, truth, look))
    errors, ranges = np.array(placed), np.array(distances)
    within = errors - errors.mean(axis=2, keepdims=True)
    name = f"at_{distance_m:g}_m"
    return {
        f"rectification_rms_px_{name}": _rms(errors),
        f"rectification_within_image_rms_px_{name}": _rms(within),
        f"epipolar_rms_px_{name}": _rms(errors[:, 0, :, 1] - errors[:, 1, :, 1]),
        f"epipolar_sigma_px_{name}": calibration.epipolar_sigma_px(distance_m),
        f"distance_rms_m_{name}": _rms(ranges[:, 0]),
        f"distance_sigma_m_{name}": float(np.median(ranges[:, 1])),
    }


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
