"""Conversion of the authors' records, old or new, to the measured angles of a fit.

The wide camera's marker is at the recorded angle, the eye's own marker beside it. Both face the rig at the
zero pose of the base, and turn with the base by pan and then by tilt.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, PanTiltPose, Role
from foveacam_pipeline.calibrate.exchange.documents import Datapoint
from foveacam_pipeline.calibrate.exchange.extrinsic import (
    ImportedRig,
    checked_points,
    corners_px,
    places_of,
)
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, RigSweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import base_pose
from foveacam_pipeline.geometry.angles import ray
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.intrinsics import Intrinsics

AHEAD = PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
_PLACE_DIGITS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalOptics:
    """Nominal dimensions for the fit: `baseline_m`, focal length of the telephoto, its pupil."""

    baseline_m: float = 0.2
    fovea_f_px: float = 28_760.0
    pupil_m: float = 0.04


def rig_sweep_of(
    left: ExchangeRecord,
    right: ExchangeRecord,
    *,
    wide: Intrinsics,
    rig: ImportedRig,
    optics: NominalOptics,
    drift_rad: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0)),
) -> RigSweep:
    """Return the samples of two records; `drift_rad`: the operator's corrections, left and right (ax, ay)."""
    if rig.distance_m is None:
        raise InvalidInput(
            "the records do not say how far away the markers stood; give the distance in metres"
        )
    points = checked_points(left, right, rig=rig)
    eyes = [
        _eye_sweep(points[role], role, rig=rig, optics=optics, drift_rad=drift)
        for role, drift in zip((Role.LEFT, Role.RIGHT), drift_rad, strict=True)
    ]
    return RigSweep(
        rig_id=rig.rig_id,
        created_utc=max(left.created_utc, right.created_utc).replace("Z", "+00:00"),
        origin="imported",
        label=left.label or right.label or f"imported from {left.id} and {right.id}",
        wide=wide,
        left=eyes[0],
        right=eyes[1],
        baseline_m=optics.baseline_m,
        fovea_f_px=optics.fovea_f_px,
        fovea_width=rig.fovea_size[0],
        fovea_height=rig.fovea_size[1],
        pupil_m=optics.pupil_m,
    )


def _eye_sweep(
    points: Sequence[Datapoint],
    role: Role,
    *,
    rig: ImportedRig,
    optics: NominalOptics,
    drift_rad: tuple[float, float],
) -> EyeSweep:
    corners = sorted({place for point in points for place in _keys(point)})
    raw = np.full((len(points), len(corners), 2), np.nan)
    plane = np.zeros_like(raw)
    angles, depths = np.empty((len(points), 2)), np.empty(len(points))
    for k, point in enumerate(points):
        order = [corners.index(place) for place in _keys(point)]
        raw[k, order] = corners_px(point.img_points)
        side_m = rig.side_m if point.marker is None else 1e-3 * point.marker.side_mm
        tangents, depths[k] = _tangents(
            point, side_m * np.array(corners), role, rig=rig, baseline_m=optics.baseline_m
        )
        aim = _image_centre(raw[k, order], tangents[order], rig.fovea_size)
        plane[k] = optics.fovea_f_px * (tangents - aim)
        angles[k] = np.arctan(aim) + np.array(drift_rad)
    return EyeSweep(
        volts_v=np.array([(point.voltage.x, point.voltage.y) for point in points]),
        angles_rad=angles,
        depth_m=depths,
        raw_px=raw,
        plane_px=plane,
    )


def _keys(point: Datapoint) -> list[tuple[float, float]]:
    rounded: list[tuple[float, float]] = [
        (x, y) for x, y in np.round(places_of(point), _PLACE_DIGITS).tolist()
    ]
    return rounded


def _tangents(
    point: Datapoint, places_m: NDArray[np.float64], role: Role, *, rig: ImportedRig, baseline_m: float
) -> tuple[NDArray[np.float64], float]:
    """Return (m, 2) tangents, from the eye's reference point, of points on its marker, and the depth, m."""
    side = -1.0 if role is Role.LEFT else 1.0
    reference = np.array([side * baseline_m / 2.0, 0.0, 0.0])
    angle = point.angle.x, point.angle.y
    turned = _rig_from_target(angle)
    on_target = np.column_stack([places_m + np.array([side * rig.spacing_m, 0.0]), np.zeros(len(places_m))])
    middle = (rig.distance_m or math.inf) * ray(*angle)
    seen = middle + on_target @ turned.T - reference
    depth_m = float((middle + turned @ np.array([side * rig.spacing_m, 0.0, 0.0]))[2])
    return np.asarray(seen[:, :2] / seen[:, 2:]), depth_m


def _rig_from_target(angle_rad: tuple[float, float]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation of the target in the rig's axes when the base turns it to a gaze."""
    base = base_pose(np.array(angle_rad), AHEAD)
    cp, sp = math.cos(base.pan_rad), math.sin(base.pan_rad)
    ct, st = math.cos(base.tilt_rad), math.sin(base.tilt_rad)
    pan = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, ct, st], [0.0, -st, ct]])
    rig_from_target: NDArray[np.float64] = (pan @ tilt).T
    return rig_from_target


def _image_centre(
    raw_px: NDArray[np.float64], tangents: NDArray[np.float64], size: tuple[int, int]
) -> NDArray[np.float64]:
    """Return the (2,) tangents at the image centre, by the homography of the corners around it."""
    found, _ = cv2.findHomography(raw_px, tangents)
    if found is None:
        raise InvalidInput("a pose's corners lie on a line or fall together; leave it out of the record")
    centre = np.array([[(size[0] - 1) / 2.0, (size[1] - 1) / 2.0]])
    aim: NDArray[np.float64] = homography_apply(np.asarray(found, dtype=np.float64), centre)[0]
    return aim
