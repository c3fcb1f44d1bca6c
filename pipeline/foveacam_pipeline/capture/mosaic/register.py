"""How far one small picture is moved against another, with its error: phase correlation, Gauss-Newton."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

REACH_PX = 16
"""Margin of the pictures, and the farthest that is found."""
SIGMA_PX = 1.0
"""Both are smoothed by this: the optics pass nothing finer, noise loses four fifths."""
ROUNDS = 8
STOP_PX = 0.005
LEAST_SCORE = 0.7
LEAST_CONTRAST = 1.5
"""Standard deviation, grey levels: less is noise."""
CORRELATION = 12.0
"""The optics' blur and ours tie neighbouring px together: so many hold one independent sample (deduced)."""
FLOOR_SIGMA_PX = 0.03
WORST_SIGMA_PX = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Registered:
    """`shift_px`: (2,) how much further right and down a thing is in the second picture, and its error."""

    shift_px: NDArray[np.float64]
    covariance: NDArray[np.float64]
    score: float


def register(first: NDArray[np.float32], second: NDArray[np.float32]) -> Registered | None:
    """Return how two pictures (n, n) of the same thing lie; None where they tell nothing or do not match."""
    a, b = (
        np.asarray(cv2.GaussianBlur(image, (0, 0), SIGMA_PX), dtype=np.float32) for image in (first, second)
    )
    m = REACH_PX
    reference = a[m:-m, m:-m]
    if min(float(reference.std()), float(b[m:-m, m:-m].std())) < LEAST_CONTRAST:
        return None
    window = cv2.createHanningWindow((a.shape[1], a.shape[0]), cv2.CV_32F)
    start, _ = cv2.phaseCorrelate(a - a.mean(), b - b.mean(), window)
    best: Registered | None = None
    for shift in (np.array(start), np.zeros(2)):
        found = _refined(reference, b, shift)
        if found is not None and (best is None or found.score > best.score):
            best = found
        if best is not None and best.score > 0.95:
            break
    return best


def _refined(
    reference: NDArray[np.float32], b: NDArray[np.float32], start: NDArray[np.float64]
) -> Registered | None:
    shift = start.copy()
    target = _normalised(reference)
    for _ in range(ROUNDS):
        if float(np.abs(shift).max()) > REACH_PX - 2:
            return None
        moved = _normalised(_moved(b, shift, reference.shape))
        slopes = _slopes((target + moved) / 2.0)
        normal = slopes @ slopes.T
        if not np.linalg.cond(normal) < 1e4:
            return None
        step = np.linalg.solve(normal, slopes @ (target - moved).ravel())
        shift = shift + step
        if float(np.abs(step).max()) < STOP_PX:
            break
    moved = _normalised(_moved(b, shift, reference.shape))
    score = float(np.mean(target * moved))
    energy = _slopes(target) @ _slopes(moved).T
    information = (energy + energy.T) / 2.0
    if score < LEAST_SCORE or not np.linalg.eigvalsh(information).min() > 0.0:
        return None
    noise = CORRELATION * max(2.0 * (1.0 - score), 1e-6) / 2.0
    covariance = noise * np.linalg.inv(information) + FLOOR_SIGMA_PX**2 * np.eye(2)
    if float(np.linalg.eigvalsh(covariance).max()) > WORST_SIGMA_PX**2:
        return None
    return Registered(shift_px=shift, covariance=covariance, score=score)


def _moved(
    image: NDArray[np.float32], shift: NDArray[np.float64], shape: tuple[int, ...]
) -> NDArray[np.float32]:
    to_image = np.array([[1.0, 0.0, REACH_PX + shift[0]], [0.0, 1.0, REACH_PX + shift[1]]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, to_image, (shape[1], shape[0]), flags=flags), dtype=np.float32)


def _normalised(image: NDArray[np.float32]) -> NDArray[np.float64]:
    deviation = max(float(image.std()), 1e-6)
    return np.asarray((image - image.mean()) / deviation, dtype=np.float64)


def _slopes(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, n) derivatives along x and y."""
    down, right = np.gradient(image)
    return np.stack([right.ravel(), down.ravel()])
