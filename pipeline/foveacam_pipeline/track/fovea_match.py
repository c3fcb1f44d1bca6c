"""Finds a followed target in a look of both foveae and triangulates its position.

Each eye's image at survey scale is correlated with the target's template of that eye, scaled by distance; a
left-right match then gives the disparity. This rejects look-alikes that the wide view cannot distinguish.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.matching.correlation import correlation, peak, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import Gazes, gazes_under
from foveacam_pipeline.verge.distance import LocatedPoint, triangulate
from foveacam_pipeline.verge.matching.fine import REACH_PX, FineMatch, MatchGuess, match_fine
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook, reduce_look
from foveacam_pipeline.verge.matching.wide_patch import survey_f_px

HALF_PX = 30
"""Half side of a target's template, survey px: a quarter of a degree."""
LEAST_SCALE, MOST_SCALE = 0.5, 2.0
LOST_RATIOS = (1.0, 0.8, 1.25)
"""Ratios of 1/Z at which a lost target is searched for: it may return nearer or farther, hence rescaled."""
SAME_SCALE = 0.05
"""Relative difference of 1/Z below which two depths are not both tried."""
FOUND_SCORE = 0.6
"""Least correlation of both eyes with the target's templates."""
RENEWED_SCORE = 0.6
RENEWAL = 0.1
FINE_SCORE = 0.6
ROWS_APART_PX = 4.0
"""Largest vertical residual of a valid match, fovea px; it allows for the target's motion in the exposure."""
LARGEST_SIGMA_PX = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FoveaReading:
    """The target in one look: its triangulated point, both eyes' lines of sight to it, and the match.

    `score`: the lower of both eyes' correlations with the target's templates, -1 to 1.
    """

    t_ns: int
    point: LocatedPoint
    gazes: Gazes
    fine: FineMatch
    score: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _EyePicture:
    """Templates of the target in one eye: the first, and one updated slowly; odd sides, survey px."""

    first: NDArray[np.float32]
    renewed: NDArray[np.float32]


