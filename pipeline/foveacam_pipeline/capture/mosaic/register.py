"""Measures the shift between two small pictures, with its error: phase correlation, then `match_point`."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.point import PositionPrior, match_point
from foveacam_pipeline.matching.windows import MatchWindow

REACH_PX = 16
"""Margin of the pictures, and the largest shift that is found."""
SIGMA_PX = 1.0
"""Sigma of the smoothing of both: the optics resolve nothing finer, and noise falls by four fifths."""
UNIFORM_WEIGHT_SIGMA_PX = 1e4
"""Standard deviation of the window's weights, so large that all px have equal weight."""
LEAST_SCORE = 0.7
LEAST_CONTRAST = 1.5
"""Minimum standard deviation of a picture with texture, grey levels; below it there is only noise."""
FLOOR_SIGMA_PX = 0.03
WORST_SIGMA_PX = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegisteredShift:
    """`shift_px`: (2,) how much further right and down an object is in the second picture, and its error."""

    shift_px: NDArray[np.float64]
    covariance: NDArray[np.float64]
    score: float


def register(first: NDArray[np.float32], second: NDArray[np.float32]) -> RegisteredShift | None:
    """Return the shift of two pictures (n, n) of one object; None for low contrast or no match."""
    a, b = (
        np.asarray(cv2.GaussianBlur(image, (0, 0), SIGMA_PX), dtype=np.float32) for image in (first, second)
    )
    m = REACH_PX
    reference = a[m:-m, m:-m]
    if min(float(reference.std()), float(b[m:-m, m:-m].std())) < LEAST_CONTRAST:
        return None
    window = cv2.createHanningWindow((a.shape[1], a.shape[0]), cv2.CV_32F)
    start, _ = cv2.phaseCorrelate(a - a.mean(), b - b.mean(), window)
    best: RegisteredShift | None = None
    pictures, half_px = (InterpolatedPicture.of(a), InterpolatedPicture.of(b)), (a.shape[0] - 1) // 2 - m
    for shift in (np.array(start), np.zeros(2)):
        found = _refine(*pictures, shift, half_px)
        if found is not None and (best is None or found.score > best.score):
            best = found
        if best is not None and best.score > 0.95:
            break
    return best


def _refine(
    first: InterpolatedPicture, second: InterpolatedPicture, start: NDArray[np.float64], half_px: int
) -> RegisteredShift | None:
    if float(np.abs(start).max()) > REACH_PX - 2:
        return None
    x_px, y_px = start.tolist()
    found = match_point(
        first,
        second,
        WindowPlacement(x_px=x_px, y_px=y_px),
        window=MatchWindow(half_px=half_px, weight_sigma_px=UNIFORM_WEIGHT_SIGMA_PX),
        prior=PositionPrior(slopes=0),
    )
    if found is None or found.score < LEAST_SCORE or float(np.abs(found.position_px).max()) > REACH_PX - 2:
        return None
    covariance = found.covariance + FLOOR_SIGMA_PX**2 * np.eye(2)
    if not np.isfinite(covariance).all() or float(np.linalg.eigvalsh(covariance).max()) > WORST_SIGMA_PX**2:
        return None
    return RegisteredShift(shift_px=found.position_px, covariance=covariance, score=found.score)
