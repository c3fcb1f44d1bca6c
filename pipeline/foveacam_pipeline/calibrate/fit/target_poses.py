"""Joint fit of the target's pose over all sweeps: the target is fixed while the base turns the rig.

Distance and inclination, which one wide view determines poorly, are then one unknown of a whole sweep; a pose
has its bearing and its roll, from all corners of all markers, the same for both eyes. The pan axis is
vertical and carries the tilt axis at a small offset.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerView
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics

MIN_POSES = 9
LARGEST_EXCESS = 1.2
"""Maximum variance over that of free poses; beyond it, the rig was not turned by a pan-tilt."""
_ROUNDS = 12
_STOP = 1e-9
_SHARED = 5
"""Unknowns of the base: a point of the tilt axis (3), and the pan axis from there (y, z)."""

Views = dict[int, MarkerView]

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningBase:
    """Whether the poses were constrained to the base (`held`), and the residuals of the corners.

    `corner_sigma_px`: standard error of a corner's coordinate with poses constrained to the base, wide px;
    `free_sigma_px`: the same with free poses. `tilt_axis_rig_m`: (3,) a point of the tilt axis.
    """

    held: bool
    corner_sigma_px: float
    free_sigma_px: float
    tilt_axis_rig_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Corners:
    """(n, m, 2) measured tangents and positions on the target, m; `seen` (n, m): 0 for padding.

    `station`: (n, stations), 1 where a pose belongs to that station.
    """

    tangents: NDArray[np.float64]
    places_m: NDArray[np.float64]
    seen: NDArray[np.float64]
    station: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _State:
    """Unknowns of the fit: middle of the target = turn @ arm + lift(ay) @ step + pivot.

    `turns`: (n, 3, 3) rig_from_target. `arms_m`: (stations, 3), target's axes. `step_m`: (2,) y, z from the
    tilt axis to the pan axis. `pivot_m`: (3,) on the tilt axis. `lifts`: (n, 3, 2), rotation of the step by
    the tilt, from the elevation at which the target appears.
    """

    turns: NDArray[np.float64]
    arms_m: NDArray[np.float64]
    step_m: NDArray[np.float64]
    pivot_m: NDArray[np.float64]
    lifts: NDArray[np.float64]

    def middles_m(self, corners: _Corners) -> NDArray[np.float64]:
        """Return (n, 3) middles of the target."""
        arms = np.einsum("nij,nj->ni", self.turns, corners.station @ self.arms_m)
        return np.asarray(arms + self.lifts @ self.step_m + self.pivot_m, dtype=np.float64)


def constrain_to_base(
    poses: Sequence[Sequence[TargetPose]], views: Sequence[Sequence[Views]], wide: Intrinsics
) -> tuple[list[list[TargetPose]], TurningBase]:
    """Return the poses of each station's sweep constrained to the axes of the base, if a pan-tilt turned it.

    `poses` are those of the single views. They are returned unchanged where the residuals exceed the corners'
    noise, as for a rig moved by hand, and where poses in one row do not determine the axes.
    """
    corners = _gather_corners(poses, views, wide)
    flat = [pose for station in poses for pose in station]
    free = wide.fx_px * _sigma(_misses(corners, _turns_of(flat), _middles_of(flat)), 6.0 * len(flat))
    unchanged = [list(station) for station in poses]
    nothing = TurningBase(
        held=False, corner_sigma_px=free, free_sigma_px=free, tilt_axis_rig_m=(0.0, 0.0, 0.0)
    )
    if min(len(station) for station in poses) < MIN_POSES:
        return unchanged, nothing
    try:
        state = _solve_base(corners, _start_state(flat, corners))
    except np.linalg.LinAlgError:
        return unchanged, nothing
    unknowns = 3.0 * len(flat) + 3.0 * len(poses) + _SHARED
    sigma = wide.fx_px * _sigma(_misses(corners, state.turns, state.middles_m(corners)), unknowns)
    if not np.isfinite(sigma):
        return unchanged, nothing
    x_m, y_m, z_m = state.pivot_m.tolist()
    base = replace(
        nothing,
        held=bool(sigma**2 <= LARGEST_EXCESS * free**2),
        corner_sigma_px=sigma,
        tilt_axis_rig_m=(x_m, y_m, z_m),
    )
    logger.info("base: %s", base)
    if not base.held:
        return unchanged, base
    ends = iter(zip(state.turns, state.middles_m(corners), strict=True))
    return [[_with_pose(pose, *next(ends)) for pose in station] for station in poses], base


def _with_pose(pose: TargetPose, turn: NDArray[np.float64], middle_m: NDArray[np.float64]) -> TargetPose:
    return replace(pose, rotation=turn, middle_m=middle_m)


def _gather_corners(
    poses: Sequence[Sequence[TargetPose]], views: Sequence[Sequence[Views]], wide: Intrinsics
) -> _Corners:
    """Return the corners of all views, padded to one length."""
    rows = [
        (k, [(role, view[pose.layout.id_of(role)]) for role in Role if pose.layout.id_of(role) in view], pose)
        for k, station in enumerate(poses)
        for pose, view in zip(station, views[k], strict=True)
    ]
    longest = max(sum(len(marker.corners_px) for _, marker in known) for _, known, _ in rows)
    tangents, places = np.zeros((2, len(rows), longest, 2))
    seen, station_of = np.zeros((len(rows), longest)), np.zeros((len(rows), len(poses)))
    for i, (k, known, pose) in enumerate(rows):
        pixels = np.concatenate([marker.corners_px for _, marker in known])
        on_target = [marker.places_m + pose.layout.middle_m(role) for role, marker in known]
        tangents[i, : len(pixels)] = tan_from_angles(wide.angles_rad(pixels))
        places[i, : len(pixels)] = pose.scale * np.concatenate(on_target)
        seen[i, : len(pixels)] = 1.0
        station_of[i, k] = 1.0
    return _Corners(tangents=tangents, places_m=places, seen=seen, station=station_of)


def _start_state(flat: list[TargetPose], corners: _Corners) -> _State:
    """Return the state whose middles are nearest to those of the single views (linear least squares)."""
    turns, middles = _turns_of(flat), _middles_of(flat)
    y, z = middles[:, 1], middles[:, 2]
    length = np.hypot(y, z)
    lifts = np.zeros((len(flat), 3, 2))
    lifts[:, 1, 0] = lifts[:, 2, 1] = z / length
    lifts[:, 1, 1], lifts[:, 2, 0] = y / length, -y / length
    state = _State(
        turns=turns,
        arms_m=np.zeros((corners.station.shape[1], 3)),
        step_m=np.zeros(2),
        pivot_m=np.zeros(3),
        lifts=lifts,
    )
    columns = _shared_columns(corners, state)
    found = np.linalg.lstsq(columns.reshape(-1, columns.shape[2]), middles.ravel(), rcond=None)[0]
    return _stepped(state, np.zeros((len(flat), 3)), np.asarray(found, dtype=np.float64))


def _solve_base(corners: _Corners, state: _State) -> _State:
    """Return the state of least squares (Gauss-Newton; the turn of each pose is eliminated).

    The elimination stays by hand: for 162 poses scipy's least squares took 150 times as long (6 s for 40 ms)
    with a dense Jacobian, and with a sparse one 14 to 26 times as long without reaching the least cost.
    """
    for _ in range(_ROUNDS):
        misses, to_turn, to_middle = _slopes(corners, state.turns, state.middles_m(corners))
        arms = np.einsum("nij,nj->ni", state.turns, corners.station @ state.arms_m)
        own = to_turn - to_middle @ _cross_matrices(arms)
        shared = to_middle @ _shared_columns(corners, state)
        inverse = np.linalg.inv(np.einsum("nki,nkj->nij", own, own))
        across = np.einsum("nki,nkj->nij", own, shared)
        pull = np.einsum("nki,nk->ni", own, misses)
        carried = inverse @ across
        normal = np.einsum("nki,nkj->ij", shared, shared) - np.einsum("nki,nkj->ij", across, carried)
        right = np.einsum("nki,nk->i", shared, misses) - np.einsum("nki,nk->i", carried, pull)
        step = np.asarray(np.linalg.lstsq(normal, right, rcond=1e-12)[0], dtype=np.float64)
        turn = np.einsum("nij,nj->ni", inverse, pull - across @ step)
        state = _stepped(state, turn, step)
        if max(float(np.abs(turn).max()), float(np.abs(step).max())) < _STOP:
            break
    return state


def _shared_columns(corners: _Corners, state: _State) -> NDArray[np.float64]:
    """Return the (n, 3, 3 stations + 5) derivatives of the middles by the arms, the step and the pivot."""
    poses = len(state.turns)
    arms = state.turns[:, :, None, :] * corners.station[:, None, :, None]
    pivot = np.broadcast_to(np.eye(3), (poses, 3, 3))
    return np.concatenate([arms.reshape(poses, 3, -1), state.lifts, pivot], axis=2)


def _stepped(state: _State, turn_rad: NDArray[np.float64], step: NDArray[np.float64]) -> _State:
    turned = np.array([cv2.Rodrigues(vector)[0] for vector in turn_rad], dtype=np.float64) @ state.turns
    return replace(
        state,
        turns=turned,
        arms_m=state.arms_m + step[:-_SHARED].reshape(-1, 3),
        step_m=state.step_m + step[-_SHARED:-3],
        pivot_m=state.pivot_m + step[-3:],
    )


def _slopes(
    corners: _Corners, turns: NDArray[np.float64], middles_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return residuals (n, 2 m), tangents, and derivatives (n, 2 m, 3) by a small turn and by the middle."""
    arms = np.einsum("nij,nmj->nmi", turns[:, :, :2], corners.places_m)
    points = arms + middles_m[:, None, :]
    inverse = 1.0 / points[:, :, 2]
    misses = (corners.tangents - points[:, :, :2] * inverse[:, :, None]) * corners.seen[:, :, None]
    to_point = np.zeros((*inverse.shape, 2, 3))
    to_point[:, :, 0, 0] = to_point[:, :, 1, 1] = inverse
    to_point[:, :, :, 2] = -points[:, :, :2] * (inverse**2)[:, :, None]
    to_point *= corners.seen[:, :, None, None]
    poses = len(turns)
    to_turn = -to_point @ _cross_matrices(arms)
    return misses.reshape(poses, -1), to_turn.reshape(poses, -1, 3), to_point.reshape(poses, -1, 3)


def _misses(
    corners: _Corners, turns: NDArray[np.float64], middles_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    return _slopes(corners, turns, middles_m)[0][np.repeat(corners.seen, 2, axis=1) > 0.0]


def _sigma(misses: NDArray[np.float64], unknowns: float) -> float:
    return float(np.sqrt(np.sum(misses**2) / max(1.0, misses.size - unknowns)))


def _turns_of(flat: Sequence[TargetPose]) -> NDArray[np.float64]:
    return np.array([pose.rotation for pose in flat])


def _middles_of(flat: Sequence[TargetPose]) -> NDArray[np.float64]:
    return np.array([pose.middle_m for pose in flat])


def _cross_matrices(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (..., 3, 3) matrices of the cross product with (..., 3) vectors."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, axis=-2)
