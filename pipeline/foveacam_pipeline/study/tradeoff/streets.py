"""Seeded streets as seen by a stereo camera, with the true depth of every pixel (Sec. 4.2).

Camera and image size are those of Virtual KITTI 2. A street is a ground plane, houses on both sides, cars,
people and poles; the sky has no depth, and what lies beyond `FARTHEST_M` is not judged.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.tradeoff.ray_caster import (
    LATTICE,
    Floats,
    PinholeCamera,
    RectangleFace,
    render_view,
)

CAMERA = PinholeCamera(f_px=725.0087, cx_px=620.5, cy_px=187.0, width=1242, height=375)  # Virtual KITTI 2
BASELINE_M = 0.532725  # Virtual KITTI 2
FARTHEST_M = 120.0
NEAREST_M = 4.0
NOISE_GREY_LEVELS = 1.5
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoScene:
    """A rectified pair with its true depth.

    `left`, `right`: (h, w, 3) uint8 RGB. `truth_z_m`: (h, w) float32, depth of the left pixels, NaN where
    it is not judged (sky, too far). `seen`: (h, w) bool, false where the right eye does not see that point.
    `near_m`: nearest depth that is searched.
    """

    name: str
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    f_px: float
    baseline_m: float
    truth_z_m: NDArray[np.float32]
    seen: NDArray[np.bool_]
    near_m: float = NEAREST_M

    def __post_init__(self) -> None:
        """Refuse arrays of different sizes."""
        height, width = self.truth_z_m.shape
        for name, image in (("left", self.left), ("right", self.right)):
            if image.shape != (height, width, 3) or image.dtype != np.uint8:
                raise InvalidInput(
                    f"{self.name}: its {name} image is {image.dtype} of shape {image.shape}; uint8 RGB of "
                    f"{width} x {height} px is needed, the size of its truth"
                )
        if self.seen.shape != (height, width):
            raise InvalidInput(f"{self.name}: its mask is of shape {self.seen.shape}, not {(height, width)}")


def street(seed: int, *, camera: PinholeCamera = CAMERA, baseline_m: float = BASELINE_M) -> StereoScene:
    """Return the street of that seed, the same at every call."""
    rng = np.random.default_rng([seed, 42])
    faces = street_faces(rng)
    lattice = rng.uniform(-1.0, 1.0, (LATTICE, LATTICE))
    left, right = (render_view(faces, camera, eye_x_m=x_m, lattice=lattice) for x_m in (0.0, baseline_m))
    images = [_photograph(render.image, rng) for render in (left, right)]
    counted = left.z_m <= FARTHEST_M
    return StereoScene(
        name=f"street {seed}",
        left=images[0],
        right=images[1],
        f_px=camera.f_px,
        baseline_m=baseline_m,
        truth_z_m=np.where(counted, left.z_m, np.nan).astype(np.float32),
        seen=seen_by_both(left.z_m, right.z_m, f_b=camera.f_px * baseline_m),
    )


def seen_by_both(left_z_m: Floats, right_z_m: Floats, *, f_b: float) -> NDArray[np.bool_]:
    """Return (h, w) bool: left pixels whose point the right eye sees too, to within a pixel of disparity.

    `left_z_m`, `right_z_m`: (h, w) depths, infinite or NaN where there is none; `f_b`: f B, px m.
    """
    height, width = left_z_m.shape
    disparity_px = np.nan_to_num(f_b / left_z_m, nan=-1.0)
    right_px = np.nan_to_num(f_b / right_z_m, nan=-2.0)
    at = np.arange(width)[None, :] - disparity_px
    rows = np.arange(height)[:, None]
    seen = np.zeros(left_z_m.shape, dtype=np.bool_)
    for column in (np.floor(at).astype(np.intp), np.ceil(at).astype(np.intp)):
        there = right_px[rows, np.clip(column, 0, width - 1)]
        seen |= (column >= 0) & (column < width) & (np.abs(there - disparity_px) < 1.0)
    return seen & (disparity_px >= 0.0)


def _photograph(image: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.uint8]:
    noisy = image + rng.normal(0.0, NOISE_GREY_LEVELS, image.shape)
    return np.clip(np.rint(noisy), 0.0, 255.0).astype(np.uint8)


def street_faces(rng: np.random.Generator) -> list[RectangleFace]:
    """Return the faces of a random street, in real sizes."""
    ground_m = rng.uniform(1.5, 1.9)
    half_m = rng.uniform(7.0, 12.0)
    faces = [
        RectangleFace(axis=1, low_m=(-300.0, ground_m, 2.0), high_m=(300.0, ground_m, 400.0), level=105.0),
    ]
    for side in (-1.0, 1.0):
        faces += _houses(rng, side * half_m, ground_m)
    for width, height, length in (
        [(1.8, 1.5, 4.2)] * int(rng.integers(6, 11))
        + [(0.5, 1.75, 0.4)] * int(rng.integers(3, 7))
        + [(0.25, 6.0, 0.25)] * int(rng.integers(4, 9))
    ):
        x_m, z_m = _random_position(rng, half_m)
        faces += _box(
            rng,
            (x_m - width / 2.0, x_m + width / 2.0),
            (ground_m - height, ground_m),
            (z_m, z_m + length),
        )
    return faces


def _random_position(rng: np.random.Generator, half_m: float) -> tuple[float, float]:
    """Return a random position (x, z), m: log-uniform in z, and beside the camera's path when near."""
    z_m = float(np.exp(rng.uniform(np.log(9.0), np.log(100.0))))
    nearest_m = 2.2 if z_m < 30.0 else 0.0
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(nearest_m, half_m - 1.2)), z_m


def _houses(rng: np.random.Generator, wall_x_m: float, ground_m: float) -> list[RectangleFace]:
    """Return the houses of one side, with gaps, from beside the camera to the end of the street."""
    faces, z_m = [], rng.uniform(4.0, 12.0)
    while z_m < FARTHEST_M:
        length_m, height_m, deep_m = rng.uniform(7.0, 24.0), rng.uniform(3.5, 11.0), rng.uniform(8.0, 14.0)
        back_x_m = wall_x_m + float(np.sign(wall_x_m)) * deep_m
        faces += _box(
            rng,
            (min(wall_x_m, back_x_m), max(wall_x_m, back_x_m)),
            (ground_m - height_m, ground_m),
            (z_m, z_m + length_m),
        )
        z_m += length_m + rng.uniform(1.0, 9.0)
    return faces


def _box(rng: np.random.Generator, x_m: Interval, y_m: Interval, z_m: Interval) -> list[RectangleFace]:
    """Return the front of a box, both its sides and its top, each in a shade of one colour."""
    color = tuple(float(share) for share in rng.uniform(0.75, 1.15, 3))
    level = float(rng.uniform(70.0, 150.0))
    corners = [
        (2, (x_m[0], y_m[0], z_m[0]), (x_m[1], y_m[1], z_m[0]), 1.0),
        (0, (x_m[0], y_m[0], z_m[0]), (x_m[0], y_m[1], z_m[1]), 0.85),
        (0, (x_m[1], y_m[0], z_m[0]), (x_m[1], y_m[1], z_m[1]), 0.85),
        (1, (x_m[0], y_m[0], z_m[0]), (x_m[1], y_m[0], z_m[1]), 1.15),
    ]
    return [
        RectangleFace(
            axis=axis, low_m=low, high_m=high, level=level * shade, color=(color[0], color[1], color[2])
        )
        for axis, low, high, shade in corners
    ]
