"""Normalised cross-correlation of a patch with every place of a picture, and the peak of the score map.

Positions in a map are those of the patch's first pixel, (x, y) px of the picture. A score is 1 for a patch
that differs by brightness and contrast alone, 0 where one of the two is flat. `point.py` refines a peak.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

UNSEEN = -1.0
"""Score of a place that does not count; the lowest possible correlation."""
FLAT_VARIANCE = float(np.finfo(np.float64).eps)
"""Variance below which OpenCV takes a patch for flat, and lets it fit everywhere."""


def score_map(
    picture: NDArray[np.float32] | NDArray[np.uint8],
    patch: NDArray[np.float32] | NDArray[np.uint8],
    *,
    weights: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Return the correlation, -1 to 1, of a patch at each place, (H - h + 1, W - w + 1) float32.

    `picture`: (H, W), `patch`: (h, w), of one dtype. `weights`: (h, w), enter squared. A flat patch and flat
    parts of the picture score 0; with weights, what OpenCV's rounding leaves of such parts is finite but may
    be anything. Raise ValueError where the patch is larger than the picture.
    """
    if patch.shape[0] > picture.shape[0] or patch.shape[1] > picture.shape[1]:  # OpenCV would swap the two
        raise ValueError(f"a patch of {patch.shape} px does not fit in a picture of {picture.shape}; cut it")
    found = cv2.matchTemplate(picture, patch, cv2.TM_CCOEFF_NORMED, mask=weights)
    scores = np.asarray(found, dtype=np.float32)
    if weights is not None:  # OpenCV divides by a weighted deviation of 0
        np.nan_to_num(scores, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    elif scores[0, 0] == 1.0 and float(np.var(patch, dtype=np.float64)) < FLAT_VARIANCE:
        scores.fill(0.0)
    return scores


def correlation(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return the correlation of two pictures of one shape, -1 to 1."""
    return float(score_map(one, other)[0, 0])


def largest(scores: NDArray[np.float32] | NDArray[np.float64]) -> tuple[int, int]:
    """Return the (x, y) of the largest entry of a map, the first of equal ones."""
    y, x = divmod(int(np.argmax(scores)), scores.shape[1])
    return x, y


def peak(scores: NDArray[np.float32]) -> tuple[float, float, float]:
    """Return (x, y, score) of the largest entry, x and y to a fraction by a parabola each."""
    x, y = largest(scores)
    fractions = [
        vertex(*line[index - 1 : index + 2].tolist()) if 0 < index < len(line) - 1 else 0.0
        for index, line in ((x, scores[y]), (y, scores[:, x]))
    ]
    return x + fractions[0], y + fractions[1], float(scores[y, x])


def vertex(before: float, middle: float, after: float) -> float:
    """Return how far the parabola through three equidistant values peaks from the middle one, in steps.

    0 where the three have no maximum.
    """
    bend = before - 2.0 * middle + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0


def best_outside(scores: NDArray[np.float32], at: tuple[int, int], *, guard_px: tuple[int, int]) -> float:
    """Return the best score farther than `guard_px` along x or y from a place; `UNSEEN` where nothing is.

    The best score minus this is the lead of a peak: how clearly it is the right one.
    """
    left, top = (max(0, place - guard) for place, guard in zip(at, guard_px, strict=True))
    right, bottom = (place + guard + 1 for place, guard in zip(at, guard_px, strict=True))
    beside = scores[top:bottom]
    parts = (scores[:top], scores[bottom:], beside[:, :left], beside[:, right:])
    return max(float(part.max(initial=UNSEEN)) for part in parts)
