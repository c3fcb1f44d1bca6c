"""Find the candidate positions of a patch of the wide image in both foveae, along the epipolar line.

A target at depth Z is shifted by B f / 2Z, to the right in the left eye and to the left in the right one. So
three correlations are added at equal and opposite shifts: the patch with either fovea, and the foveae with
each other. A peak of the sum is a surface on the target's line of sight.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import UNSEEN, peak, score_map
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import WidePatch

BAND_PX = 14
"""Largest distance of a target from its row, survey px: calibration drift."""
SLACK_PX = 3
"""Largest deviation of the two eyes' shifts from equal and opposite, survey px."""
MOVING_SLACK_PX = 10
"""The same for a moving target."""
ROW_PENALTY = 0.04
"""Penalty on the correlation at the edge of the band: keeps the row where texture cannot determine it."""
GUARD_PX = 6
"""Least distance between candidates, survey px."""
CANDIDATES = 3
LEAST_NORM = 1e-3

Scores: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchCandidate:
    """A place where both foveae may show the patch.

    `left`, `right`: (2,) tangents from each eye's gaze. `score`: the weaker correlation with the patch.
    `joint`: mean of all three correlations. `rows_apart_px`: difference of the two rows, survey px.
    """

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    score: float
    joint: float
    rows_apart_px: float


def candidates(
    look: ReducedLook, template: WidePatch, target: NDArray[np.float64], *, slack_px: int = SLACK_PX
) -> tuple[MatchCandidate, ...]:
    """Return the best candidates, best first; none unless the patch fits into both eyes.

    `target`: (2,) tangents from the rig's origin at the time of the look.
    """
    target_px = target * template.f_px
    bands = [_band(eye, template, float(target_px[1])) for eye in (look.left, look.right)]
    left, right = bands
    if left is None or right is None:
        return ()
    profile_left, profile_right = left.profile(), right.profile()[::-1]
    start_left = left.u0_px - float(target_px[0])
    start_right = float(target_px[0]) - (right.u0_px + len(profile_right) - 1)
    first = max(round(start_left), round(start_right), -slack_px)
    last = min(round(start_left) + len(profile_left), round(start_right) + len(profile_right))
    if last - first < 3:
        return ()
    shifts = np.arange(first, last)
    kernel = np.ones((1, 2 * slack_px + 1), dtype=np.uint8)
    rows = [
        cv2.dilate(np.ascontiguousarray(profile)[None], kernel)[0][first - round(start) : last - round(start)]
        for profile, start in ((profile_left, start_left), (profile_right, start_right))
    ]
    between = _between(look, template.patch.shape, target_px, shifts)
    joint = np.asarray((rows[0] + rows[1] + between) / 3.0, dtype=np.float32)
    return tuple(
        _candidate(look, left, right, float(target_px[0]), shift_px=shift, joint=score, near_px=slack_px + 1)
        for shift, score in _peaks(joint, shifts)
    )


