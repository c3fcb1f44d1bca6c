"""What is lost by not knowing the depth of a cell, and how much of it a look takes away."""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.attention.field import Bools, FieldState, Floats

GOAL = 0.01
"""Error over distance at which a cell counts as known."""
MISSED = 0.75
"""Loss of a part whose error is just above the goal; it grows to 1 with the logarithm of the error."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthRange:
    """Distances that count, m, and the error over distance that is wanted there."""

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


def part_losses(relative_sigma: Floats, *, goal: float) -> Floats:
    """Return the loss of an error over distance: 0 up to the goal, `MISSED` above it, 1 at 100 %."""
    share = np.log(np.maximum(relative_sigma, goal) / goal) / math.log(1.0 / goal)
    return np.where(relative_sigma <= goal, 0.0, np.minimum(MISSED + (1.0 - MISSED) * share, 1.0))


def map_loss(state: FieldState, depths: DepthRange) -> Floats:
    """Return (n,) the mean loss of each cell's parts; 0 for what is known to lie outside the range."""
    losses = part_losses(state.relative_sigma, goal=depths.goal).mean(axis=1)
    return np.where(_outside(state, depths), 0.0, losses)


def worth_of(state: FieldState, depths: DepthRange, *, relative_sigma: Floats) -> Floats:
    """Return (n,) by how much the loss of cells falls that are measured to an error over distance, (n,)."""
    now = part_losses(state.relative_sigma, goal=depths.goal)
    then = part_losses(np.minimum(state.relative_sigma, relative_sigma[:, None]), goal=depths.goal)
    return np.where(_outside(state, depths), 0.0, (now - then).mean(axis=1))


def _outside(state: FieldState, depths: DepthRange) -> Bools:
    near, far = 1.0 / depths.nearest_m, 1.0 / depths.farthest_m
    beyond = (state.inverse_z_per_m > near) | (state.inverse_z_per_m < far)
    return np.asarray(~state.guessed & beyond, dtype=np.bool_)
