"""From raw sweeps to measurements of both eyes: what each image centre saw, as an angle in the rig frame.

The wide camera places the target, the fovea's own corners say where on it the image centre lies. Eq. 1's
parallax is taken out by the target's distance: as printed, by tape, or not at all.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.fit.parallax import Parallax, parallax_of
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, RigSweep
from foveacam_pipeline.calibrate.fit.target_poses import TurningBase, held_to_base
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_checks import (
    EYES,
    check_axes,
    check_eye_seen,
    check_markers,
    check_spread,
    check_sweeps,
    check_target,
)
from foveacam_pipeline.geometry.pinhole import homography_apply
from foveacam_pipeline.models.intrinsics import Intrinsics

SAME_NODE_RAD = math.radians(0.2)
"""Gazes nearer than this were meant to be the same, at targets of different distances."""
_FEWEST_CORNERS = 4

logger = logging.getLogger(__name__)


class Distance(StrEnum):
    """Who says how far the target is, for the parallax between the wide camera and an eye."""

    PRINT = "print"
    """The printed size of the markers and of their layout."""
    TAPE = "tape"
    """The station's own distance."""
    UNKNOWN = "unknown"
    """Nobody: each eye's gaze is taken for the wide camera's bearing of its own marker (Eq. 1 is left in)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigDrawing:
    """What is known of a rig before it is calibrated.

    `baseline_m`: between the eyes' reference points. `fovea_f_px`: focal length of the virtual pinholes.
    `pupil_m`: how far behind its pivot the pupil lies.
    """

    rig_id: str
    baseline_m: float = 0.2  # Table 2
    fovea_f_px: float = 28_760.0  # Table 2: 100 mm on 3.45 um
    pupil_m: float = 0.04


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """What can be fitted, and what is to be said of it.

    `nodes`: for each eye (n, 2) int, the sweep's number and the pose's index of every row. `left_out`: poses
    that the wide camera could not place, with the reason.
    """

    rig: RigSweep
    parallax: tuple[Parallax, ...]
    base: TurningBase
    nodes: dict[Role, NDArray[np.int64]]
    left_out: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """One pose with the place of its target."""

    sweep: int
    pose: SweepPose
    target: TargetPose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Row:
    eye: EyePose
    node: tuple[int, int]
    t_ns: int
    angles_rad: NDArray[np.float64]
    depth_m: float
    plane_px: NDArray[np.float64]


def rig_sweep(
    sweeps: Sequence[Sweep],
    wide: Intrinsics,
    *,
    drawing: RigDrawing,
    label: str,
    distance: Distance = Distance.PRINT,
) -> Measured:
    """Return what the sweeps measured of both eyes; raise InvalidInput naming what is wrong with them."""
    check_sweeps(sweeps, wide, rig_id=drawing.rig_id)
    placed, left_out, base = placed_targets(sweeps, wide, distance=distance)
    size = sweeps[0].header.fovea_size
    centre_px = np.array([(size[0] - 1) / 2.0, (size[1] - 1) / 2.0])
    rows = {role: _rows(placed, role, drawing, distance, centre_px=centre_px) for role in EYES}
    group = dict(zip(((p.sweep, p.pose.index) for p in placed), same_node(placed), strict=True))
    max_v = max(sweep.header.max_v for sweep in sweeps)
    for role in EYES:
        volts, angles = _volts(rows[role]), np.array([row.angles_rad for row in rows[role]]).reshape(-1, 2)
        check_axes(volts, angles, role=role, max_v=max_v)
        check_eye_seen(sweeps, role, accepted=len(rows[role]))
        check_spread(volts, role=role)
    rig = RigSweep(
        rig_id=drawing.rig_id,
        created_utc=max(sweep.header.created_utc for sweep in sweeps),
        origin="measured",
        label=label,
        wide=wide,
        left=_eye_sweep(rows[Role.LEFT], group, one_depth=distance is Distance.UNKNOWN),
        right=_eye_sweep(rows[Role.RIGHT], group, one_depth=distance is Distance.UNKNOWN),
        baseline_m=drawing.baseline_m,
        fovea_f_px=drawing.fovea_f_px,
        fovea_width=size[0],
        fovea_height=size[1],
        pupil_m=drawing.pupil_m,
    )
    return Measured(
        rig=rig,
        parallax=tuple(
            parallax_of(
                sweep.header.station,
                [one.target for one in placed if one.sweep == k],
                baseline_m=drawing.baseline_m,
                corrected=distance is not Distance.UNKNOWN,
            )
            for k, sweep in enumerate(sweeps)
        ),
        base=base,
        nodes={role: np.array([row.node for row in rows[role]], dtype=np.int64) for role in EYES},
        left_out=left_out,
    )


def placed_targets(
    sweeps: Sequence[Sweep], wide: Intrinsics, *, distance: Distance
) -> tuple[list[Placed], tuple[str, ...], TurningBase]:
    """Return every pose with its target, what could not be placed and why, and how the base turned."""
    placed: list[list[Placed]] = []
    left_out: list[str] = []
    for k, sweep in enumerate(sweeps):
        check_markers(sweep)
        mine = []
        for pose in sweep.poses:
            try:
                target = locate_target(pose.wide, sweep.header.layout, wide)
            except InvalidInput as error:
                left_out.append(f"{sweep.header.station.name}, pose {pose.index}: {error}")
                continue
            mine.append(Placed(sweep=k, pose=pose, target=target))
        if 2 * len(mine) < len(sweep.poses) or not mine:
            raise InvalidInput(
                f"sweep at {sweep.header.station.name!r}: the target was placed at {len(mine)} of "
                f"{len(sweep.poses)} poses only; {left_out[-1] if left_out else 'it holds no pose'}"
            )
        placed.append(mine)
    targets, base = held_to_base(
        [[p.target for p in mine] for mine in placed], [[p.pose.wide for p in mine] for mine in placed], wide
    )
    for sweep, found in zip(sweeps, targets, strict=True):
        check_target(sweep, found)
    held = [
        Placed(sweep=p.sweep, pose=p.pose, target=_as_told(target, sweeps[p.sweep], distance, found))
        for mine, found in zip(placed, targets, strict=True)
        for p, target in zip(mine, found, strict=True)
    ]
    return held, tuple(left_out), base


def _as_told(
    target: TargetPose, sweep: Sweep, distance: Distance, station: Sequence[TargetPose]
) -> TargetPose:
    """Return the target at the distance that counts; a tape scales all poses of its station alike."""
    if distance is not Distance.TAPE:
        return target
    tape_m = sweep.header.station.distance_m
    if tape_m is None:
        raise InvalidInput(
            f"fit by tape: nobody measured the distance of {sweep.header.station.name!r}; measure it and "
            "write it into the station, or let the print decide"
        )
    factor = tape_m / float(np.median([pose.distance_m for pose in station]))
    return target.at_distance(factor * target.distance_m)


def _rows(
    placed: Sequence[Placed],
    role: Role,
    drawing: RigDrawing,
    distance: Distance,
    *,
    centre_px: NDArray[np.float64],
) -> list[_Row]:
    rows = []
    for one in placed:
        eye = one.pose.eye(role)
        if eye is not None and len(eye.corners.corners_px) >= _FEWEST_CORNERS:
            reference = _reference_m(one.target, role, drawing, distance)
            rows.append(_row(one, eye, role, reference, f_px=drawing.fovea_f_px, centre_px=centre_px))
    return rows


def _reference_m(
    target: TargetPose, role: Role, drawing: RigDrawing, distance: Distance
) -> NDArray[np.float64]:
    """Return (3,) from where an eye's angles are counted.

    With the distance unknown the eye's marker is seen as the wide camera sees its own: from a point that
    stands beside it as the markers stand beside each other.
    """
    if distance is Distance.UNKNOWN:
        return np.asarray(target.marker_rig_m(role) - target.middle_m, dtype=np.float64)
    half = 0.5 * drawing.baseline_m
    return np.array([-half if role is Role.LEFT else half, 0.0, 0.0])


def _row(
    placed: Placed,
    eye: EyePose,
    role: Role,
    reference_m: NDArray[np.float64],
    *,
    f_px: float,
    centre_px: NDArray[np.float64],
) -> _Row:
    """Return what the image centre saw: its place on the virtual pinhole's plane, by the corners."""
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
    return _Row(
        eye=eye,
        node=(placed.sweep, placed.pose.index),
        t_ns=placed.pose.t_ns,
        angles_rad=np.arctan(centre / f_px),
        depth_m=float(normal @ (target.middle_m - reference_m) / (normal @ ray)),
        plane_px=corners - centre,
    )


