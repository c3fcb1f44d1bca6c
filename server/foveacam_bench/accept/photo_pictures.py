"""Photographs of calibration boards by cameras that are known exactly, drawn without the product's code.

OpenCV draws the board; it is seen through a lens of OpenCV's model, with blur and grain. Pictures are grey
values from 0 to 1; `photo_files.py` writes them as cameras do.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.boards import Board, Charuco

Picture: TypeAlias = NDArray[np.float32]
OVERSAMPLING = 2
SQUARE_PX = 60
"""Side of a square of the drawn board, px; its white margin is as wide."""
PAPER, INK, WALL = 0.85, 0.15, 0.4
"""Grey values of the board and of what is behind it."""
WIDEST_TAN, RADII = 6.0, 60_001
"""Largest tangent of an angle from the axis, and number of radii, of the table that inverts a lens."""
RATIONAL = 8
"""Number of coefficients of the rational model."""
ROUNDS = 6
"""Of the inversion of the tangential distortion, each a hundred times as exact as the one before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownCamera:
    """A camera that is known exactly; `distortion`: k1, k2, p1, p2, k3, then k4 to k6 or none."""

    width: int
    height: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...]

    def halved(self) -> "KnownCamera":
        """Return the same lens with half as many pixels a side."""
        (fx_px, fy_px), (cx_px, cy_px) = self.focal_px, self.centre_px
        return replace(
            self,
            width=self.width // 2,
            height=self.height // 2,
            focal_px=(fx_px / 2.0, fy_px / 2.0),
            centre_px=((cx_px + 0.5) / 2.0 - 0.5, (cy_px + 0.5) / 2.0 - 0.5),
        )

    @property
    def reach(self) -> float:
        """Radius in the image, in focal lengths, at which the lens folds back."""
        return float(_radii(self.distortion)[1][-1])

    def pixels(self, tangents: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) pixels of (n, 2) tangents; NaN beyond the fold."""
        radius = np.linalg.norm(tangents, axis=-1, keepdims=True)
        bent = tangents * _growth(radius, self.distortion) + _tangential(tangents, self.distortion)
        bent[radius[..., 0] > _radii(self.distortion)[0][-1]] = np.nan
        return np.asarray(bent * self.focal_px + self.centre_px)

    def tangents(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the tangents that pixels (..., 2) see; NaN where no direction reaches."""
        straight_radii, bent_radii = _radii(self.distortion)
        bent = (pixels - self.centre_px) / self.focal_px
        straight = np.zeros_like(bent)
        for _ in range(ROUNDS if any(self.distortion[2:4]) else 1):
            radial = bent - _tangential(straight, self.distortion)
            radius = np.maximum(np.linalg.norm(radial, axis=-1, keepdims=True), 1e-12)
            straight = radial / radius * np.interp(radius, bent_radii, straight_radii, right=np.nan)
        return np.asarray(straight)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownPose:
    """Where the middle of a board is in the camera's frame, m, and its rotation vector, rad."""

    place_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float]

    def points_m(self, flat_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 3) points in the camera's frame of (n, 2) places about the middle of the board."""
        rotation = np.asarray(cv2.Rodrigues(np.array(self.turn_rad))[0], dtype=np.float64)
        return np.asarray(flat_m @ rotation[:, :2].T + self.place_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """How a series of photographs is taken.

    `grain`: noise of a pixel. `curl`: how far the paper gives way, squares, anew in each view. `share`:
    smallest and largest width of the board over that of the picture. `still`: the board is not moved.
    """

    count: int = 16
    seed: int = 1
    grain: float = 0.008
    blur_px: float = 0.7
    curl: float = 0.0
    share: tuple[float, float] = (0.35, 0.75)
    still: bool = False


@lru_cache(maxsize=4)
def photographs(camera: KnownCamera, board: Board, series: Series) -> tuple[Picture, ...]:
    """Return photographs (h, w) of a board that is seen whole, all over the picture and tilted every way."""
    rng = np.random.default_rng(series.seed)
    poses = _poses(camera, board, series, rng)
    return tuple(_photograph(camera, board, pose, series, rng) for pose in poses)


def _poses(camera: KnownCamera, board: Board, series: Series, rng: np.random.Generator) -> list[ShownPose]:
    """Return poses at which the whole board is in the picture."""
    edge_m = np.array([board.columns + 1.0, board.rows + 1.0]) * board.square_m
    ring = np.array([(x, y) for x in np.linspace(-0.5, 0.5, 9) for y in np.linspace(-0.5, 0.5, 9)])
    poses: list[ShownPose] = []
    while len(poses) < series.count:
        depth_m = camera.focal_px[0] * edge_m[0] / (rng.uniform(*series.share) * camera.width)
        middle = camera.tangents(rng.uniform(0.0, 1.0, 2) * [camera.width, camera.height])
        x_m, y_m = (middle * depth_m).tolist()
        across, down, roll = rng.uniform(-0.5, 0.5, 3).tolist()
        pose = ShownPose(place_m=(x_m, y_m, depth_m), turn_rad=(across, down, 0.5 * roll))
        points_m = pose.points_m(ring * edge_m)
        if points_m[:, 2].min() <= 0.0:
            continue
        seen_px = camera.pixels(points_m[:, :2] / points_m[:, 2:])
        if ((seen_px > 0.0) & (seen_px < [camera.width - 1.0, camera.height - 1.0])).all():
            poses += [pose] * (series.count if series.still else 1)
    return poses


def _photograph(
    camera: KnownCamera, board: Board, pose: ShownPose, series: Series, rng: np.random.Generator
) -> Picture:
    """Return the photograph (h, w) of a board at a pose."""
    axes = pose.points_m(np.eye(2)) - pose.place_m
    plane_from_ray = np.linalg.inv(np.column_stack([axes[0], axes[1], pose.place_m]))
    plane = _fine_tangents(camera) @ plane_from_ray[:, :2].T + plane_from_ray[:, 2]
    squares = plane[..., :2] / plane[..., 2:] / board.square_m
    if series.curl:
        squares = squares + _curl(squares / board.columns, series.curl, rng)
    middle = np.array([board.columns + 1.0, board.rows + 1.0]) / 2.0 + 1.0
    at_px = (squares + middle) * SQUARE_PX - 0.5
    at_px = np.where((plane[..., 2:] > 0.0) & np.isfinite(at_px), at_px, -9.0).astype(np.float32)
    x_px, y_px = np.moveaxis(at_px, -1, 0)
    fine = cv2.remap(
        _sheet(board), x_px, y_px, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=WALL
    )
    fine = cv2.GaussianBlur(fine, (0, 0), series.blur_px * OVERSAMPLING)
    picture = cv2.resize(fine, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    picture = picture + series.grain * rng.standard_normal(picture.shape)
    return np.asarray(np.clip(picture, 0.0, 1.0), dtype=np.float32)


def _curl(at: NDArray[np.float64], most: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return how far paper gives way in its plane, squares, at places (..., 2) of -0.5 to 0.5."""
    x, y = at[..., :1], at[..., 1:]
    quadratic = np.concatenate([x * x, x * y, y * y], axis=-1)
    return np.asarray(4.0 * most * quadratic @ rng.uniform(-1.0, 1.0, (3, 2)))


@lru_cache(maxsize=2)
def _fine_tangents(camera: KnownCamera) -> NDArray[np.float64]:
    """Return the tangents that the parts of all pixels see, (h, w, 2)."""
    step = 1.0 / OVERSAMPLING
    x = np.arange(camera.width * OVERSAMPLING) * step + (step - 1.0) / 2.0
    y = np.arange(camera.height * OVERSAMPLING) * step + (step - 1.0) / 2.0
    return camera.tangents(np.stack(np.meshgrid(x, y), axis=-1))


@lru_cache(maxsize=4)
def _sheet(board: Board) -> Picture:
    """Return the sheet (h, w) with the board, and a white margin of one square."""
    columns, rows = board.columns + 1, board.rows + 1
    if isinstance(board, Charuco):
        inside = board.printed().generateImage((columns * SQUARE_PX, rows * SQUARE_PX), marginSize=0) / 255.0
    else:
        odd = np.indices((rows, columns)).sum(axis=0) % 2
        inside = np.kron(odd, np.ones((SQUARE_PX, SQUARE_PX)))
    sheet = np.pad(INK + (PAPER - INK) * inside, SQUARE_PX, constant_values=PAPER)
    return np.asarray(sheet, dtype=np.float32)


@lru_cache(maxsize=8)
def _radii(distortion: tuple[float, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return radii outside and in the image, in focal lengths, up to where the lens folds back."""
    straight = np.linspace(0.0, WIDEST_TAN, RADII)
    bent = straight * _growth(straight, distortion)
    falls = np.flatnonzero(np.diff(bent) <= 0.0)
    end = int(falls[0]) + 1 if len(falls) else RADII
    return straight[:end], bent[:end]


def _growth(radius: NDArray[np.float64], distortion: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the factor of radii in the image."""
    k1, k2, _, _, k3, k4, k5, k6 = (*distortion, 0.0, 0.0, 0.0)[:RATIONAL]
    r2 = radius * radius
    above, below = r2 * (k1 + r2 * (k2 + r2 * k3)), r2 * (k4 + r2 * (k5 + r2 * k6))
    return np.asarray((1.0 + above) / (1.0 + below))


def _tangential(tangents: NDArray[np.float64], distortion: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the tangential distortion (..., 2) of tangents (..., 2)."""
    p1, p2 = distortion[2:4]
    x, y = tangents[..., 0], tangents[..., 1]
    r2 = x * x + y * y
    moved = (2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)
    return np.stack(moved, axis=-1)
