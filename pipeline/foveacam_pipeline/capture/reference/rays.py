"""Rays and points: what is between where a sight shows a thing and where it should, and how that changes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.rail_stops import EYES
from foveacam_pipeline.capture.reference.fovea_views import FoveaView
from foveacam_pipeline.capture.reference.matching import SampleMatch
from foveacam_pipeline.capture.reference.rail_model import COLUMNS, RAIL, STOP, RailModel, Whole
from foveacam_pipeline.capture.reference.values import Floats
from foveacam_pipeline.models.calibration import Calibration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rays:
    """n matches, by sample in order. `whiten`: (n, 2, 2) makes residuals of matching's error alone unit.

    `gaze_px`, `aside_px_m`, `about_px`: (n, 2), `pupil_m`: (n,) as in `EyeLook`; `eye_m`: (n, 3).
    """

    sample: Whole
    sight: Whole
    stop: Whole
    eye: Whole
    gaze_px: Floats
    aside_px_m: Floats
    pupil_m: Floats
    about_px: Floats
    eye_m: Floats
    whiten: Floats
    f_px: float

    @classmethod
    def of(
        cls,
        matches: Sequence[SampleMatch],
        sights: Sequence[FoveaView],
        calibration: Calibration,
        *,
        floor_px: float,
    ) -> "Rays":
        """Return matches as rays; `floor_px`: what every ray may be off by besides matching's error."""
        seen = [sights[match.sight] for match in matches]
        covariances = np.array([match.covariance for match in matches]) + floor_px**2 * np.eye(2)
        references = np.array([calibration.reference_rig_m(role) for role in EYES])
        eye = np.array([sight.eye for sight in seen], dtype=np.intp)
        return cls(
            sample=np.array([match.sample for match in matches], dtype=np.intp),
            sight=np.array([match.sight for match in matches], dtype=np.intp),
            stop=np.array([sight.stop for sight in seen], dtype=np.intp),
            eye=eye,
            gaze_px=np.array([sight.look.gaze_px for sight in seen]),
            aside_px_m=np.array([sight.look.aside_px_m for sight in seen]),
            pupil_m=np.array([sight.look.pupil_m for sight in seen]),
            about_px=np.array([match.about_px for match in matches]),
            eye_m=references[eye],
            whiten=np.linalg.inv(np.linalg.cholesky(covariances)),
            f_px=calibration.fovea_f_px,
        )

    def __len__(self) -> int:
        return len(self.sample)

    def only(self, kept: NDArray[np.bool_]) -> "Rays":
        """Return those that are kept."""
        names = (
            "sample",
            "sight",
            "stop",
            "eye",
            "gaze_px",
            "aside_px_m",
            "pupil_m",
            "about_px",
            "eye_m",
            "whiten",
        )
        return Rays(**{name: getattr(self, name)[kept] for name in names}, f_px=self.f_px)

    def centres_m(self, model: RailModel, unknowns: Floats) -> Floats:
        """Return (n, 3): the eyes' reference points, judged scan's rig frame."""
        stands = model.stands(unknowns)
        turns, places = (np.array([getattr(each, name) for each in stands]) for name in ("turn", "place_m"))
        return np.asarray(
            np.einsum("nij,nj->ni", turns[self.stop], self.eye_m) + places[self.stop], dtype=np.float64
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearizedRays:
    """Residuals (n, 2), fovea px, and their slopes: by the points (n, 2, 3), by the unknowns (n, 2, COLUMNS).

    `columns`: (n, COLUMNS), which unknowns those are.
    """

    residual_px: Floats
    by_unknowns: Floats
    columns: Whole
    by_point: Floats


def linear(rays: Rays, points_m: Floats, model: RailModel, unknowns: Floats) -> LinearizedRays:
    """Return what is between rays and the points (m, 3) of their samples."""
    stands = model.stands(unknowns)
    turns = np.array([stand.turn for stand in stands])[rays.stop]
    places = np.array([stand.place_m for stand in stands])[rays.stop]
    shifts = np.array([stand.shifts_px for stand in stands])[rays.stop, rays.eye]
    own = np.einsum("nji,nj->ni", turns, points_m[rays.sample] - places)
    from_eye = own - rays.eye_m
    q = 1.0 / from_eye[:, 2]
    seen = rays.f_px * from_eye[:, :2] * q[:, None]
    moving = rays.aside_px_m + rays.pupil_m[:, None] * rays.about_px
    columns = model.columns(rays.stop, rays.eye, rays.sight)
    looks = (unknowns * model.sigmas)[columns[:, -2:]]
    residual = seen - rays.gaze_px - shifts - looks - moving * q[:, None] - rays.about_px
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
