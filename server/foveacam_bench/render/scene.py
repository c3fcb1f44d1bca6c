"""Scene and views for measuring the renderer: ground, boxes, a panel, 20 000 triangles."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render import (
    Box,
    NoiseSurface,
    Projection,
    Quad,
    Scene,
    flat,
    ground,
    place,
    statue,
)

F64 = NDArray[np.float64]

WIDTH, HEIGHT = 1440, 1080
WIDE_F_PX = 3155.0
FOVEA_F_PX = 28_760.0
BASELINE_M = 0.2
PANEL_M = (0.6, 0.1, 10.0)
BOX_M = (-1.4, 0.5, 7.0)
STATUE_M = (1.3, 0.3, 8.0)


def measured_scene() -> Scene:
    """Return the scene of the timings."""
    scene = Scene()
    soil = NoiseSurface(seed=1, scale_m=4.0, color_a=(0.18, 0.2, 0.14), color_b=(0.6, 0.58, 0.45))
    scene.add(ground(width_m=30.0, length_m=40.0), soil, flat((0.0, 1.2, 20.0)), "ground")
    crate = NoiseSurface(seed=2, color_a=(0.3, 0.12, 0.08), color_b=(0.85, 0.6, 0.4))
    scene.add(Box(width_m=1.4, height_m=1.4, depth_m=1.4), crate, place(BOX_M, yaw_rad=0.6), "box")
    post = Box(width_m=0.5, height_m=2.2, depth_m=0.5)
    scene.add(post, crate, place((-0.2, 0.1, 16.0), yaw_rad=0.3), "post")
    paper = NoiseSurface(seed=3, color_a=(0.1, 0.2, 0.4), color_b=(0.8, 0.85, 0.9))
    scene.add(Quad(width_m=1.4, height_m=1.2), paper, place(PANEL_M, yaw_rad=0.2), "panel")
    stone = NoiseSurface(seed=4, color_a=(0.35, 0.3, 0.25), color_b=(0.95, 0.9, 0.8))
    scene.add(statue(height_m=1.8), stone, place(STATUE_M), "statue")
    return scene


def panel_scene(distance_m: float) -> Scene:
    """Return an oblique textured wall at a distance, and nothing else."""
    scene = Scene()
    wall = NoiseSurface(seed=11, scale_m=2.0)
    pose = place((0.0, 0.0, distance_m), yaw_rad=0.3, pitch_rad=0.15)
    scene.add(Quad(width_m=distance_m, height_m=distance_m), wall, pose, "wall")
    return scene


def wide_view(*, dx_px: float = 0.0, dy_px: float = 0.0, x_m: float = 0.0) -> Projection:
    """Return the wide camera, its principal point shifted by `dx_px` and `dy_px`."""
    return _pinhole(WIDE_F_PX, np.eye(3), x_m, dx_px, dy_px)


def fovea_view(at_m: tuple[float, float, float], *, dx_px: float = 0.0) -> Projection:
    """Return a fovea at the origin that looks at a point of the scene."""
    forward = np.array(at_m) / np.linalg.norm(at_m)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right /= np.linalg.norm(right)
    return _pinhole(FOVEA_F_PX, np.stack([right, np.cross(forward, right), forward]), 0.0, dx_px, 0.0)


def verged_pair(f_px: float, distance_m: float) -> tuple[Projection, Projection]:
    """Return two parallel pinholes a baseline apart, whose windows are centred on a point straight ahead."""
    half_m = BASELINE_M / 2
    shift_px = f_px * half_m / distance_m
    return (
        _pinhole(f_px, np.eye(3), -half_m, -shift_px, 0.0),
        _pinhole(f_px, np.eye(3), half_m, shift_px, 0.0),
    )


def _pinhole(f_px: float, rotation: F64, x_m: float, dx_px: float, dy_px: float) -> Projection:
    K = np.array([[f_px, 0.0, 719.5 + dx_px], [0.0, f_px, 539.5 + dy_px], [0.0, 0.0, 1.0]])
    return Projection(M=K @ rotation, C=np.array([x_m, 0.0, 0.0]), width=WIDTH, height=HEIGHT)