class FoveaPicture:
    """Templates of the target in each eye, cut from a look in which its position was measured."""

    def __init__(
        self, sighting: Sighting, calibration: Calibration, target: Gazes, *, inverse_z_per_m: float
    ) -> None:
        """`target`: lines of sight of both eyes to it; `inverse_z_per_m`: 1/Z of it, in that look."""
        self._calibration = calibration
        self._f_px = survey_f_px(calibration.wide)
        self._inverse_z_per_m = self._last_per_m = inverse_z_per_m
        look = reduce_look(sighting, calibration, f_px=self._f_px)
        gazes = gazes_under(calibration, sighting.volts)
        self._pictures = [
            _EyePicture(first=picture, renewed=picture)
            for picture in (
                _cut(look.left, target.left - gazes.left, self._f_px),
                _cut(look.right, target.right - gazes.right, self._f_px),
            )
        ]

    def find(
        self,
        sighting: Sighting,
        *,
        inverse_z_per_m: float,
        least_score: float = FOUND_SCORE,
        ratios: Sequence[float] = (1.0,),
    ) -> FoveaReading | None:
        """Return the target in a look; None if it is not found.

        `inverse_z_per_m`: expected 1/Z of the target; `ratios`: multiples of it to try. `least_score`:
        correlation that both eyes must reach, -1 to 1.
        """
        look = reduce_look(sighting, self._calibration, f_px=self._f_px)
        gazes = gazes_under(self._calibration, sighting.volts)
        scale, found = self._best_scale(look, [inverse_z_per_m * ratio for ratio in ratios])
        if min(score for _, score in found) < least_score:
            return None
        left, right = (place / self._f_px for place, _ in found)
        reading = self._measured(sighting, gazes, left, right, score=min(score for _, score in found))
        if reading is None:
            return None
        self._last_per_m = 1.0 / reading.point.point_rig_m[2]
        if scale == 1.0 or reading.score >= RENEWED_SCORE:
            offsets = reading.gazes.left - gazes.left, reading.gazes.right - gazes.right
            self._renew(look.left, look.right, offsets, scale)
        return reading

    def _best_scale(
        self, look: ReducedLook, tried_per_m: list[float]
    ) -> tuple[float, list[tuple[NDArray[np.float64], float]]]:
        """Return the best scale for `tried_per_m` and the last hit, and each eye's place, score."""
        tried = list(tried_per_m)
        if all(abs(per_m / self._last_per_m - 1.0) >= SAME_SCALE for per_m in tried):
            tried.append(self._last_per_m)
        best: tuple[float, list[tuple[NDArray[np.float64], float]]] = (1.0, [])
        for per_m in tried:
            scale = float(np.clip(per_m / self._inverse_z_per_m, LEAST_SCALE, MOST_SCALE))
            found = [
                _best_place(eye, picture, scale)
                for eye, picture in zip((look.left, look.right), self._pictures, strict=True)
            ]
            if not best[1] or min(one[1] for one in found) > min(one[1] for one in best[1]):
                best = scale, found
        return best

    def _measured(
        self,
        sighting: Sighting,
        gazes: Gazes,
        left: NDArray[np.float64],
        right: NDArray[np.float64],
        *,
        score: float,
    ) -> FoveaReading | None:
        reach = (2 * REACH_PX[0], REACH_PX[1])
        fine = match_fine(sighting, self._calibration, MatchGuess(left=left, right=right, reach_px=reach))
        if fine.score < FINE_SCORE or fine.sigma_x_px > LARGEST_SIGMA_PX:
            return None
        if abs(fine.residual_y_px) > ROWS_APART_PX:
            return None
        half = fine.residual_px / (2.0 * self._calibration.fovea_f_px)
        centre = (left + right) / 2.0
        target = gazes.moved(centre + half, centre - half)
        point = triangulate(self._calibration, target, sigma_px=fine.sigma_x_px)
        if point is None:
            return None
        return FoveaReading(t_ns=sighting.left.t_ns, point=point, gazes=target, fine=fine, score=score)

    def _renew(
        self,
        left: ReducedEye,
        right: ReducedEye,
        offsets: tuple[NDArray[np.float64], NDArray[np.float64]],
        scale: float,
    ) -> None:
        """Update each eye's second template with the target's present appearance, if it fits the first."""
        for index, (eye, offset) in enumerate(zip((left, right), offsets, strict=True)):
            picture = self._pictures[index]
            seen = _cut(eye, offset, self._f_px, scale=scale)
            if correlation(seen, picture.first) < RENEWED_SCORE:
                continue
            renewed = cv2.addWeighted(picture.renewed, 1.0 - RENEWAL, seen, RENEWAL, 0.0)
            self._pictures[index] = _EyePicture(
                first=picture.first, renewed=np.asarray(renewed, dtype=np.float32)
            )


def _cut(
    eye: ReducedEye, offset: NDArray[np.float64], f_px: float, *, scale: float = 1.0
) -> NDArray[np.float32]:
    """Return the patch about `offset`, (2,) tangents from the gaze, resized to scale 1."""
    half = round(HALF_PX * scale)
    middle_y, middle_x = ((side - 1) / 2 for side in eye.image.shape)
    x, y = (offset * f_px).tolist()
    part = cv2.getRectSubPix(eye.image, (2 * half + 1, 2 * half + 1), (middle_x + x, middle_y + y))
    return _resized(np.asarray(part, dtype=np.float32), 2 * HALF_PX + 1)


def _resized(picture: NDArray[np.float32], side_px: int) -> NDArray[np.float32]:
    if picture.shape[0] == side_px:
        return picture
    return np.asarray(
        cv2.resize(picture, (side_px, side_px), interpolation=cv2.INTER_LINEAR), dtype=np.float32
    )


def _best_place(eye: ReducedEye, picture: _EyePicture, scale: float) -> tuple[NDArray[np.float64], float]:
    """Return the target's position in an eye, (2,) survey px from the gaze, and the correlation."""
    side = 2 * round(HALF_PX * scale) + 1
    middle_y, middle_x = ((length - side) / 2 for length in eye.image.shape)
    best, place = -1.0, np.zeros(2)
    for template in (picture.first, picture.renewed):
        x, y, score = peak(score_map(eye.image, _resized(template, side)))
        if score > best:
            best, place = score, np.array([x - middle_x, y - middle_y])
    return place, best
