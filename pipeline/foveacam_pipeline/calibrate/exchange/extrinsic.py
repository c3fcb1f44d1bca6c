"""Conversion of our sweeps to the authors' extrinsic records, and of their records to a sweep.

Their poses have the angle of the wide camera's marker, and in newer records four corners of the markers in
the wide view; ours have every corner, so an export and import preserves four.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, PanTiltPose, Role, Station, StationTarget
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.documents import Datapoint, Point2
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepHeader, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import MIN_NODES, SweepPlan
from foveacam_pipeline.geometry.angles import angles_from_tan, tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics

QUAD = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""Outer corners of a marker, in sides, clockwise from its upper left."""
_SHARPNESS_UNKNOWN = 1.0
_EYES = (Role.LEFT, Role.RIGHT)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedRig:
    """Data of the rig for an import, which the records do not contain.

    `wide_size`, `fovea_size`: (width, height), px. `distance_m`: of the markers, None when unknown.
    `spacing_m`: from the wide camera's marker to each eye's. `side_m`: for records without it. `*_key`: keys
    of the rig's cameras; records that belong to others are refused.
    """

    rig_id: str
    wide_size: tuple[int, int]
    fovea_size: tuple[int, int]
    distance_m: float | None = None
    spacing_m: float = 0.1
    side_m: float = 0.06
    left_key: str | None = None
    right_key: str | None = None


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


def sweep_of(left: ExchangeRecord, right: ExchangeRecord, *, rig: ImportedRig) -> Sweep:
    """Return the sweep of two records; poses of both eyes with the same angle form one pose.

    Raise InvalidInput when the poses lack the markers' corners in the wide view, when the markers are
    swapped, or when a record is of other cameras.
    """
    points = checked_points(left, right, rig=rig)
    angles = list(dict.fromkeys(_angle(point) for role in _EYES for point in points[role]))
    sides = {point.marker.side_mm * 1e-3 for role in _EYES for point in points[role] if point.marker}
    layout = MarkerLayout(side_m=sides.pop() if len(sides) == 1 else rig.side_m, spacing_m=rig.spacing_m)
    of_angle = {role: {_angle(point): point for point in points[role]} for role in _EYES}
    poses = tuple(
        _pose(index, angle, {role: of_angle[role].get(angle) for role in _EYES}, layout)
        for index, angle in enumerate(angles)
    )
    volts = [v for role in _EYES for p in points[role] for v in (p.voltage.x, p.voltage.y)]
    header = SweepHeader(
        rig_id=rig.rig_id,
        created_utc=max(left.created_utc, right.created_utc),
        station=Station(
            name="imported",
            target=StationTarget.MARKERS,
            pose=PanTiltPose(pan_rad=0.0, tilt_rad=0.0),
            distance_m=rig.distance_m,
        ),
        layout=layout,
        plan=_plan(angles),
        wide_size=rig.wide_size,
        fovea_size=rig.fovea_size,
        max_v=float(np.max(np.abs(volts))),
    )
    return Sweep(header=header, poses=poses)


def checked_points(
    left: ExchangeRecord, right: ExchangeRecord, *, rig: ImportedRig
) -> Mapping[Role, Sequence[Datapoint]]:
    """Return the poses of both records, or raise InvalidInput when they are not of this rig's eyes."""
    points: dict[Role, Sequence[Datapoint]] = {}
    for role, record, key in ((Role.LEFT, left, rig.left_key), (Role.RIGHT, right, rig.right_key)):
        record.check(kind=RecordKind.EXTRINSIC, role=role)
        if key is not None:
            record.check_camera(key)
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


def _angle(point: Datapoint) -> tuple[float, float]:
    return point.angle.x, point.angle.y


def _plan(angles: Sequence[tuple[float, float]]) -> SweepPlan:
    """Return a grid with as many nodes and the same reach as the poses."""
    columns = max(MIN_NODES, math.ceil(math.sqrt(len(angles))))
    half = np.maximum(np.abs(np.array(angles)).max(axis=0), 1e-6)
    return SweepPlan(
        columns=columns,
        rows=max(MIN_NODES, math.ceil(len(angles) / columns)),
        half_width_rad=float(half[0]),
        half_height_rad=float(half[1]),
    )


def _pose(
    index: int,
    angle: tuple[float, float],
    points: Mapping[Role, Datapoint | None],
    layout: MarkerLayout,
) -> SweepPose:
    wide: dict[int, MarkerView] = {}
    for role, point in points.items():
        if point is not None:
            wide |= _wide_views(point, role, layout)
    eyes = {role: _eye(point, layout.id_of(role), layout.side_m) for role, point in points.items()}
    refusals = {role: None if eyes[role] else "its record has no pose at this angle" for role in _EYES}
    return SweepPose(
        index=index,
        node_rad=angle,
        pan_tilt=None,
        t_ns=0,
        wide=wide,
        left=eyes[Role.LEFT],
        right=eyes[Role.RIGHT],
        left_refusal=refusals[Role.LEFT],
        right_refusal=refusals[Role.RIGHT],
    )


def _eye(point: Datapoint | None, marker_id: int, side_m: float) -> EyePose | None:
    if point is None:
        return None
    return EyePose(
        volts_v=(point.voltage.x, point.voltage.y),
        corners=_view(marker_id, corners_px(point.img_points), side_m * places_of(point)),
        centred=True,
        rim=False,
        looks=1,
    )


def _wide_views(point: Datapoint, role: Role, layout: MarkerLayout) -> dict[int, MarkerView]:
    if point.wide_img_points is None or point.wide_center_points is None:
        raise InvalidInput(
            "a pose lacks the markers' corners in the wide view (an older recording); "
            "fit its angles as they are instead"
        )
    own, centre = (corners_px(points)[:4] for points in (point.wide_img_points, point.wide_center_points))
    side = -1.0 if role is Role.LEFT else 1.0
    if side * float(own[:, 0].mean() - centre[:, 0].mean()) <= 0.0:
        raise InvalidInput(
            f"the {role.value} eye's marker stands on the wrong side of the wide camera's: "
            "the markers or the records are swapped; give each eye its own"
        )
    centre_side_m = layout.side_m if point.marker is None else point.marker.center_mm * 1e-3
    own_side_m = layout.side_m if point.marker is None else point.marker.side_mm * 1e-3
    return {
        layout.wide_id: _view(layout.wide_id, centre, centre_side_m * QUAD),
        layout.id_of(role): _view(layout.id_of(role), own, own_side_m * QUAD),
    }


def _view(marker_id: int, px: NDArray[np.float64], places_m: NDArray[np.float64]) -> MarkerView:
    return MarkerView(
        id=marker_id,
        corners_px=px,
        places_m=places_m,
        sharpness=_SHARPNESS_UNKNOWN,
        complete=True,
    )
