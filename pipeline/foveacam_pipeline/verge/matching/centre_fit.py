"""Correlation of the wide patch about both foveae's centres, once they point nearly at the target."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import UNSEEN, peak, score_map
from foveacam_pipeline.verge.matching.survey import ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, bell, leaning

REACH_PX = 16
"""Search radius about the centres, survey px: 73 fovea px."""
ROW_PENALTY = 0.04
"""Penalty on the correlation at the end of the reach: keeps the row where texture cannot determine it."""
CENTRE_PENALTY = 0.2
"""The same for the mean place of both eyes, along x and y: it is well calibrated."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeanPlace:
    """Mean place of the patch in both eyes, (2,) tangents from the mean gaze, and its correlation.

    `lead`: how much more it correlates there than where the calibration expects it.
    """

    centre: NDArray[np.float64]
    score: float
    lead: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CentreFit:
    """Correlations of the patch about both foveae's centres: two maps, with the centres in their middles.

    `expected_px`: (2,) from the mean gaze to where the target should be by the calibration, survey px.
    """

    left: NDArray[np.float32]
    right: NDArray[np.float32]
    expected_px: NDArray[np.float64]
    f_px: float

    def peaks(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return each eye's best place of the patch, (2,) tangents from its gaze; and the weaker score."""
        (left, left_score), (right, right_score) = (
            _peak_about(m, self.expected_px, (0.0, ROW_PENALTY)) for m in (self.left, self.right)
        )
        return left / self.f_px, right / self.f_px, min(left_score, right_score)

    def given(self, residual: NDArray[np.float64]) -> MeanPlace:
        """Return the best mean place of both eyes, given left minus right place, (2,) tangents."""
        half = residual * (self.f_px / 2.0)
        left, right = _moved(self.left, half), _moved(self.right, -half)
        both = np.asarray((left + right) / 2.0, dtype=np.float32)
        centre, _ = _peak_about(both, self.expected_px, (CENTRE_PENALTY, CENTRE_PENALTY))
        here = _entry(centre)
        return MeanPlace(
            centre=centre / self.f_px,
            score=min(float(left[here]), float(right[here])),
            lead=float(both[here]) - float(both[_entry(self.expected_px)]),
        )


def vicinity(
    look: ReducedLook,
    template: WidePatch,
    expected: NDArray[np.float64],
    *,
    slope: tuple[float, float] = (0.0, 0.0),
) -> CentreFit:
    """Correlate the patch with both foveae about their centres.

    `expected`: (2,) tangents from the mean gaze to the target by the calibration. `slope`: of the surface, as
    `FineMatch.slope`; the patch is warped by half of it for each eye.
    """
    maps = []
    for eye, lean in ((look.left, 0.5), (look.right, -0.5)):
        patch = leaning(template.patch, lean * slope[0], lean * slope[1])
        half_y, half_x = ((side - 1) // 2 for side in template.patch.shape)
        middle_y, middle_x = ((side - 1) // 2 for side in eye.image.shape)
        reach_y, reach_x = half_y + REACH_PX, half_x + REACH_PX
        part = cv2.getRectSubPix(
            eye.image, (2 * reach_x + 1, 2 * reach_y + 1), (float(middle_x), float(middle_y))
        )
        maps.append(score_map(np.asarray(part, dtype=np.float32), patch, weights=bell(patch.shape)))
    return CentreFit(left=maps[0], right=maps[1], expected_px=expected * look.f_px, f_px=look.f_px)


def _peak_about(
    scores: NDArray[np.float32], expected_px: NDArray[np.float64], penalty: tuple[float, float]
) -> tuple[NDArray[np.float64], float]:
    """Return the (x, y) of the best place from the middle of a map, survey px, and its score.

    Scores fall with the distance from `expected_px`, by `penalty` along x and y at `REACH_PX`: this decides
    where texture cannot.
    """
    offsets = [
        (np.arange(side, dtype=np.float32) - (side - 1) / 2 - float(expected)) / REACH_PX
        for side, expected in zip(scores.shape[::-1], expected_px, strict=True)
    ]
    loss = penalty[0] * offsets[0][None, :] ** 2 + penalty[1] * offsets[1][:, None] ** 2
    x, y, score = peak(np.asarray(scores - loss, dtype=np.float32))
    return np.array([x - (scores.shape[1] - 1) / 2, y - (scores.shape[0] - 1) / 2]), score


def _entry(place_px: NDArray[np.float64]) -> tuple[int, int]:
    """Return the row and the column of a map at the (x, y) of a place from its middle, survey px."""
    row, column = (int(np.clip(round(float(place_px[k])) + REACH_PX, 0, 2 * REACH_PX)) for k in (1, 0))
    return row, column


def _moved(scores: NDArray[np.float32], shift_px: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the map whose entry at p is that of `scores` at p + shift; `UNSEEN` beyond its border."""
    matrix = np.array([[1.0, 0.0, float(shift_px[0])], [0.0, 1.0, float(shift_px[1])]])
    size = (scores.shape[1], scores.shape[0])
    moved = cv2.warpAffine(
        scores,
        matrix,
        size,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=UNSEEN,
    )
    return np.asarray(moved, dtype=np.float32)
