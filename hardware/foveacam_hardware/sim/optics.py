"""Optics from first principles: the eyes, telephoto pinholes behind tilting mirrors, and the wide lens.

Image rotation, keystone, anamorphism and pupil walk follow from the geometry and are not modelled apart.
Frame: rig (OpenCV axes, metres). Volts are converted in `mirror`; scenes belong to `world`.
"""

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Role
from foveacam_hardware.sim.render.projection import Projection, RayTable

Vector: TypeAlias = NDArray[np.float64]
"""(3,) float64, rig frame."""
Matrix: TypeAlias = NDArray[np.float64]
"""(3, 3) float64."""
FOVEA_WIDTH = 1440
FOVEA_HEIGHT = 1080
FOVEA_FOCAL_PX = 28_760.0  # Table 2: 2.86 deg over 1440 px, a 100 mm lens on 3.45 um pixels
PUPIL_BEFORE_MIRROR_M = 0.040  # deduced: the paper's pupil lies a few centimetres behind the mirror
HALF_BASELINE_M = 0.1  # Table 2: the mirrors are 0.2 m apart
FORWARD: Vector = np.array([0.0, 0.0, 1.0])
READOUT_FLIP: Matrix = np.diag([-1.0, 1.0, 1.0])
"""The sensor is read out from right to left, which cancels the mirror's reversal of the image."""
WIDE_WIDTH = 1440
WIDE_HEIGHT = 1080
WIDE_FOCAL_PX = 3155.0  # Table 2: 25.6 x 19.4 deg over 1440 x 1080 px


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeAssembly:
    """Positions of one eye's parts, and their errors against the nominal design.

    `pivot_m`: centre of the mirror, rig frame. `camera_turn_rad`: error of the camera's axis about its own
    x, y and z (roll). `mirror_turn_rad`: error of the mirror's mounting about the rig's x and y.
    `axis_offset_m`: distance of the camera's axis from the pivot, along the camera's x and y.
    """

    role: Role
    pivot_m: tuple[float, float, float]
    camera_turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mirror_turn_rad: tuple[float, float] = (0.0, 0.0)
    axis_offset_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeProjection:
    """A pinhole projection: pixel ~ matrix @ (X - centre), X in the rig frame, metres."""

    matrix: Matrix
    centre_m: Vector

    def pixels(self, points_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Project (n, 3) float64 points of the rig frame to (n, 2) px."""
        rays = (points_rig_m - self.centre_m) @ self.matrix.T
        return np.asarray(rays[:, :2] / rays[:, 2:], dtype=np.float64)

    def direction(self, x_px: float, y_px: float) -> Vector:
        """Return the unit ray (3,) of a pixel, from the pupil into the world, rig frame."""
        ray = np.linalg.solve(self.matrix, np.array([x_px, y_px, 1.0]))
        ray *= np.sign(np.linalg.det(self.matrix))
        return np.asarray(ray / np.linalg.norm(ray), dtype=np.float64)


def rotation(turn_rad: Vector) -> Matrix:
    """Return the rotation by a rotation vector (3,), radians (Rodrigues)."""
    angle_rad = float(np.linalg.norm(turn_rad))
    if angle_rad == 0.0:
        return np.eye(3)
    x, y, z = turn_rad / angle_rad
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross, dtype=np.float64
    )


def reflection(normal: Vector) -> Matrix:
    """Return I - 2 n n^T for a unit normal (3,)."""
    return np.asarray(np.eye(3) - 2.0 * np.outer(normal, normal), dtype=np.float64)


def nominal_assembly(role: Role) -> EyeAssembly:
    """Return the eye of the nominal design, without assembly errors."""
    return EyeAssembly(role=role, pivot_m=(_side(role) * HALF_BASELINE_M, 0.0, 0.0))


def built_assembly(role: Role, *, seed: int) -> EyeAssembly:
    """Return an eye with assembly errors of tenths of a degree and of a millimetre, by seed."""
    rng = np.random.default_rng([seed, 1 if role is Role.LEFT else 2, 0xF01D])
    errors_m = rng.uniform(-0.2e-3, 0.2e-3, 3)
    turn_rad = np.deg2rad(rng.uniform(-1.0, 1.0, 3) * np.array([0.15, 0.15, 0.3]))
    mounting_rad = np.deg2rad(rng.uniform(-0.1, 0.1, 2))
    offset_m = rng.uniform(-0.3e-3, 0.3e-3, 2)
    nominal = np.array(nominal_assembly(role).pivot_m)
    px, py, pz = (nominal + errors_m).tolist()
    cx, cy, cz = turn_rad.tolist()
    return EyeAssembly(
        role=role,
        pivot_m=(px, py, pz),
        camera_turn_rad=(cx, cy, cz),
        mirror_turn_rad=(float(mounting_rad[0]), float(mounting_rad[1])),
        axis_offset_m=(float(offset_m[0]), float(offset_m[1])),
    )


class FoldedEye:
    """One telephoto camera and its mirror; `view` returns its projection for any tilt of the mirror."""

    def __init__(self, assembly: EyeAssembly) -> None:
        self.assembly = assembly
        self.pivot_m: Vector = np.array(assembly.pivot_m)
        # The left camera looks left, the right one right, each at a mirror that folds its axis forward.
        axis = np.array([float(_side(assembly.role)), 0.0, 0.0])
        nominal_normal = (FORWARD - axis) / np.sqrt(2.0)
        mounting = rotation(np.array([*assembly.mirror_turn_rad, 0.0]))
        self._normal = mounting @ nominal_normal
        self._outer = mounting @ np.array([0.0, 1.0, 0.0])
        nominal_camera_from_rig = READOUT_FLIP @ reflection(nominal_normal)
        self._camera_from_rig = rotation(np.array(assembly.camera_turn_rad)) @ nominal_camera_from_rig
        offset_m = np.array([*assembly.axis_offset_m, -PUPIL_BEFORE_MIRROR_M])
        self._pupil_m = self.pivot_m + self._camera_from_rig.T @ offset_m
        self._k = np.array(
            [
                [FOVEA_FOCAL_PX, 0.0, (FOVEA_WIDTH - 1) / 2],
                [0.0, FOVEA_FOCAL_PX, (FOVEA_HEIGHT - 1) / 2],
                [0.0, 0.0, 1.0],
            ]
        )

    def normal(self, tilt_x_rad: float, tilt_y_rad: float) -> Vector:
        """Return the mirror's unit normal; the gimbal's outer axis is vertical, its inner axis horizontal.

        `tilt_x_rad` > 0 turns the gaze to the right, `tilt_y_rad` > 0 turns it down.
        """
        inner = self._normal * np.cos(tilt_y_rad) + self._outer * np.sin(tilt_y_rad)
        return np.asarray(rotation(self._outer * tilt_x_rad) @ inner, dtype=np.float64)

    def view(
        self, tilt_x_rad: float, tilt_y_rad: float, *, mount_turn_rad: Vector | None = None
    ) -> EyeProjection:
        """Return the projection K R0 (I - 2 n n^T) from the reflected pupil.

        `mount_turn_rad`: (3,) rotation of camera and mirror together about the pivot (drift), rig axes.
        """
        mirror = reflection(self.normal(tilt_x_rad, tilt_y_rad))
        mount = np.eye(3) if mount_turn_rad is None else rotation(mount_turn_rad)
        matrix = self._k @ READOUT_FLIP @ self._camera_from_rig @ mirror @ mount.T
        centre_m = self.pivot_m + mount @ mirror @ (self._pupil_m - self.pivot_m)
        return EyeProjection(matrix=matrix, centre_m=centre_m)


def _side(role: Role) -> int:
    if role is Role.WIDE:
        raise ValueError("the wide camera has no mirror; asked for the assembly of an eye")
    return -1 if role is Role.LEFT else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class WideLens:
    """The wide lens: undistorted radius = distorted radius / (1 + bend radius^2), radii in tangents.

    This division model differs on purpose from the polynomial that a calibration fits.
    """

    focal_px: float = WIDE_FOCAL_PX
    centre_x_px: float = (WIDE_WIDTH - 1) / 2 + 3.4
    centre_y_px: float = (WIDE_HEIGHT - 1) / 2 - 2.1
    bend: float = -0.06

    def undistorted_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the ideal pinhole's pixels (n, 2) of raw pixels (n, 2)."""
        offset = (pixels - np.array([self.centre_x_px, self.centre_y_px])) / self.focal_px
        radius2 = np.sum(offset**2, axis=-1, keepdims=True)
        straight = offset / (1.0 + self.bend * radius2)
        return np.asarray(straight * self.focal_px + np.array([self.centre_x_px, self.centre_y_px]))

    def distorted_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the raw pixels (n, 2) of ideal pinhole pixels (n, 2), the inverse of `undistorted_px`."""
        offset = (pixels - np.array([self.centre_x_px, self.centre_y_px])) / self.focal_px
        radius2 = np.sum(offset**2, axis=-1, keepdims=True)
        bent = offset * 2.0 / (1.0 + np.sqrt(1.0 - 4.0 * self.bend * radius2))
        return np.asarray(bent * self.focal_px + np.array([self.centre_x_px, self.centre_y_px]))

    def matrix(self) -> NDArray[np.float64]:
        """Return the camera matrix (3, 3) of the undistorted image."""
        return np.array(
            [[self.focal_px, 0.0, self.centre_x_px], [0.0, self.focal_px, self.centre_y_px], [0.0, 0.0, 1.0]]
        )


@cache
def wide_projections(lens: WideLens) -> dict[Binning, Projection]:
    """Return the wide camera's projection by binning, with the undistorted pixel of every raw pixel."""
    x, y = np.meshgrid(np.arange(WIDE_WIDTH, dtype=np.float64), np.arange(WIDE_HEIGHT, dtype=np.float64))
    straight = lens.undistorted_px(np.stack([x.ravel(), y.ravel()], axis=1))
    rays = RayTable(straight.reshape(WIDE_HEIGHT, WIDE_WIDTH, 2))
    whole = Projection(M=lens.matrix(), C=np.zeros(3), width=WIDE_WIDTH, height=WIDE_HEIGHT, rays=rays)
    return {1: whole, 2: whole.halved()}
