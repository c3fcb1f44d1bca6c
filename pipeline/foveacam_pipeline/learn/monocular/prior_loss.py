"""The loss by a monocular prior (Eq. 15): its schedule, its closed-form alignment, and its differences.

A prior's inverse depth is known up to scale and shift. Disparity is linear in inverse depth, so both are
fitted to the prediction itself, without a gradient; never to a truth.
"""

from typing import Literal, TypeAlias

import torch
from torch import Tensor
from torch.nn import functional

PriorSchedule: TypeAlias = Literal["none", "annealed", "full"]
ANNEALED_FROM, ANNEALED_UNTIL = 0.15, 0.6
"""Weight at the first step, and the share of the steps after which it is zero."""
FULL = 1.0
UNIT_PX = 16.0
"""Unit of differences of disparities in the loss; the photometric part is at most about one."""
GRADIENT_SCALES = 3
LEAST_VARIANCE = 1e-8


def prior_weight(schedule: PriorSchedule, share: float) -> float:
    """Return the weight of the prior at a share of the steps."""
    if schedule == "annealed":
        return ANNEALED_FROM * max(0.0, 1.0 - share / ANNEALED_UNTIL)
    return FULL if schedule == "full" else 0.0


def aligned(prior: Tensor, target: Tensor, seen: Tensor) -> Tensor:
    """Return priors (n, 1, h, w) with the scale and shift, one pair each, that fit targets where seen.

    Least squares in closed form. The scale is at least zero, because a negative one would make near far.
    """
    weight = seen.to(prior)
    count = weight.sum(dim=(2, 3), keepdim=True).clamp_min(1.0)
    mean_prior = (prior * weight).sum(dim=(2, 3), keepdim=True) / count
    mean_target = (target * weight).sum(dim=(2, 3), keepdim=True) / count
    off_prior, off_target = prior - mean_prior, target - mean_target
    covariance = (weight * off_prior * off_target).sum(dim=(2, 3), keepdim=True) / count
    variance = (weight * off_prior.square()).sum(dim=(2, 3), keepdim=True) / count
    scale = (covariance / variance.clamp_min(LEAST_VARIANCE)).clamp_min(0.0)
    return scale * off_prior + mean_target


def prior_loss(disparity: Tensor, prior: Tensor, seen: Tensor) -> Tensor:
    """Return the difference of disparities (n, 1, h, w), px, from priors aligned to them, where seen."""
    wanted = aligned(prior, disparity.detach(), seen)
    return difference_loss((disparity - wanted) / UNIT_PX, seen)


def difference_loss(off: Tensor, seen: Tensor) -> Tensor:
    """Return the mean size of differences (n, 1, h, w) and of their gradients at three scales."""
    weight = seen.to(off)
    total = (off.abs() * weight).sum() / weight.sum().clamp_min(1.0)
    for _ in range(GRADIENT_SCALES):
        total = total + _gradients(off, weight) / GRADIENT_SCALES
        off, weight = functional.avg_pool2d(off * weight, 2), functional.avg_pool2d(weight, 2)
        off, weight = off / weight.clamp_min(1e-6), (weight > 0.5).to(off)
    return total


def _gradients(off: Tensor, weight: Tensor) -> Tensor:
    """Return the mean change between neighbours that both have a weight."""
    total = off.new_zeros(())
    for dim in (2, 3):
        last = off.shape[dim]
        both = weight.narrow(dim, 1, last - 1) * weight.narrow(dim, 0, last - 1)
        total = total + (off.diff(dim=dim).abs() * both).sum() / both.sum().clamp_min(1.0)
    return total


def standardised_map(values: Tensor, seen: Tensor) -> Tensor:
    """Return maps (n, 1, h, w) standardised to zero mean and unit spread where seen."""
    weight = seen.to(values)
    count = weight.sum(dim=(2, 3), keepdim=True).clamp_min(1.0)
    mean = (values * weight).sum(dim=(2, 3), keepdim=True) / count
    variance = ((values - mean).square() * weight).sum(dim=(2, 3), keepdim=True) / count
    return (values - mean) / torch.sqrt(variance + LEAST_VARIANCE)
