"""Pose of a board before the camera, and the direction of its tilt."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.wide_bundle import (
    FOCAL_OVER_WIDTH,
    FOVEA_FOCAL_OVER_WIDTH,
    BoardObservation,
    first_pose,
    lens_vector,
)
from foveacam_pipeline.models.intrinsics import Intrinsics

TILTS = ("frontal", "left side nearer", "right side nearer", "top nearer", "bottom nearer")
TILTED_RAD = math.radians(12.0)
"""Maximum tilt of a board that counts as frontal."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardPose:
    """Pose of a board. `rotation`: (3, 3) camera from board. `middle_m`: (3,) its middle, camera's frame."""

    rotation: NDArray[np.float64]
    middle_m: NDArray[np.float64]

    @property
    def tilt_rad(self) -> float:
        """Angle between the board's normal and the line of sight to its middle; 0 when seen face on."""
        sight = self.middle_m / np.linalg.norm(self.middle_m)
        return math.acos(min(1.0, abs(float(self.rotation[:, 2] @ sight))))

    @property
    def lean(self) -> NDArray[np.float64]:
        """(3,) component across the line of sight of the normal that points away from the camera."""
        normal = self.rotation[:, 2] * np.sign(self.rotation[:, 2] @ self.middle_m)
        sight = self.middle_m / np.linalg.norm(self.middle_m)
        return np.asarray(normal - sight * float(normal @ sight))

    @property
    def tilt(self) -> str:
        """Tilt of the board, one of `TILTS`."""
        if self.tilt_rad < TILTED_RAD:
            return TILTS[0]
        x, y, _ = self.lean.tolist()
        if abs(x) >= abs(y):
            return TILTS[1] if x < 0.0 else TILTS[2]
        return TILTS[3] if y < 0.0 else TILTS[4]


def nominal_lens(width: int, height: int, role: Role = Role.WIDE) -> Intrinsics:
    """Return the nominal intrinsics of a camera that is not calibrated."""
    focal_px = (FOCAL_OVER_WIDTH if role is Role.WIDE else FOVEA_FOCAL_OVER_WIDTH) * width
    return Intrinsics(
        width=width,
        height=height,
        fx_px=focal_px,
        fy_px=focal_px,
        cx_px=(width - 1) / 2.0,
        cy_px=(height - 1) / 2.0,
    )


def pose_of_view(view: BoardView, lens: Intrinsics | None = None, *, role: Role = Role.WIDE) -> BoardPose:
    """Return the pose of a view's board, by a calibrated lens or the nominal one of the camera `role`."""
    known = lens or nominal_lens(view.width, view.height, role)
    seen = BoardObservation(places_m=view.places_m, corners_px=view.corners_px)
    return board_pose_from(first_pose(seen, lens_vector(known)), middle_m=view.board.places_m().mean(axis=0))


def board_pose_from(pose: NDArray[np.float64], *, middle_m: NDArray[np.float64]) -> BoardPose:
    """Return the pose of a board from a rotation vector and a translation, m, (6,)."""
    rotation = np.asarray(cv2.Rodrigues(pose[:3])[0], dtype=np.float64)
    return BoardPose(rotation=rotation, middle_m=rotation @ np.array([*middle_m, 0.0]) + pose[3:])
