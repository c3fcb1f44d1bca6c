"""Judges disparities without a truth: how alike both pictures are, and whether left and right agree."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.estimator import DepthEstimator
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

AGREED_PX = 1.0
"""Left and right agree where their disparities differ by no more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementSums:
    """Sums over the pixels of one pair, to be added up over pairs.

    `shown`: pixels of the left window; `answered`: of those, with a disparity; `compared`: of those, whose
    match lies in the right window; `photometric`: sum of their absolute differences of grey, 0 to 1;
    `judged`: compared pixels whose match has a disparity of its own; `agreed`: of those, within `AGREED_PX`.
    """

    shown: int
    answered: int
    compared: int
    photometric: float
    judged: int
    agreed: int


def agreement_sums(pair: RectifiedPair, found: DisparityMap, estimator: DepthEstimator) -> AgreementSums:
    """Return the sums of a pair; `estimator` computes the disparities of the right window as well."""
    disparity_px = found.residual_px
    right_px = estimator.estimate(mirrored(pair)).residual_px[:, ::-1]
    rows, columns = np.nonzero(np.isfinite(disparity_px) & pair.valid_left)
    matched_px = (columns - disparity_px[rows, columns]).astype(np.float32)
    nearest = np.rint(matched_px).astype(np.intp)
    inside = (nearest >= 0) & (nearest < disparity_px.shape[1])
    inside[inside] = pair.valid_right[rows[inside], nearest[inside]]
    rows, columns, matched_px, nearest = (part[inside] for part in (rows, columns, matched_px, nearest))
    off_px = np.abs(right_px[rows, nearest] - disparity_px[rows, columns])
    difference = np.abs(gray(pair.left)[rows, columns] - _sampled(gray(pair.right), matched_px, rows)) / 255.0
    return AgreementSums(
        shown=int(pair.valid_left.sum()),
        answered=len(inside),
        compared=len(rows),
        photometric=float(difference.sum(dtype=np.float64)),
        judged=int(np.isfinite(off_px).sum()),
        agreed=int((off_px <= AGREED_PX).sum()),
    )


def mirrored(pair: RectifiedPair) -> RectifiedPair:
    """Return the pair in a mirror: eyes exchanged, columns reversed, so that disparities keep their sign."""
    last = pair.left.shape[1] - 1
    return replace(
        pair,
        left=np.ascontiguousarray(pair.right[:, ::-1]),
        right=np.ascontiguousarray(pair.left[:, ::-1]),
        valid_left=np.ascontiguousarray(pair.valid_right[:, ::-1]),
        valid_right=np.ascontiguousarray(pair.valid_left[:, ::-1]),
        u0_left_px=-(last + pair.u0_right_px),
        u0_right_px=-(last + pair.u0_left_px),
    )


def _sampled(
    picture: NDArray[np.uint8], x_px: NDArray[np.float32], rows: NDArray[np.intp]
) -> NDArray[np.float32]:
    """Return the grey of a picture at (x, row), (n,), between columns."""
    low = np.clip(np.floor(x_px).astype(np.intp), 0, picture.shape[1] - 2)
    share = x_px - low
    return np.asarray((1.0 - share) * picture[rows, low] + share * picture[rows, low + 1], dtype=np.float32)
