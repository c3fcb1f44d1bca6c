"""Conversion of our sweeps to the authors' extrinsic records, and the poses of their records.

Their poses have the angle of the wide camera's marker, and in newer records four corners of the markers in
the wide view; ours have every corner, so an export and import preserves four.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.documents import Datapoint, Point2
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepPose
from foveacam_pipeline.geometry.angles import angles_from_tan, tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedRig:
    """Data of the rig for an import, which the records do not contain.

    `fovea_size`: (width, height), px. `distance_m`: of the markers, None when unknown.
    `spacing_m`: from the wide camera's marker to each eye's. `side_m`: for records without it.
    """

    rig_id: str
    fovea_size: tuple[int, int]
    distance_m: float | None = None
    spacing_m: float = 0.1
    side_m: float = 0.06


def extrinsic_record(
    sweep: Sweep, role: Role, *, wide: Intrinsics, label: str | None = None
) -> ExchangeRecord:
    """Return the centred poses of one eye as a record, whose poses always have a centred marker."""
    layout = sweep.header.layout
    poses = [
        _document(pose, eye, layout, layout.id_of(role), wide)
        for pose in sweep.accepted(role)
        if (eye := pose.eye(role)) is not None and eye.centred and layout.wide_id in pose.wide
    ]
    if not poses:
        raise InvalidInput(
            f"sweep at {sweep.header.station.name!r}: the {role.value} eye has no centred pose to export; "
            "measure the sweep first"
        )
    return ExchangeRecord(
        kind=RecordKind.EXTRINSIC,
        inner={"kind": RecordKind.EXTRINSIC.value, "dataset": poses},
        created_utc=sweep.header.created_utc,
        label=label,
        role=role,
    )


def checked_points(
    left: ExchangeRecord, right: ExchangeRecord, *, rig: ImportedRig
) -> Mapping[Role, Sequence[Datapoint]]:
    """Return the poses of both records, or raise InvalidInput when they are not of this rig's eyes."""
    points: dict[Role, Sequence[Datapoint]] = {}
    for role, record in ((Role.LEFT, left), (Role.RIGHT, right)):
        record.check(kind=RecordKind.EXTRINSIC, role=role)
        points[role] = record.extrinsic().dataset
        if not points[role]:
            raise InvalidInput(f"record {record.id} of the {role.value} eye holds no pose; give another one")
        _check_inside(record, points[role], rig.fovea_size)
    if left.id == right.id:
        raise InvalidInput(f"record {left.id} was given for both eyes; give one of each eye")
    return points


def corners_px(points: Sequence[Point2]) -> NDArray[np.float64]:
    """Return points as (n, 2) float64."""
    return np.array([(point.x, point.y) for point in points], dtype=np.float64)


def places_of(point: Datapoint) -> NDArray[np.float64]:
    """Return the (n, 2) positions of a pose's corners on its marker, in sides; the marker must be flat."""
    places = np.array([(corner.x, corner.y, corner.z) for corner in point.obj_points], dtype=np.float64)
    if places[:, 2].any():
        raise InvalidInput("obj_points: z other than 0 was found; only flat markers are known")
    return places[:, :2]


def _document(
    pose: SweepPose, eye: EyePose, layout: MarkerLayout, own_id: int, wide: Intrinsics
) -> dict[str, Json]:
    centre_px = pose.wide[layout.wide_id].corners_px[:4]
    middle = _crossing(tan_from_angles(wide.angles_rad(centre_px)))
    ax_rad, ay_rad = angles_from_tan(middle)[0].tolist()
    places = eye.corners.places_m / layout.side_m
    document: dict[str, Json] = {
        "img_points": _points(eye.corners.corners_px),
        "obj_points": [{"x": x, "y": y, "z": 0} for x, y in places.tolist()],
        "voltage": {"x": eye.volts_v[0], "y": eye.volts_v[1]},
        "angle": {"x": ax_rad, "y": ay_rad},
        "wide_center_points": _points(centre_px),
        "marker": {"side_mm": 1e3 * layout.side_m, "center_mm": 1e3 * layout.side_m},
    }
    if own_id in pose.wide:
        document["wide_img_points"] = _points(pose.wide[own_id].corners_px[:4])
    return document


def _crossing(quad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (1, 2) crossing of the diagonals of (4, 2) corners: the middle in any perspective."""
    rows = np.column_stack([quad, np.ones(len(quad))])
    crossing = np.cross(np.cross(rows[0], rows[2]), np.cross(rows[1], rows[3]))
    middle: NDArray[np.float64] = crossing[None, :2] / crossing[2]
    return middle


def _points(px: NDArray[np.float64]) -> list[dict[str, Json]]:
    return [{"x": x, "y": y} for x, y in px.tolist()]


def _check_inside(record: ExchangeRecord, points: Sequence[Datapoint], size: tuple[int, int]) -> None:
    corners = np.vstack([corners_px(point.img_points) for point in points])
    low, high = corners.min(axis=0), corners.max(axis=0)
    if (low < -0.5).any() or (high > np.array(size) - 0.5).any():
        raise InvalidInput(
            f"record {record.id}: corners reach from {low.tolist()} to {high.tolist()} px, this fovea has "
            f"{size[0]} x {size[1]}; give the record of this camera"
        )
