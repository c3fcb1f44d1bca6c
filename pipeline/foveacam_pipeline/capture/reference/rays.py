"""Rays and points: the residual of a sample in a view, and its derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.rail_stops import EYES
from foveacam_pipeline.capture.reference.matching import SampleMatch
from foveacam_pipeline.capture.reference.rail_model import COLUMNS, RAIL, STOP, Integers, RailModel
from foveacam_pipeline.capture.reference.values import Floats
from foveacam_pipeline.capture.reference.views import FoveaView
from foveacam_pipeline.models.calibration import Calibration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rays:
    """n matches, in order of sample. `whiten`: (n, 2, 2) scales residuals to unit matching error.

    `gaze_px`, `pivot_px_m`, `relative_px`: (n, 2), `pupil_m`: (n,) as in `EyeLook`; `eye_m`: (n, 3).
    """

    sample: Integers
    view: Integers
    stop: Integers
    eye: Integers
    gaze_px: Floats
    pivot_px_m: Floats
    pupil_m: Floats
    relative_px: Floats
    eye_m: Floats
    whiten: Floats
    f_px: float

    @classmethod
    def of(
        cls,
        matches: Sequence[SampleMatch],
        views: Sequence[FoveaView],
        calibration: Calibration,
        *,
        floor_px: float,
    ) -> "Rays":
        """Return matches as rays; `floor_px`: error of every ray in addition to matching's."""
        seen = [views[match.view] for match in matches]
        covariances = np.array([match.covariance for match in matches]) + floor_px**2 * np.eye(2)
        references = np.array([calibration.reference_rig_m(role) for role in EYES])
        eye = np.array([view.eye for view in seen], dtype=np.intp)
        return cls(
            sample=np.array([match.sample for match in matches], dtype=np.intp),
            view=np.array([match.view for match in matches], dtype=np.intp),
            stop=np.array([view.stop for view in seen], dtype=np.intp),
            eye=eye,
            gaze_px=np.array([view.look.gaze_px for view in seen]),
            pivot_px_m=np.array([view.look.pivot_px_m for view in seen]),
            pupil_m=np.array([view.look.pupil_m for view in seen]),
            relative_px=np.array([match.relative_px for match in matches]),
            eye_m=references[eye],
            whiten=np.linalg.inv(np.linalg.cholesky(covariances)),
            f_px=calibration.fovea_f_px,
        )

    def __len__(self) -> int:
        return len(self.sample)

    def select(self, mask: NDArray[np.bool_]) -> "Rays":
        """Return the rays where `mask`, (n,), is true."""
        names = (
            "sample",
            "view",
            "stop",
            "eye",
            "gaze_px",
            "pivot_px_m",
            "pupil_m",
            "relative_px",
            "eye_m",
            "whiten",
        )
        return Rays(**{name: getattr(self, name)[mask] for name in names}, f_px=self.f_px)

    def centres_m(self, model: RailModel, unknowns: Floats) -> Floats:
        """Return (n, 3): the eyes' reference points, judged scan's rig frame."""
        stop_poses = model.stop_poses(unknowns)
        turns, places = (
            np.array([getattr(each, name) for each in stop_poses]) for name in ("turn", "position_m")
        )
        return np.asarray(
            np.einsum("nij,nj->ni", turns[self.stop], self.eye_m) + places[self.stop], dtype=np.float64
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearizedRays:
    """Residuals (n, 2), fovea px, and their derivatives: points (n, 2, 3), unknowns (n, 2, COLUMNS).

    `columns`: (n, COLUMNS), which unknowns those are.
    """

    residual_px: Floats
    by_unknowns: Floats
    columns: Integers
    by_point: Floats


def linearize(rays: Rays, points_m: Floats, model: RailModel, unknowns: Floats) -> LinearizedRays:
    """Return the residuals of rays at the points (m, 3) of their samples, with derivatives."""
    stop_poses = model.stop_poses(unknowns)
    turns = np.array([pose.turn for pose in stop_poses])[rays.stop]
    places = np.array([pose.position_m for pose in stop_poses])[rays.stop]
    shifts = np.array([pose.shifts_px for pose in stop_poses])[rays.stop, rays.eye]
    own = np.einsum("nji,nj->ni", turns, points_m[rays.sample] - places)
    from_eye = own - rays.eye_m
    q = 1.0 / from_eye[:, 2]
    seen = rays.f_px * from_eye[:, :2] * q[:, None]
    moving = rays.pivot_px_m + rays.pupil_m[:, None] * rays.relative_px
    columns = model.columns(rays.stop, rays.eye, rays.view)
    looks = (unknowns * model.sigmas)[columns[:, -2:]]
    residual = seen - rays.gaze_px - shifts - looks - moving * q[:, None] - rays.relative_px
    by_own = np.zeros((len(rays), 2, 3))
    by_own[:, 0, 0] = by_own[:, 1, 1] = rays.f_px * q
    by_own[:, :, 2] = (moving * q[:, None] - seen) * q[:, None]
    by_point = np.einsum("nij,nkj->nik", by_own, turns)
    return LinearizedRays(
        residual_px=residual,
        by_unknowns=_by_unknowns(rays, model, by_own=by_own, by_point=by_point, own=own)
        * model.sigmas[columns][:, None, :],
        columns=columns,
        by_point=by_point,
    )


def _by_unknowns(rays: Rays, model: RailModel, *, by_own: Floats, by_point: Floats, own: Floats) -> Floats:
    slopes = np.zeros((len(rays), 2, COLUMNS))
    along_m = np.array([stop.along_m for stop in model.stops])[rays.stop]
    slopes[:, :, :RAIL] = -along_m[:, None, None] * by_point
    slopes[:, :, RAIL : RAIL + 3] = -by_point
    slopes[:, :, RAIL + 3 : RAIL + STOP] = by_own @ _cross(own)
    slopes[:, :, RAIL + STOP : RAIL + STOP + 2] = slopes[:, :, RAIL + STOP + 2 :] = -np.eye(2)
    return slopes


def _cross(vectors: Floats) -> Floats:
    """Return (n, 3, 3): [v]x, so that [v]x a = v x a."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], axis=1
    )
