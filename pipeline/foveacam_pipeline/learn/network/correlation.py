"""Signed correlation of all cells of a row: disparities of either sign, from one matrix for both eyes.

Usual stereo networks search one side alone. Verged foveae have residual disparities of both signs, so only
those beyond the reach are cut off.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

NEIGHBOURHOOD = 2
"""Cells on either side of the best match over which its disparity is averaged."""
FAR_BELOW = -1e4


@dataclass(frozen=True, slots=True)
class RowMatches:
    """Matches of the left cells: scores (n, h, w, w) of left and right columns, disparity (n, 1, h, w)."""

    scores: Tensor
    share: Tensor
    """Softmax over the right columns, (n, h, w, w): weights of right cells that make up a left one."""
    disparity: Tensor
    """Left column minus right column, cells."""
    peak: Tensor
    """Largest share, (n, 1, h, w): confidence of the match."""


def row_scores(left: Tensor, right: Tensor, *, reach: int, signed: bool = True) -> Tensor:
    """Return scores (n, h, w, w) of features (n, c, h, w); far below zero beyond the reach, in cells.

    Not `signed`: also where the disparity would be negative.
    """
    width, columns = left.shape[1], left.shape[3]
    rows_left, rows_right = (left / width**0.5).transpose(1, 2), right.transpose(1, 2)
    place = torch.arange(columns, device=left.device)
    disparity = place[:, None] - place[None, :]
    beyond = (disparity.abs() > reach) if signed else (disparity < 0) | (disparity > reach)
    scores: Tensor = rows_left.transpose(2, 3) @ rows_right + beyond * FAR_BELOW
    return scores


def match_rows(scores: Tensor) -> RowMatches:
    """Return the matches of the left cells: the mean column about the best one."""
    share = scores.softmax(dim=3)
    columns = scores.shape[3]
    peak, best = share.max(dim=3, keepdim=True)
    offsets = torch.arange(-NEIGHBOURHOOD, NEIGHBOURHOOD + 1, device=scores.device)
    near = (best + offsets).clamp(0, columns - 1)
    weight = share.gather(3, near)
    matched = (weight * near).sum(dim=3) / weight.sum(dim=3).clamp_min(1e-6)
    place = torch.arange(columns, device=scores.device, dtype=matched.dtype)
    disparity = (place - matched)[:, None]
    return RowMatches(scores=scores, share=share, disparity=disparity, peak=peak.squeeze(3)[:, None])


def sample_scores(scores: Tensor, disparity: Tensor, offsets: Tensor) -> Tensor:
    """Return scores (n, k, h, w) at offsets from a disparity (n, 1, h, w), in cells, interpolated."""
    columns = scores.shape[3]
    place = torch.arange(columns, device=scores.device, dtype=disparity.dtype)
    at = place[:, None] - disparity.squeeze(1)[..., None] - offsets
    at = at.clamp(0.0, columns - 1.001)
    low = at.floor().long()
    part = at - low
    found = scores.gather(3, low) * (1.0 - part) + scores.gather(3, low + 1) * part
    return found.permute(0, 3, 1, 2).clamp_min(-20.0)


def consistent(left: Tensor, scores: Tensor, *, within: float = 1.0) -> Tensor:
    """Return (n, 1, h, w) bool: where the right eye's matches lead back to the left cell."""
    right = match_rows(scores.transpose(2, 3)).disparity
    columns = left.shape[3]
    place = torch.arange(columns, device=left.device, dtype=left.dtype)
    target = (place - left).round().long()
    inside = (target >= 0) & (target < columns)
    back = right.gather(3, target.clamp(0, columns - 1))
    return inside & ((left + back).abs() <= within)
