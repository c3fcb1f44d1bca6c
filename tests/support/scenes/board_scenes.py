"""Pictures of calibration boards through a lens, drawn by the tests themselves."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples

WIDTH, HEIGHT = 1440, 1080
SQUARE_PX = 60
MARGIN_PX = 60
OVERSAMPLING = 2


@dataclass(frozen=True, kw_only=True)
class DivisionLens:
    """A lens of the kind that no calibration model contains: straight = bent / (1 + bend bent²)."""

    focal_px: float = 3155.0
    centre_px: tuple[float, float] = (722.9, 537.4)
    bend: float = -0.06
    width: int = WIDTH
    height: int = HEIGHT

    def straight(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        offset = (pixels - np.array(self.centre_px)) / self.focal_px
        radius2 = np.sum(offset**2, axis=-1, keepdims=True)
        return np.asarray(offset / (1.0 + self.bend * radius2))

    def pixels(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        tangents = points_m[..., :2] / points_m[..., 2:]
        radius2 = np.sum(tangents**2, axis=-1, keepdims=True)
        bent = tangents * 2.0 / (1.0 + np.sqrt(1.0 - 4.0 * self.bend * radius2))
        return np.asarray(bent * self.focal_px + np.array(self.centre_px))


SMALL = DivisionLens(focal_px=1577.0, centre_px=(361.2, 268.4), width=720, height=540)
"""The same field in a quarter of the pixels: quicker to draw."""
WEBCAM = DivisionLens(focal_px=536.0, centre_px=(328.4, 236.7), bend=-0.25, width=640, height=480)
"""A short lens with 60 px of barrel distortion in the corners, as of the published chessboard images."""


@dataclass(frozen=True, kw_only=True)
class Pose:
    """Where the middle of a board is, m, and its rotation vector, rad."""

    place_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> NDArray[np.float64]:
        return np.asarray(cv2.Rodrigues(np.array(self.turn_rad))[0], dtype=np.float64)


def many_poses(count: int, rng: np.random.Generator, *, max_tilt_rad: float = 0.6) -> list[Pose]:
    """Poses spread over the field, tilted to all sides, near enough to be seen whole."""
    poses = []
    for _ in range(count):
        depth_m = float(rng.uniform(1.0, 1.7))
        room_m = np.array([0.228 * depth_m - 0.11, 0.171 * depth_m - 0.09])
        x, y = (rng.uniform(-1.0, 1.0, 2) * room_m).tolist()
        turn = rng.uniform(-max_tilt_rad, max_tilt_rad, 3) * np.array([1.0, 1.0, 0.5])
        poses.append(Pose(place_m=(x, y, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    return poses


def hand_held_poses(count: int, rng: np.random.Generator) -> list[Pose]:
    """Poses of a board of 9 x 6 corners, 25 mm apart, held before `WEBCAM` and seen whole."""
    poses = []
    for _ in range(count):
        depth_m = float(rng.uniform(0.32, 0.5))
        x_m, y_m = (rng.uniform(-1.0, 1.0, 2) * (np.array([0.5, 0.37]) * depth_m - 0.11)).tolist()
        turn = rng.uniform(-0.5, 0.5, 3) * np.array([1.0, 1.0, 0.5])
        poses.append(Pose(place_m=(x_m, y_m, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    return poses


def write_board_pictures(folder: Path, board: Board, *, name: str, seed: int, count: int = 9) -> None:
    """Write images of a hand-held board by `WEBCAM`, `NAME00.png` and so on, blurred and with noise."""
    for k, pose in enumerate(hand_held_poses(count, np.random.default_rng([seed, 96]))):
        picture = board_picture(board, pose, lens=WEBCAM, noise=5.0, seed=100 * seed + k, blur_px=0.9)
        cv2.imwrite(str(folder / f"{name}{k:02d}.png"), picture)


def board_points_m(board: Board, places_m: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Return (n, 3) points in the camera's frame of places on a board whose middle is at the pose."""
    middle = board.places_m().mean(axis=0)
    flat = np.column_stack([places_m - middle, np.zeros(len(places_m))])
    return np.asarray(flat @ pose.rotation.T + np.array(pose.place_m))


