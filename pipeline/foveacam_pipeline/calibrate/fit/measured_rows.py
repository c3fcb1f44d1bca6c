"""Rows of the fit: the gaze angle of an eye's image centre at one pose, in the rig frame.

The wide camera has located the target; the fovea's corners give the point on it at the image centre.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.fit.samples import EyeSweep
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, SweepPose
from foveacam_pipeline.geometry.plane_window import homography_apply

_FEWEST_CORNERS = 4


class DistanceSource(StrEnum):
    """Source of the target's distance, for the parallax between the wide camera and an eye."""

    PRINT = "print"
    """The printed size of the markers and of their layout."""
    TAPE = "tape"
    """The distance stored with the station."""
    UNKNOWN = "unknown"
    """None: an eye's gaze is the wide camera's bearing of its own marker (Eq. 1 is not corrected)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalRig:
    """Nominal dimensions of a rig, before it is calibrated.

    `baseline_m`: between the eyes' reference points. `fovea_f_px`: focal length of the virtual pinholes.
    `pupil_m`: how far behind its pivot the pupil lies.
    """

    rig_id: str
    baseline_m: float = 0.2  # Table 2
    fovea_f_px: float = 28_760.0  # Table 2: 100 mm on 3.45 um
    pupil_m: float = 0.04


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedPose:
    """One pose with the pose of its target."""

    sweep: int
    pose: SweepPose
    target: TargetPose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRow:
    """One measurement for the fit. `run`: of the procedure; `visit`: whether it repeats a node.

    `angles_rad`: (2,) from the eye's reference point. `plane_px`: (m, 2) corners, from the gaze.
    """

    eye: EyePose
    node: tuple[int, int]
    t_ns: int
    run: str
    visit: bool
    angles_rad: NDArray[np.float64]
    depth_m: float
    plane_px: NDArray[np.float64]


def eye_rows(
    placed: Sequence[PlacedPose],
    role: Role,
    drawing: NominalRig,
    distance: DistanceSource,
    *,
    centre_px: NDArray[np.float64],
) -> list[FitRow]:
    """Return the rows of an eye, repeated nodes included."""
    rows = []
    for one in placed:
        eye = one.pose.eye(role)
        if eye is not None and len(eye.corners.corners_px) >= _FEWEST_CORNERS:
            reference = _reference_m(one.target, role, drawing, distance)
            rows.append(_row(one, eye, role, reference, f_px=drawing.fovea_f_px, centre_px=centre_px))
    return rows


def _reference_m(
    target: TargetPose, role: Role, drawing: NominalRig, distance: DistanceSource
) -> NDArray[np.float64]:
    """Return the (3,) reference point of an eye's angles, m, rig frame.

    With the distance unknown it lies beside the wide camera as the eye's marker lies beside the wide one's,
    so that the eye's marker appears in the same direction as the wide camera's.
    """
    if distance is DistanceSource.UNKNOWN:
        return np.asarray(target.marker_rig_m(role) - target.middle_m, dtype=np.float64)
    half = 0.5 * drawing.baseline_m
    return np.array([-half if role is Role.LEFT else half, 0.0, 0.0])


def _row(
    placed: PlacedPose,
    eye: EyePose,
    role: Role,
    reference_m: NDArray[np.float64],
    *,
    f_px: float,
    centre_px: NDArray[np.float64],
) -> FitRow:
    """Return the row of a pose, with the image centre's position on the virtual pinhole's plane."""
    target = placed.target
    points = target.points_rig_m(eye.corners.places_m, role) - reference_m
    corners = f_px * points[:, :2] / points[:, 2:]
    about = corners.mean(axis=0)
    homography, _ = cv2.findHomography(eye.corners.corners_px, corners - about, 0)
    if homography is None:
        raise InvalidInput(
            f"{role} eye, pose {placed.pose.index}: its marker's corners lie on a line; sweep the pose again"
        )
    centre = homography_apply(np.asarray(homography, dtype=np.float64), [centre_px])[0] + about
    normal, ray = target.rotation[:, 2], np.array([*(centre / f_px), 1.0])
    return FitRow(
        eye=eye,
        node=(placed.sweep, placed.pose.index),
        t_ns=placed.pose.t_ns,
        run=placed.pose.run,
        visit=placed.pose.repeat > 0,
        angles_rad=np.arctan(centre / f_px),
        depth_m=float(normal @ (target.middle_m - reference_m) / (normal @ ray)),
        plane_px=corners - centre,
    )


def eye_sweep(rows: Sequence[FitRow], group: dict[tuple[int, int], int], *, one_depth: bool) -> EyeSweep:
    """Return the rows as arrays, corners padded with NaN; `one_depth` sets all depths to their mean."""
    longest = max(len(row.plane_px) for row in rows)
    raw, plane = np.full((2, len(rows), longest, 2), np.nan)
    for i, row in enumerate(rows):
        raw[i, : len(row.plane_px)] = row.eye.corners.corners_px
        plane[i, : len(row.plane_px)] = row.plane_px
    depth_m = np.array([row.depth_m for row in rows])
    return EyeSweep(
        volts_v=volts_of(rows),
        angles_rad=np.array([row.angles_rad for row in rows]),
        depth_m=np.full(len(rows), 1.0 / np.mean(1.0 / depth_m)) if one_depth else depth_m,
        raw_px=raw,
        plane_px=plane,
        group=np.array([group[row.node] for row in rows], dtype=np.int64),
        t_s=1e-9 * np.array([row.t_ns for row in rows], dtype=np.float64),
    )


def volts_of(rows: Sequence[FitRow]) -> NDArray[np.float64]:
    """Return the (n, 2) volts."""
    return np.array([row.eye.volts_v for row in rows], dtype=np.float64).reshape(-1, 2)