def _candidate(
    look: ReducedLook,
    left: "_Band",
    right: "_Band",
    target_u_px: float,
    *,
    shift_px: float,
    joint: float,
    near_px: int,
) -> MatchCandidate:
    """Refine each eye's place separately."""
    at_left = left.refined(target_u_px + shift_px, near_px)
    at_right = right.refined(target_u_px - shift_px, near_px)
    return MatchCandidate(
        left=(np.array(at_left[:2]) - look.left.centre_px) / look.f_px,
        right=(np.array(at_right[:2]) - look.right.centre_px) / look.f_px,
        score=min(at_left[2], at_right[2]),
        joint=joint,
        rows_apart_px=abs(at_left[1] - at_right[1]),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Band:
    """Rows of a correlation map in which the target may lie; its first entry is at (u0, v0) plane px."""

    scores: Scores
    u0_px: float
    v0_px: float

    def profile(self) -> Scores:
        """Return the best score of each column."""
        return np.asarray(self.scores.max(axis=0), dtype=np.float32)

    def refined(self, u_px: float, near_px: int) -> tuple[float, float, float]:
        """Return (u, v, score) of the best place within `near_px` columns of `u_px`, plane px."""
        column = min(max(round(u_px - self.u0_px), 0), self.scores.shape[1] - 1)
        first = max(0, column - near_px - 1)
        x, y, score = peak(self.scores[:, first : column + near_px + 2])
        return self.u0_px + first + x, self.v0_px + y, score


def _band(eye: ReducedEye, template: WidePatch, target_v_px: float) -> _Band | None:
    """Correlate the patch with one fovea; return None when it does not fit into the image."""
    height, width = template.patch.shape
    half_x, half_y = (width - 1) // 2, (height - 1) // 2
    row = round(target_v_px - eye.v0_px) - half_y
    rows = eye.image.shape[0] - height + 1
    first, last = max(0, row - BAND_PX), min(rows, row + BAND_PX + 1)
    if last <= first or eye.image.shape[1] < width:
        return None
    scores = score_map(eye.image[first : last + height - 1], template.patch)
    offsets = (np.arange(first, last, dtype=np.float32) - row) / BAND_PX
    scores -= ROW_PENALTY * (offsets * offsets)[:, None]
    scores[eye.hidden(template.patch.shape, slice(first, last))] = UNSEEN
    return _Band(scores=scores, u0_px=eye.u0_px + half_x, v0_px=eye.v0_px + half_y + first)


def _between(
    look: ReducedLook, shape: tuple[int, ...], target_px: NDArray[np.float64], shifts: NDArray[np.int_]
) -> Scores:
    """Return the correlation of the foveae with each other at opposite shifts, windows of the patch's size.

    It depends only on the target's depth, not on its exact place along the row.
    """
    u_px, v_px = target_px.tolist()
    left = _Windows.about(look.left, shape, u_px=u_px, v_px=v_px, shifts=shifts)
    right = _Windows.about(look.right, shape, u_px=u_px, v_px=v_px, shifts=-shifts)
    best = left.correlation(right)
    if len(shifts) > 1:  # half steps: one eye moved by one px more than the other
        half = left.correlation(right, ahead=1)
        best[1:] = np.maximum(best[1:], half)
        best[:-1] = np.maximum(best[:-1], half)
    return best


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Windows:
    """Windows of one eye along a row: (n) starts within `flat`, their means and norms.

    `flat`: the strip of the image column by column, so that a window is `size` consecutive numbers.
    """

    flat: Scores
    starts: list[int]
    size: int
    mean: NDArray[np.float64]
    norm: NDArray[np.float64]

    @classmethod
    def about(
        cls, eye: ReducedEye, shape: tuple[int, ...], *, u_px: float, v_px: float, shifts: NDArray[np.int_]
    ) -> "_Windows":
        """Take the windows about (u + shift, v) of the eye's plane, (h, w) = `shape`."""
        half_y, half_x = (shape[0] - 1) // 2, (shape[1] - 1) // 2
        height, width = eye.image.shape
        row = min(max(round(v_px - eye.v0_px), half_y), height - 1 - half_y)
        strip = np.ascontiguousarray(eye.image[row - half_y : row + half_y + 1].T)
        columns = np.clip(np.rint(u_px - eye.u0_px + shifts).astype(np.intp) - half_x, 0, width - shape[1])
        size = strip.shape[1] * shape[1]
        mean, square = (
            (total[columns + shape[1]] - total[columns]) / size
            for total in (_running(strip.sum(axis=1)), _running(np.einsum("xy,xy->x", strip, strip)))
        )
        norm = np.sqrt(np.maximum(size * (square - mean * mean), LEAST_NORM**2))
        starts = (columns * strip.shape[1]).tolist()
        return cls(flat=strip.ravel(), starts=starts, size=size, mean=mean, norm=norm)

    def correlation(self, other: "_Windows", *, ahead: int = 0) -> Scores:
        """Return the correlation of window `ahead` + k with the other's window k, (n - ahead,)."""
        size, one, two = self.size, self.flat, other.flat
        dots = [
            float(np.dot(one[a : a + size], two[b : b + size]))
            for a, b in zip(self.starts[ahead:], other.starts, strict=False)
        ]
        count = len(dots)
        shared = np.array(dots) - size * self.mean[ahead:] * other.mean[:count]
        return np.asarray(shared / (self.norm[ahead:] * other.norm[:count]), dtype=np.float32)


def _running(values: Scores) -> NDArray[np.float64]:
    """Return the sums of the first 0, 1, ... n values, (n + 1,)."""
    return np.concatenate([[0.0], np.cumsum(values, dtype=np.float64)])


def _peaks(joint: Scores, shifts: NDArray[np.int_]) -> Iterator[tuple[float, float]]:
    """Yield the shifts of the best places and their scores, all farther than a guard from each other."""
    left = joint.copy()
    for _ in range(CANDIDATES):
        top = float(left.max())
        if top <= 0.0:
            return
        plateau = np.flatnonzero(left >= top - 1e-6)
        plateau = plateau[np.abs(plateau - plateau[0]) <= GUARD_PX]
        shift = float(shifts[plateau].mean())
        yield shift, top
        left[np.abs(shifts - shift) <= GUARD_PX] = UNSEEN
