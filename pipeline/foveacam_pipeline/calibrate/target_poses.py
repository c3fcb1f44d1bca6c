"""Where the flat target of markers stood at every pose of a sweep, seen by the wide camera.

All corners of all markers are one rigid target: its joint pose knows the bearing of each marker several times
better than the marker itself does, and what error is left is the same for both eyes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics

FEWEST_MARKERS = 2
"""One alone tells neither the roll nor the distance well enough for an eye that stands beside it."""
_ROUNDS = 10
_STOP = 1e-10

Views = dict[int, MarkerView]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetPoses:
    """The target at n poses: its middle is that of the wide camera's marker.

    `rig_from_target`: (n, 3, 3) rotations. `middle_m`: (n, 3), rig frame. `covariance`: (n, 6, 6) of a small
    turn about the rig's axes, rad, and of the middle, m. `misses_px`: (n,) root mean square wide px that a
    pose leaves. `corner_sigma_px`: standard error of one coordinate of a corner over all poses.
    """

    rig_from_target: NDArray[np.float64]
    middle_m: NDArray[np.float64]
    covariance: NDArray[np.float64]
    misses_px: NDArray[np.float64]
    corner_sigma_px: float

    def place_m(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, k, 3) rig frame of the plane's points: (k, 2), or (n, k, 2) with a set a pose."""
        flat = np.broadcast_to(points_m, (len(self.middle_m), *points_m.shape[-2:]))
        turned = np.einsum("nij,nkj->nki", self.rig_from_target[:, :, :2], flat)
        return np.asarray(turned + self.middle_m[:, None, :], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Corners:
    """(n, m, 2) tangents seen and places on the target, m; `seen` (n, m): 0 for padding."""

    tangents: NDArray[np.float64]
    places_m: NDArray[np.float64]
    seen: NDArray[np.float64]


def target_poses(views: Sequence[Views], *, layout: MarkerLayout, wide: Intrinsics) -> TargetPoses:
    """Return where the target stood in each of n views of it.

    A plane nearly facing the camera fits almost as well mirrored in depth: both starts are followed to
    their ends, and each view keeps the better one.
    """
    if not views:
        raise InvalidInput("target poses: no view of the markers was given; measure a sweep first")
    corners = _gather(views, layout, wide)
    one, other = (_refined(corners, *start) for start in _starts(corners))
    costs = [np.sum(_linearised(corners, *end)[0] ** 2, axis=1) for end in (one, other)]
    better = costs[0] <= costs[1]
    rotation = np.where(better[:, None, None], one[0], other[0])
    middle = np.where(better[:, None], one[1], other[1])
    return _result(corners, rotation, middle, focal_px=wide.fx_px)


def _refined(
    corners: _Corners, rotation: NDArray[np.float64], middle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotations and middles with the least squared misses near the given ones (Gauss-Newton)."""
    for _ in range(_ROUNDS):
        misses, slopes = _linearised(corners, rotation, middle)
        normal = np.einsum("nki,nkj->nij", slopes, slopes)
        step = np.linalg.solve(normal, np.einsum("nki,nk->ni", slopes, misses)[:, :, None])[:, :, 0]
        rotation = _turns(step[:, :3]) @ rotation
        middle = middle + step[:, 3:]
        if float(np.abs(step).max()) < _STOP:
            break
    return rotation, middle


def _result(
    corners: _Corners, rotation: NDArray[np.float64], middle: NDArray[np.float64], *, focal_px: float
) -> TargetPoses:
    misses, slopes = _linearised(corners, rotation, middle)
    squares, values = np.sum(misses**2, axis=1), 2.0 * corners.seen.sum(axis=1)
    variance = float(squares.sum() / max(1.0, float((values - 6.0).sum())))
    normal = np.einsum("nki,nkj->nij", slopes, slopes)
    return TargetPoses(
        rig_from_target=rotation,
        middle_m=middle,
        covariance=variance * np.linalg.inv(normal),
        misses_px=focal_px * np.sqrt(squares / values),
        corner_sigma_px=focal_px * float(np.sqrt(variance)),
    )


def _gather(views: Sequence[Views], layout: MarkerLayout, wide: Intrinsics) -> _Corners:
    """Return the corners of all views, padded to one length."""
    rows = []
    for view in views:
        pairs = [
            (view[marker].corners_px, view[marker].places_m + layout.middle_m(role))
            for role in (Role.WIDE, Role.LEFT, Role.RIGHT)
            if (marker := layout.id_of(role)) in view
        ]
        rows.append(tuple(np.concatenate(part) for part in zip(*pairs, strict=True)))
    longest = max(len(pixels) for pixels, _ in rows)
    tangents, places = np.zeros((2, len(rows), longest, 2))
    seen = np.zeros((len(rows), longest))
    for i, (pixels, places_m) in enumerate(rows):
        tangents[i, : len(pixels)] = tan_from_angles(wide.angles_rad(pixels))
        places[i, : len(pixels)] = places_m
        seen[i, : len(pixels)] = 1.0
    return _Corners(tangents=tangents, places_m=places, seen=seen)


def _starts(corners: _Corners) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return both first guesses: rotations (n, 3, 3) and middles (n, 3), found view by view."""
    guesses: list[list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = [[], []]
    for tangents, places, seen in zip(corners.tangents, corners.places_m, corners.seen > 0.0, strict=True):
        flat = np.column_stack([places[seen], np.zeros(int(seen.sum()))])
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            flat, tangents[seen], np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE
        )
        if count == 0:
            raise InvalidInput(
                "target poses: the corners of one view fit no pose; measure it again with the markers flat"
            )
        for side, guess in enumerate(guesses):
            k = min(side, count - 1)
            guess.append((np.asarray(cv2.Rodrigues(turns[k])[0], dtype=np.float64), np.ravel(shifts[k])))
    return [(np.array([turn for turn, _ in g]), np.array([shift for _, shift in g])) for g in guesses]


def _linearised(
    corners: _Corners, rotation: NDArray[np.float64], middle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what the poses leave, (n, 2 m) tangents, and its slopes (n, 2 m, 6) to turn and middle."""
    arms = np.einsum("nij,nmj->nmi", rotation[:, :, :2], corners.places_m)
    points = arms + middle[:, None, :]
    inverse = 1.0 / points[:, :, 2]
    misses = (corners.tangents - points[:, :, :2] * inverse[:, :, None]) * corners.seen[:, :, None]
    to_point = np.zeros((*inverse.shape, 2, 3))
    to_point[:, :, 0, 0] = to_point[:, :, 1, 1] = inverse
    to_point[:, :, :, 2] = -points[:, :, :2] * (inverse**2)[:, :, None]
    to_point *= corners.seen[:, :, None, None]
    slopes = np.concatenate([-to_point @ cross_matrices(arms), to_point], axis=3)
    poses = len(rotation)
    return misses.reshape(poses, -1), slopes.reshape(poses, -1, 6)


def cross_matrices(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (..., 3, 3): the matrices that take the cross product with (..., 3) vectors."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, axis=-2)


def _turns(vectors_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([cv2.Rodrigues(vector)[0] for vector in vectors_rad], dtype=np.float64)
