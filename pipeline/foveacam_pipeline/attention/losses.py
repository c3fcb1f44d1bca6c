"""What attention is worth: the loss of each cell, and how much of it a look can take away.

Each loss is 0 to 1 a cell. Weights add them; what a look is worth is the sum over the cells that it shows.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.attention.field import FieldState, Floats

GOAL = 0.01
"""Error over distance at which a cell counts as known."""
MISSED = 0.75
"""Least loss of what is known to more than the goal; the rest of it grows with the logarithm of the error."""
NOVELTY_S = 30.0
"""Time after which two thirds of the novelty of a place have come back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """What matters, each weight 0 or more: depth of the whole field, changes, objects, targets, novelty."""

    map: float = 0.0
    change: float = 0.0
    objects: float = 0.0
    targets: float = 0.0
    novelty: float = 0.0

    def __post_init__(self) -> None:
        given = {each.name: getattr(self, each.name) for each in fields(self)}
        wrong = {name: value for name, value in given.items() if not (math.isfinite(value) and value >= 0.0)}
        if wrong or not any(given.values()):
            raise InvalidInput(
                "weights of what attention is worth must be 0 or more, and one of them above 0",
                asked=f"the weights {given}",
                found=f"{wrong} below 0 or not finite" if wrong else "none above 0",
                remedy="give, for example, map=1",
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthRange:
    """Distances that count for the map, m, and the error over distance that is wanted there."""

    nearest_m: float = 0.5
    farthest_m: float = 30.0
    goal: float = GOAL

    def __post_init__(self) -> None:
        if not (0.0 < self.nearest_m < self.farthest_m and 0.0 < self.goal < 1.0):
            raise InvalidInput(
                "a range of distances needs 0 < nearest < farthest, and an error between 0 and 1",
                asked=f"{self.nearest_m} m to {self.farthest_m} m, known to {self.goal}",
                remedy="give, for example, 0.5 m to 30 m, known to 0.01",
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Worth:
    """What a look at each cell takes away, (n,) each: if it is measured so well, and whatever it shows."""

    measured: Floats
    seen: Floats


def part_losses(relative_sigma: Floats, *, goal: float) -> Floats:
    """Return the map's loss of an error over distance: 0 up to the goal, `MISSED` above it, 1 at 100 %."""
    share = np.log(np.maximum(relative_sigma, goal) / goal) / math.log(1.0 / goal)
    return np.where(relative_sigma <= goal, 0.0, np.minimum(MISSED + (1.0 - MISSED) * share, 1.0))


def map_loss(state: FieldState, depths: DepthRange) -> Floats:
    """Return (n,) the mean loss of each cell's parts; 0 for what is known to lie outside the range."""
    losses = part_losses(state.relative_sigma, goal=depths.goal).mean(axis=1)
    return np.where(_outside(state, depths), 0.0, losses)


def worth_of(state: FieldState, weights: Weights, *, relative_sigma: Floats, depths: DepthRange) -> Worth:
    """Return what a look at each cell is worth that measures it to an error over distance, (n,)."""
    now = part_losses(state.relative_sigma, goal=depths.goal)
    then = part_losses(np.minimum(state.relative_sigma, relative_sigma[:, None]), goal=depths.goal)
    gained = np.where(_outside(state, depths), 0.0, (now - then).mean(axis=1))
    known = 1.0 - part_losses(relative_sigma, goal=depths.goal)
    away_s = state.now_s - state.looked_s
    return Worth(
        measured=weights.map * gained + weights.objects * state.interest * known,
        seen=weights.change * state.changed
        + weights.targets * state.urgency
        + weights.novelty * (1.0 - np.exp(-away_s / NOVELTY_S)),
    )


def _outside(state: FieldState, depths: DepthRange) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    near, far = 1.0 / depths.nearest_m, 1.0 / depths.farthest_m
    beyond = (state.inverse_z_per_m > near) | (state.inverse_z_per_m < far)
    return np.asarray(~state.guessed & beyond, dtype=np.bool_)
