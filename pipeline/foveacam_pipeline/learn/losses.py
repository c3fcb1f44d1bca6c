"""Losses of training: supervised for pairs with truth, else self-supervised (Eq. 15).

The latter are photometric, smoothness, a monocular prior where one is given, and attention reconstruction, an
addition to the paper's: the gradient of a warped picture reaches one or two pixels, residual disparities are
tens of pixels. It rebuilds left cells from right cells by the shares of the matching, along the row.
"""

from dataclasses import dataclass, fields

import torch
from torch import Tensor
from torch.nn import functional

from foveacam_pipeline.learn.monocular.prior_loss import prior_loss
from foveacam_pipeline.learn.network.correlation import RowMatches, consistent
from foveacam_pipeline.learn.network.network import Prediction
from foveacam_pipeline.learn.network.refinement import CELL_PX

SSIM_SHARE = 0.85
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2
STEP_DECAY = 0.8
"""Weight of a refinement relative to the next one."""
EDGE_FALL = 10.0
"""Decay of the smoothness weight with the picture's gradient: exp(-EDGE_FALL * gradient)."""
LEAST_SCALE_PX = 0.05
LARGEST_ERROR_PX = 16.0
"""Clip of errors in the likelihood, px."""
LEAST_LOG_SHARE = -12.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LossWeights:
    """Weights of the parts; zero leaves one out."""

    photometric: float = 1.0
    reconstruction: float = 1.0
    smoothness: float = 0.01
    scale: float = 0.02
    """Of the likelihood of the left-right residual under the stated scale of the error."""
    truth: float = 0.1
    """Of the difference from the truth, px; zero trains pairs with truth as if they had none."""
    true_matching: float = 0.5
    """Of the cross-entropy of the matching with the true column."""
    true_scale: float = 0.1
    """Of the likelihood of the true error under its stated scale."""
    prior: float = 0.0
    """Of the difference from the monocular prior at this step; set by the training's schedule."""

    @property
    def left_out(self) -> list[str]:
        """The self-supervised parts that are left out."""
        return [name for name in ABLATED if getattr(self, name) == 0.0]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairBatch:
    """Pictures (n, 3, h, w) of 0 to 1, and the valid pixels of the left window, (n, 1, h, w) bool.

    `disparity_px`, `known`: (n, 1, h, w) true disparity, and where it is known and seen by both eyes, bool;
    `labelled`: (n,) bool, which pairs have truth. If all three are None, no pair has.
    """

    left: Tensor
    right: Tensor
    valid_left: Tensor
    disparity_px: Tensor | None = None
    known: Tensor | None = None
    labelled: Tensor | None = None
    geometry: Tensor | None = None
    """Viewing geometry, (n, 8) as `view_geometry` returns it."""
    prior: Tensor | None = None
    """Relative inverse depth of the left pictures by the monocular prior, (n, 1, h, w)."""

    def pin_memory(self) -> "PairBatch":
        """Return the batch in pinned memory, from which a GPU copies asynchronously; PyTorch calls it."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return PairBatch(**{name: value.pin_memory() for name, value in given.items() if value is not None})


SELF_SUPERVISED = ("photometric", "reconstruction", "smoothness", "scale")
SUPERVISED = ("truth", "true matching", "true scale")
"""Names of the parts of both losses."""
PRIOR = "prior"
"""Name of the part by a monocular prior."""
ABLATED = ("photometric", "reconstruction", "smoothness")
"""Parts that training may leave out."""


def training_loss(
    prediction: Prediction, batch: PairBatch, weights: LossWeights, *, masked: bool
) -> tuple[Tensor, dict[str, float]]:
    """Return the loss of a batch and its parts: supervised for pairs with truth, else self-supervised.

    `masked`: as for `self_supervised`.
    """
    labelled = batch.labelled
    if labelled is None or weights.truth == 0.0 or not labelled.any():
        return self_supervised(prediction, batch, weights, masked=masked)
    if labelled.all():
        return supervised(prediction, batch, weights)
    share = float(labelled.float().mean())
    found, parts = supervised(*_rows(prediction, batch, labelled), weights)
    other, other_parts = self_supervised(*_rows(prediction, batch, ~labelled), weights, masked=masked)
    return share * found + (1.0 - share) * other, parts | other_parts


def supervised(
    prediction: Prediction, batch: PairBatch, weights: LossWeights
) -> tuple[Tensor, dict[str, float]]:
    """Return the loss of pairs with truth and its parts; only pixels that both eyes see count."""
    if batch.disparity_px is None or batch.known is None:
        raise ValueError("a supervised loss needs the truth of the batch")
    true_px, known = batch.disparity_px, batch.known.to(batch.disparity_px)
    last = len(prediction.disparities) - 1
    shares = [STEP_DECAY ** (last - number) for number in range(last + 1)]
    off = [
        share * _mean((d - true_px).abs(), known)
        for share, d in zip(shares, prediction.disparities, strict=True)
    ]
    scale = laplace_scale(prediction)
    error_px = (prediction.disparity.detach() - true_px).abs()
    parts = {
        "truth": weights.truth * torch.stack(off).sum() / sum(shares),
        "true matching": weights.true_matching * matching_entropy(prediction.matches, true_px, known),
        "true scale": weights.true_scale
        * _mean(error_px.clamp_max(LARGEST_ERROR_PX) / scale + scale.log(), known),
    }
    return torch.stack(list(parts.values())).sum(), {
        name: float(part.detach()) for name, part in parts.items()
    }


def matching_entropy(matches: RowMatches, true_px: Tensor, known: Tensor) -> Tensor:
    """Return the cross-entropy of the shares of right columns with the true ones; both (n, 1, h, w)."""
    middle = CELL_PX // 2
    true_px, known = (plane[:, 0, middle::CELL_PX, middle::CELL_PX] for plane in (true_px, known))
    columns = matches.scores.shape[3]
    place = torch.arange(columns, device=true_px.device, dtype=true_px.dtype)
    target = place - true_px / CELL_PX
    known = known * ((target >= 0.0) & (target <= columns - 1.0))
    target = target.clamp(0.0, columns - 1.001)
    low = target.floor().long()[..., None]
    part = target - low[..., 0]
    logs = matches.scores.log_softmax(dim=3)
    found = logs.gather(3, low)[..., 0] * (1.0 - part) + logs.gather(3, low + 1)[..., 0] * part
    return _mean(-found.clamp_min(LEAST_LOG_SHARE), known)


def _rows(prediction: Prediction, batch: PairBatch, rows: Tensor) -> tuple[Prediction, PairBatch]:
    """Return some pairs of a batch and their predictions; `rows`: (n,) bool."""
    matches = prediction.matches
    part = Prediction(
        disparities=tuple(disparity[rows] for disparity in prediction.disparities),
        log_scale=prediction.log_scale[rows],
        matches=RowMatches(
            scores=matches.scores[rows],
            share=matches.share[rows],
            disparity=matches.disparity[rows],
            peak=matches.peak[rows],
        ),
    )
    given = {
        field.name: getattr(batch, field.name)[rows]
        for field in fields(batch)
        if field.name != "labelled" and getattr(batch, field.name) is not None
    }
    return part, PairBatch(**given)


def _mean(values: Tensor, weight: Tensor) -> Tensor:
    return (values * weight).sum() / weight.sum().clamp_min(1.0)


def self_supervised(
    prediction: Prediction, batch: PairBatch, weights: LossWeights, *, masked: bool
) -> tuple[Tensor, dict[str, float]]:
    """Return the loss of a batch and its parts for the curves.

    `masked`: whether pixels that only one eye sees are left out; not at the start of training, when they are
    not known yet.
    """
    seen = batch.valid_left
    if masked:
        cells = consistent(prediction.matches.disparity, prediction.matches.scores)
        seen = seen & _enlarged_mask(cells)
    parts = {
        "photometric": weights.photometric * _over_steps(prediction, batch, seen),
        "reconstruction": weights.reconstruction * reconstruction(prediction.matches, batch, seen),
        "smoothness": weights.smoothness * smoothness(prediction.disparity, batch.left),
        "scale": weights.scale * scale_likelihood(prediction, batch, seen),
    }
    if batch.prior is not None and weights.prior > 0.0:
        parts[PRIOR] = weights.prior * prior_loss(prediction.disparity, batch.prior, batch.valid_left)
    total = torch.stack(list(parts.values())).sum()
    return total, {name: float(part.detach()) for name, part in parts.items()}


def laplace_scale(prediction: Prediction) -> Tensor:
    """Return the stated scale of the Laplace error of the last disparity, (n, 1, h, w) px."""
    return prediction.log_scale.exp() + LEAST_SCALE_PX


def warped(right: Tensor, disparity: Tensor) -> tuple[Tensor, Tensor]:
    """Return the right pictures as the left eye would see them, and where that is inside, (n, 1, h, w)."""
    _, _, h, w = right.shape
    columns = torch.arange(w, device=right.device, dtype=right.dtype) - disparity.squeeze(1)
    rows = torch.arange(h, device=right.device, dtype=right.dtype)[None, :, None].expand_as(columns)
    grid = torch.stack([2.0 * columns / (w - 1) - 1.0, 2.0 * rows / (h - 1) - 1.0], dim=3)
    seen = ((columns >= 0.0) & (columns <= w - 1.0))[:, None]
    return functional.grid_sample(right, grid, padding_mode="border", align_corners=True), seen


def photometric_error(left: Tensor, rebuilt: Tensor) -> Tensor:
    """Return (n, 1, h, w): 0.85 (1 - SSIM) / 2 over 3 x 3 pixels + 0.15 of the absolute difference."""
    difference = (left - rebuilt).abs().mean(dim=1, keepdim=True)
    dissimilarity = ((1.0 - _ssim(left, rebuilt)) / 2.0).clamp(0.0, 1.0).mean(dim=1, keepdim=True)
    return SSIM_SHARE * dissimilarity + (1.0 - SSIM_SHARE) * difference


def reconstruction(matches: RowMatches, batch: PairBatch, seen: Tensor) -> Tensor:
    """Return the error of left cells rebuilt from right cells by the shares of the matching."""
    left, right = (_centred_cells(picture) for picture in (batch.left, batch.right))
    rebuilt = torch.einsum("nhxy,nchy->nchx", matches.share, right)
    cells = functional.avg_pool2d(seen.to(left), CELL_PX)
    return ((left - rebuilt).abs().mean(dim=1, keepdim=True) * cells).sum() / cells.sum().clamp_min(1.0)


def smoothness(disparity: Tensor, left: Tensor) -> Tensor:
    """Return the mean change of disparity between neighbours, px, weighted down where the picture changes."""
    grey = left.mean(dim=1, keepdim=True)
    total = disparity.new_zeros(())
    for dim in (2, 3):
        change = disparity.diff(dim=dim).abs()
        total = total + (change * torch.exp(-EDGE_FALL * grey.diff(dim=dim).abs())).mean()
    return total


def scale_likelihood(prediction: Prediction, batch: PairBatch, seen: Tensor) -> Tensor:
    """Return the negative log-likelihood of the last change of the disparity under the stated Laplace scale.

    Without truth, the change of the last refinement and the remaining difference of the pictures are taken as
    the error; the disparity itself gets no gradient from it.
    """
    rebuilt, inside = warped(batch.right, prediction.disparity.detach())
    slope = batch.left.diff(dim=3, append=batch.left[..., -1:]).abs().mean(dim=1, keepdim=True)
    off_px = photometric_error(batch.left, rebuilt) / (slope + 0.02)
    change_px = (prediction.disparity - prediction.disparities[-2]).detach().abs()
    scale = laplace_scale(prediction)
    likelihood = torch.maximum(off_px, change_px).detach().clamp_max(LARGEST_ERROR_PX) / scale + scale.log()
    shown = (seen & inside).to(likelihood)
    return (likelihood * shown).sum() / shown.sum().clamp_min(1.0)


def _over_steps(prediction: Prediction, batch: PairBatch, seen: Tensor) -> Tensor:
    last = len(prediction.disparities) - 1
    total, weight = batch.left.new_zeros(()), 0.0
    for number, disparity in enumerate(prediction.disparities):
        rebuilt, inside = warped(batch.right, disparity)
        shown = (seen & inside).to(rebuilt)
        share = STEP_DECAY ** (last - number)
        error = (photometric_error(batch.left, rebuilt) * shown).sum() / shown.sum().clamp_min(1.0)
        total, weight = total + share * error, weight + share
    return total / weight


def _ssim(x: Tensor, y: Tensor) -> Tensor:
    x, y = (functional.pad(picture, (1, 1, 1, 1), mode="reflect") for picture in (x, y))
    mean_x, mean_y = functional.avg_pool2d(x, 3, 1), functional.avg_pool2d(y, 3, 1)
    var_x = functional.avg_pool2d(x * x, 3, 1) - mean_x.square()
    var_y = functional.avg_pool2d(y * y, 3, 1) - mean_y.square()
    covariance = functional.avg_pool2d(x * y, 3, 1) - mean_x * mean_y
    above = (2.0 * mean_x * mean_y + SSIM_C1) * (2.0 * covariance + SSIM_C2)
    return above / ((mean_x.square() + mean_y.square() + SSIM_C1) * (var_x + var_y + SSIM_C2))


def _centred_cells(picture: Tensor) -> Tensor:
    """Return (n, 48, h / 4, w / 4): the pixels of each cell, without the picture's mean."""
    return functional.pixel_unshuffle(picture - picture.mean(dim=(1, 2, 3), keepdim=True), CELL_PX)


def _enlarged_mask(cells: Tensor) -> Tensor:
    return functional.interpolate(cells.float(), scale_factor=float(CELL_PX), mode="nearest") > 0.5
