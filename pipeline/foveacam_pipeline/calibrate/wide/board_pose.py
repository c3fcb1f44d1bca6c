"""How a board stands before the camera: where, and tilted which way."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.wide_bundle import (
    FOCAL_OVER_WIDTH,
    BoardObservation,
    first_pose,
    lens_vector,
)
from foveacam_pipeline.models.intrinsics import Intrinsics

TILTS = ("frontal", "left side nearer", "right side nearer", "top nearer", "bottom nearer")
TILTED_RAD = math.radians(12.0)
"""A board turned by less counts as frontal."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardPose:
    """`rotation`: (3, 3) camera from board. `place_m`: (3,) the middle of the board, camera's frame."""

    rotation: NDArray[np.float64]
    place_m: NDArray[np.float64]

    @property
    def tilt_rad(self) -> float:
        """Angle between the board's normal and the line of sight to its middle; 0 seen face on."""
        sight = self.place_m / np.linalg.norm(self.place_m)
        return math.acos(min(1.0, abs(float(self.rotation[:, 2] @ sight))))

    @property
    def lean(self) -> NDArray[np.float64]:
        """(3,) how the normal, pointing away from the camera, leans from the line of sight."""
        normal = self.rotation[:, 2] * np.sign(self.rotation[:, 2] @ self.place_m)
        sight = self.place_m / np.linalg.norm(self.place_m)
        return np.asarray(normal - sight * float(normal @ sight))

    @property
    def tilt(self) -> str:
        """Which of `TILTS` it is."""
        if self.tilt_rad < TILTED_RAD:
            return TILTS[0]
        x, y, _ = self.lean.tolist()
        if abs(x) >= abs(y):
            return TILTS[1] if x < 0.0 else TILTS[2]
        return TILTS[3] if y < 0.0 else TILTS[4]


def nominal_lens(width: int, height: int) -> Intrinsics:
    """Return what a wide camera is taken for before it has been calibrated."""
    focal_px = FOCAL_OVER_WIDTH * width
    return Intrinsics(
        width=width,
        height=height,
        fx_px=focal_px,
        fy_px=focal_px,
        cx_px=(width - 1) / 2.0,
        cy_px=(height - 1) / 2.0,
    )


def pose_of_view(view: BoardView, lens: Intrinsics | None = None) -> BoardPose:
    """Return how the board of a view stands, by a calibrated lens or the nominal one."""
    known = lens or nominal_lens(view.width, view.height)
    seen = BoardObservation(places_m=view.places_m, corners_px=view.corners_px)
    return board_pose_from(first_pose(seen, lens_vector(known)), middle_m=view.board.places_m().mean(axis=0))


def board_pose_from(pose: NDArray[np.float64], *, middle_m: NDArray[np.float64]) -> BoardPose:
    """Return the attitude of a board whose pose (6,) is a rotation vector and a translation, m."""
    rotation = np.asarray(cv2.Rodrigues(pose[:3])[0], dtype=np.float64)
    return BoardPose(rotation=rotation, place_m=rotation @ np.array([*middle_m, 0.0]) + pose[3:])