@lru_cache(maxsize=2)
def _fine_tangents(lens: DivisionLens) -> NDArray[np.float64]:
    """Return the tangents that the parts of all pixels of a lens see, (h, w, 2)."""
    step = 1.0 / OVERSAMPLING
    x = np.arange(lens.width * OVERSAMPLING) * step + (step - 1.0) / 2.0
    y = np.arange(lens.height * OVERSAMPLING) * step + (step - 1.0) / 2.0
    return lens.straight(np.stack(np.meshgrid(x, y), axis=-1))


def draw_board(board: Board, *, square_px: int, margin_px: int) -> NDArray[np.uint8]:
    """Return the board as OpenCV draws it, (h, w) uint8, with a white margin."""
    size = ((board.columns + 1) * square_px, (board.rows + 1) * square_px)
    if isinstance(board, Charuco):
        inside = np.asarray(board.printed().generateImage(size, marginSize=0), dtype=np.uint8)
    else:
        odd = np.indices((board.rows + 1, board.columns + 1)).sum(axis=0) % 2
        inside = np.kron(odd * 255, np.ones((square_px, square_px))).astype(np.uint8)
    return np.pad(inside, margin_px, constant_values=255)


@lru_cache(maxsize=4)
def board_picture(
    board: Board,
    pose: Pose,
    *,
    lens: DivisionLens | None = None,
    noise: float = 2.0,
    seed: int = 0,
    blur_px: float = 0.6,
) -> NDArray[np.uint8]:
    """Return (h, w) uint8: the board before a grey wall, blurred, with noise."""
    lens = lens or DivisionLens()
    tangents = _fine_tangents(lens)
    rotation, place = pose.rotation, np.array(pose.place_m)
    plane_from_ray = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], place]))
    plane = tangents @ plane_from_ray[:, :2].T + plane_from_ray[:, 2]
    places = plane[..., :2] / plane[..., 2:] + board.places_m().mean(axis=0)
    sheet = draw_board(board, square_px=SQUARE_PX, margin_px=MARGIN_PX)
    # draw_board puts the place (0, 0), a corner between pixels, at margin + square from the sheet's edge
    maps = (places / board.square_m * SQUARE_PX + SQUARE_PX + MARGIN_PX - 0.5).astype(np.float32)
    light = sheet.astype(np.float32) * 0.7 + 30.0
    fine = cv2.remap(
        light, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=110.0
    )
    fine = cv2.GaussianBlur(fine, (0, 0), blur_px * OVERSAMPLING)
    picture = cv2.resize(fine, (lens.width, lens.height), interpolation=cv2.INTER_AREA)
    picture = picture + noise * np.random.default_rng(seed).standard_normal(picture.shape)
    return np.asarray(np.clip(np.rint(picture), 0, 255), dtype=np.uint8)


def board_view(
    board: Board, pose: Pose, *, lens: DivisionLens | None = None, noise_px: float = 0.0, seed: int = 0
) -> BoardView:
    """Return the view that a perfect detector would have, with noise on the corners."""
    lens = lens or DivisionLens()
    corners = lens.pixels(board_points_m(board, board.places_m(), pose))
    corners = corners + noise_px * np.random.default_rng(seed).standard_normal(corners.shape)
    inside = ((corners > 0.0) & (corners < np.array([lens.width, lens.height]) - 1.0)).all(axis=1)
    return BoardView(
        board=board,
        corners_px=corners[inside],
        ids=np.flatnonzero(inside),
        width=lens.width,
        height=lens.height,
    )


def board_samples(
    board: Board,
    poses: list[Pose],
    *,
    lens: DivisionLens | None = None,
    noise_px: float = 0.02,
    seed: int = 0,
) -> WideSamples:
    """Return samples of a board at poses, as a detector of that noise would see them."""
    views = [
        board_view(board, pose, lens=lens, noise_px=noise_px, seed=1000 * seed + k)
        for k, pose in enumerate(poses)
    ]
    return WideSamples(board, [WideSample(view=view, thumbnail_jpeg=b"") for view in views])