def _eye_sweep(rows: Sequence[_Row], group: dict[tuple[int, int], int], *, one_depth: bool) -> EyeSweep:
    """Return the rows as arrays, corners padded with NaN; `one_depth` hides how the distances differ."""
    longest = max(len(row.plane_px) for row in rows)
    raw, plane = np.full((2, len(rows), longest, 2), np.nan)
    for i, row in enumerate(rows):
        raw[i, : len(row.plane_px)] = row.eye.corners.corners_px
        plane[i, : len(row.plane_px)] = row.plane_px
    depth_m = np.array([row.depth_m for row in rows])
    return EyeSweep(
        volts_v=_volts(rows),
        angles_rad=np.array([row.angles_rad for row in rows]),
        depth_m=np.full(len(rows), 1.0 / np.mean(1.0 / depth_m)) if one_depth else depth_m,
        raw_px=raw,
        plane_px=plane,
        group=np.array([group[row.node] for row in rows], dtype=np.int64),
        t_s=1e-9 * np.array([row.t_ns for row in rows], dtype=np.float64),
    )


def same_node(placed: Sequence[Placed]) -> list[int]:
    """Return for each pose the number of the first one that was planned for nearly the same gaze."""
    nodes_rad = np.array([one.pose.node_rad for one in placed])
    apart = np.linalg.norm(nodes_rad[:, None, :] - nodes_rad[None, :, :], axis=2)
    return [int(first) for first in np.argmax(apart < SAME_NODE_RAD, axis=1)]


def _volts(rows: Sequence[_Row]) -> NDArray[np.float64]:
    return np.array([row.eye.volts_v for row in rows], dtype=np.float64).reshape(-1, 2)
