"""Errors of disparities against a known truth, by a network, a matcher or any other method.

Needs no torch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.learn.pair_folder import PairTruth

BAD_PX = 1.0
LEAST_TOTAL_PX = 1.0
"""Least total disparity for errors of depth: points at infinity or beyond count as this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthFigures:
    """Errors against the truth where both eyes see the surface, over all pairs."""

    epe_px: float
    """Mean absolute error (end-point error) of the known disparities."""
    bad_1: float
    """Share of errors above 1 px."""
    answered: float
    """Share of the pixels with a known disparity."""
    within_1_sigma: float | None = None
    """Share of errors within the stated sigma; a correct one gives 0.757 for a Laplace error, 0.683 for a
    Gaussian one. None for a method that states none."""
    abs_rel: float | None = None
    """Mean of the absolute errors of depth over the true depth; None where it was not measured."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MethodAnswer:
    """Disparity (h, w) of a method, px, and the standard deviation of its error, px; NaN where unknown."""

    disparity_px: NDArray[np.float32]
    sigma_px: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthSums:
    """Sums over the pixels of one pair that both eyes see."""

    seen: int
    answered: int
    off_px: float
    bad: int
    with_sigma: int
    within: int
    off_rel: float
    """Sum of the absolute errors of depth over the true depth."""


def truth_sums(answer: MethodAnswer, truth: PairTruth, *, offset_px: float) -> TruthSums:
    """Return the sums of one pair; `offset_px`: total minus residual disparity."""
    judged = truth.both & np.isfinite(answer.disparity_px)
    off_px = np.abs(answer.disparity_px - truth.disparity_px)[judged]
    sigma_px = np.full(off_px.shape, np.nan) if answer.sigma_px is None else answer.sigma_px[judged]
    stated = np.isfinite(sigma_px)
    total_px = np.maximum(answer.disparity_px[judged] + offset_px, LEAST_TOTAL_PX)
    return TruthSums(
        seen=int(truth.both.sum()),
        answered=len(off_px),
        off_px=float(off_px.sum(dtype=np.float64)),
        bad=int((off_px > BAD_PX).sum()),
        with_sigma=int(stated.sum()),
        within=int((off_px[stated] <= sigma_px[stated]).sum()),
        off_rel=float((off_px / total_px).sum(dtype=np.float64)),
    )


def truth_figures(rows: Sequence[TruthSums]) -> TruthFigures | None:
    """Return the figures of all pairs; None where no pixel has truth."""
    pixels, answered = sum(row.seen for row in rows), sum(row.answered for row in rows)
    stated = sum(row.with_sigma for row in rows)
    if not pixels:
        return None
    return TruthFigures(
        epe_px=sum(row.off_px for row in rows) / max(1, answered),
        bad_1=sum(row.bad for row in rows) / max(1, answered),
        answered=answered / pixels,
        within_1_sigma=sum(row.within for row in rows) / stated if stated else None,
        abs_rel=sum(row.off_rel for row in rows) / max(1, answered),
    )


def filled(disparity_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a disparity map (h, w) whose holes have the smaller of the nearest known values in their row.

    The smaller one belongs to the background, which is what is hidden. Rows without any get zero.
    """
    known = np.isfinite(disparity_px)
    before = _carried(disparity_px, known)
    after = _carried(disparity_px[:, ::-1], known[:, ::-1])[:, ::-1]
    behind = np.fmin(before, after)
    return np.nan_to_num(np.where(known, disparity_px, behind)).astype(np.float32)


def _carried(values: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    place = np.where(known, np.arange(values.shape[1])[None, :], 0)
    np.maximum.accumulate(place, axis=1, out=place)
    return np.take_along_axis(values, place, axis=1)
