"""Pose of the target of three markers in the rig frame, from one wide view of it.

All corners of all markers are fitted together with the printed layout. A distance measured by tape replaces
the scale of the print; directions do not change.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.robust_least_squares import terms_covariance
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics

LARGEST_MISFIT_WIDE_PX = 0.5
"""Maximum rms residual; with a larger one the layout is not the printed one."""
TAPE_TOLERANCE = 0.05
"""Maximum relative difference of tape and print."""
MIN_MARKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetPose:
    """The plane of the target in the rig frame.

    `rotation`: (3, 3) rig_from_target; the target's x runs to the right and y down as printed. `middle_m`:
    (3,) of the wide camera's marker, rig frame. `scale`: metres per printed metre, 1 unless measured by tape.
    `misfit_px`: rms residual of the layout, wide px. `distance_sigma_m`: standard error of the distance.
    """

    rotation: NDArray[np.float64]
    middle_m: NDArray[np.float64]
    layout: MarkerLayout
    misfit_px: float
    distance_sigma_m: float
    scale: float = 1.0

    @property
    def distance_m(self) -> float:
        """Distance of the wide camera's marker."""
        return float(np.linalg.norm(self.middle_m))

    def points_rig_m(self, places_m: NDArray[np.float64], role: Role) -> NDArray[np.float64]:
        """Return points on a camera's marker, (n, 2) m from its middle as printed, as (n, 3) m, rig frame."""
        flat = self.scale * (places_m + self.layout.middle_m(role))
        return np.asarray(self.middle_m + flat @ self.rotation[:, :2].T, dtype=np.float64)

    def marker_rig_m(self, role: Role) -> NDArray[np.float64]:
        """Return the middle of a camera's marker, (3,) metres, rig frame."""
        return np.asarray(self.points_rig_m(np.zeros((1, 2)), role)[0])

    def at_distance(self, distance_m: float) -> "TargetPose":
        """Return the target in the same directions at a taped distance; raise InvalidInput if implausible."""
        factor = distance_m / self.distance_m
        if not abs(factor - 1.0) <= TAPE_TOLERANCE:
            raise InvalidInput(
                f"target: by tape it is {distance_m:.3f} m away, by its markers {self.distance_m:.3f} m; "
                "measure the distance and the markers' side again, or leave the distance open"
            )
        return replace(
            self,
            middle_m=self.middle_m * factor,
            scale=self.scale * factor,
            distance_sigma_m=self.distance_sigma_m * factor,
        )


def locate_target(
    views: dict[int, MarkerView],
    layout: MarkerLayout,
    wide: Intrinsics,
    *,
    distance_m: float | None = None,
) -> TargetPose:
    """Return the pose of the target from its markers in a wide view, by id; others are ignored.

    Raise InvalidInput when fewer than two are seen, two are swapped, or the layout is not the printed one.
    """
    check_order(views, layout)
    known = [(role, views[layout.id_of(role)]) for role in Role if layout.id_of(role) in views]
    if len(known) < MIN_MARKERS:
        raise InvalidInput(
            f"target: {len(known)} of its markers in the wide view, {MIN_MARKERS} are needed; "
            f"uncover markers {', '.join(map(str, layout.ids))} and light them"
        )
    places = np.vstack([view.places_m + layout.middle_m(role) for role, view in known])
    pixels = np.vstack([view.corners_px for _, view in known])
    pose = _solve_pose(places, pixels, wide, layout)
    if pose.misfit_px > LARGEST_MISFIT_WIDE_PX:
        raise InvalidInput(
            f"target: its markers lie {pose.misfit_px:.2f} wide px (rms) from where a layout of "
            f"{1e3 * layout.side_m:g} mm, {1e3 * layout.spacing_m:g} mm apart has them, at most "
            f"{LARGEST_MISFIT_WIDE_PX:g} px; correct the layout or flatten the target"
        )
    return pose if distance_m is None else pose.at_distance(distance_m)


def check_order(views: dict[int, MarkerView], layout: MarkerLayout) -> None:
    """Raise InvalidInput naming markers that are in the wrong order, from left to right."""
    wanted = [layout.left_id, layout.wide_id, layout.right_id]
    expected = [marker_id for marker_id in wanted if marker_id in views]
    seen = sorted(expected, key=lambda marker_id: float(views[marker_id].corners_px[:, 0].mean()))
    if seen != expected:
        raise InvalidInput(
            f"target: from the left its markers are {_listed(seen)} instead of {_listed(expected)} "
            f"({layout.left_id} is the left eye's, {layout.right_id} the right eye's): they are swapped; "
            "put each marker in its place, upright"
        )


def _listed(ids: Iterable[int]) -> str:
    return ", ".join(map(str, ids))


def _solve_pose(
    places_m: NDArray[np.float64], pixels: NDArray[np.float64], wide: Intrinsics, layout: MarkerLayout
) -> TargetPose:
    points = np.column_stack([places_m, np.zeros(len(places_m))])
    tangents = tan_from_angles(wide.angles_rad(pixels))
    plain = np.eye(3)
    found, turns, shifts, _ = cv2.solvePnPGeneric(points, tangents, plain, None, flags=cv2.SOLVEPNP_IPPE)
    if not found:
        raise InvalidInput("target: no pose explains its markers; check their ids, side and spacing")
    solved = []
    for turn, shift in zip(turns, shifts, strict=True):
        turn, shift = cv2.solvePnPRefineLM(points, tangents, plain, None, turn, shift)
        image, jacobian = cv2.projectPoints(points, turn, shift, plain, None)
        misfit = np.asarray(image, dtype=np.float64)[:, 0] - tangents
        slopes = np.asarray(jacobian, dtype=np.float64)[:, :6]
        solved.append((float(np.sum(misfit**2)), turn, shift, slopes))
    squares, turn, shift, jacobian = min(solved, key=lambda one: one[0])
    middle = np.asarray(shift, dtype=np.float64).ravel()
    return TargetPose(
        rotation=np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64),
        middle_m=middle,
        layout=layout,
        misfit_px=wide.fx_px * math.sqrt(squares / len(points)),
        distance_sigma_m=_distance_sigma_m(jacobian, squares, middle),
    )


def _distance_sigma_m(jacobian: NDArray[np.float64], squares: float, middle: NDArray[np.float64]) -> float:
    variance = squares / max(len(jacobian) - 6, 1)
    covariance = variance * terms_covariance(jacobian)[3:, 3:]
    along = middle / np.linalg.norm(middle)
    return float(np.sqrt(along @ covariance @ along))
