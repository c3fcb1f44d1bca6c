"""Look at the whole field until no look is expected to tell more of its depth."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import Cancelled, Clock, Head
from foveacam_pipeline.attention.field import FieldGrid
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import DepthRange
from foveacam_pipeline.attention.policy import AttentionPolicy
from foveacam_pipeline.attention.watching import FieldMemory, WatchedLook, Watcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.wide_depth.wide_context import WideContext

MOST_LOOKS = 160
"""Largest number of looks: twice what the scenes of the benches take."""
WORTH_ENDING = 3.0
"""Expected worth of a look, in cells, below which the field counts as looked at."""
DEPTHS = DepthRange(nearest_m=0.5, farthest_m=100.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class LookedAround:
    """Outcome of looking around: looks, duration (rig's clock), and the share of the field that was shown."""

    looks: int
    shown_fraction: float
    duration_s: float
    cancelled: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAroundProgress:
    """A look that was made. `done`: 0 to 1, by what looks are still worth; it never falls."""

    look: WatchedLook
    done: float


def look_around(
    head: Head,
    calibration: Calibration,
    context: WideContext,
    *,
    clock: Clock,
    on_look: Callable[[LookAroundProgress], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> LookedAround:
    """Look where most is to be learned, again and again; what was fused before a cancellation stays."""
    began_ns = clock.now_ns()
    grid = FieldGrid.of(calibration.wide, context_cell_px=context.cell_px)
    memory, candidates = FieldMemory(grid), Candidates(calibration, grid)
    watcher = Watcher(head, calibration, context, memory, candidates, clock=clock, depths=DEPTHS)
    policy = AttentionPolicy(candidates, depths=DEPTHS, least_worth=WORTH_ENDING)
    looks, ended_early, first_worth, done = 0, False, 0.0, 0.0
    while looks < MOST_LOOKS and not (ended_early := cancelled is not None and cancelled()):
        try:
            made = watcher.look(policy)
        except Cancelled:
            ended_early = True
            break
        if made is None:
            break
        looks += 1
        first_worth = max(first_worth, made.look.worth)
        if on_look is not None:
            done = max(done, _done(made.look.worth, first_worth), looks / MOST_LOOKS)
            on_look(LookAroundProgress(look=made, done=done))
    field = candidates.near_directions.any(axis=0)
    return LookedAround(
        looks=looks,
        shown_fraction=float(np.isfinite(memory.looked_s[field]).mean()) if field.any() else 0.0,
        duration_s=(clock.now_ns() - began_ns) / 1e9,
        cancelled=ended_early,
    )


def _done(worth: float, first_worth: float) -> float:
    """Return the share that is done, as the worth of looks falls about exponentially to `WORTH_ENDING`."""
    if worth <= WORTH_ENDING or first_worth <= WORTH_ENDING:
        return 1.0
    return 1.0 - math.log(worth / WORTH_ENDING) / math.log(first_worth / WORTH_ENDING)
