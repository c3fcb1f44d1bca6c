"""Watch the field: choose a look, make it, fuse its depth into the wide context, and go on."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Head, OutOfRange, Sighting
from foveacam_pipeline.attention.field import (
    Bools,
    FieldGrid,
    FieldState,
    Floats,
    Yields,
    cell_contrast,
    expected_inverse_z,
    parts_of,
)
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import DepthRange, map_loss
from foveacam_pipeline.attention.policy import Look, Policy
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import volts_for
from foveacam_pipeline.wide_depth.looks import fuse_apart, fuse_look
from foveacam_pipeline.wide_depth.wide_context import WideContext

LEFT_OVER = 0.25
"""Share of a cell's loss that is left after a look, above which the look did not improve it."""
LEAST_LEARNED = 3.0
"""Least promise of a look, in cells, for its result to change `Yields`."""
MOST_REFUSED = 20
"""Looks out of range in a row after which none is left: at the rim of a mirror's field a few may be."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WatchedLook:
    """A look that was made. `loss`: mean loss of the field after it; `decided_ms`: time to choose it."""

    index: int
    look: Look
    sighting: Sighting
    t_s: float
    loss: float
    decided_ms: float


class FieldMemory:
    """What attention remembers of the field beside its depth: its looks, and what they brought."""

    def __init__(self, grid: FieldGrid) -> None:
        self.grid = grid
        self.looked_s: Floats = np.full(len(grid), -np.inf)
        self.tries: NDArray[np.int64] = np.zeros(len(grid), dtype=np.int64)
        self.yields = Yields()

    def state(self, context: WideContext, wide: NDArray[np.uint8] | None, *, now_s: float) -> FieldState:
        """Return the state of the field.

        `wide`: (h, w) uint8 the newest wide picture, binned or not; without one all counts as textured.
        """
        known = context.snapshot()
        inverse_z, guessed = expected_inverse_z(known, self.grid)
        with np.errstate(invalid="ignore"):
            relative = known.sigma_per_m[0] / known.inverse_z_per_m[0]
        relative[~known.known[0]] = np.inf
        return FieldState(
            now_s=now_s,
            inverse_z_per_m=inverse_z,
            guessed=guessed,
            relative_sigma=parts_of(relative, self.grid, fill=0.0),
            contrast=np.full(len(self.grid), np.inf)
            if wide is None
            else cell_contrast(wide, self.grid, binning=context.wide.binning_of(wide.shape)),
            looked_s=self.looked_s.copy(),
            tries=self.tries.copy(),
            yields=self.yields,
        )

    def looked(self, look: Look, cells: Bools, *, before: Floats, after: Floats, now_s: float) -> None:
        """Remember a look that showed some cells, (n,) bool, by the map's loss before it and after, (n,)."""
        if look.promised >= LEAST_LEARNED:
            share = float((before - after).sum()) / look.promised
            self.yields = self.yields.learned(apart=look.meeting_m is None, share=share)
        left = cells & (after > LEFT_OVER * before) & (after > 0.0)
        self.tries[left] += 1
        self.tries[cells & ~left] = 0
        self.looked_s[cells] = now_s


class Watcher:
    """Makes the looks that a policy chooses, one at a time."""

    def __init__(
        self,
        head: Head,
        calibration: Calibration,
        context: WideContext,
        memory: FieldMemory,
        candidates: Candidates,
        *,
        clock: Clock,
        depths: DepthRange | None = None,
    ) -> None:
        self._head = head
        self._calibration = calibration
        self._context = context
        self._memory = memory
        self._candidates = candidates
        self._clock = clock
        self._depths = depths or DepthRange()
        self._wide: NDArray[np.uint8] | None = None
        self._made = 0

    def look(self, policy: Policy, wide: NDArray[np.uint8] | None = None) -> WatchedLook | None:
        """Choose a look, make it and fuse it; return None where nothing is left to look at.

        `wide`: (h, w) uint8 the newest wide picture, by default that of the last look. A look that the head
        refuses as out of range counts as tried, and another is chosen, `MOST_REFUSED` times. Raise what else
        the head raises.
        """
        if wide is not None:
            self._wide = wide
        for _ in range(MOST_REFUSED):
            began_s = time.perf_counter()
            before = self._memory.state(self._context, self._wide, now_s=self._now_s())
            look = policy.choose(before)
            decided_ms = 1e3 * (time.perf_counter() - began_s)
            if look is None:
                return None
            try:
                sighting = self._head.look(volts_for(self._calibration, look.gazes))
            except OutOfRange:
                self._memory.tries[look.cells] += 1
            else:
                return self._fused(look, sighting, before, decided_ms=decided_ms)
        return None

    def _fused(self, look: Look, sighting: Sighting, before: FieldState, *, decided_ms: float) -> WatchedLook:
        """Fuse a look that was made, and remember what it brought."""
        self._candidates.set_binning(sighting.left.binning)
        self._wide = gray(to_uint8(sighting.wide))
        if look.meeting_m is None:
            fuse_apart(self._context, sighting, self._calibration, expected_per_m=look.expected_per_m)
        else:
            fuse_look(self._context, sighting, self._calibration)
        after = self._memory.state(self._context, self._wide, now_s=self._now_s())
        losses = [map_loss(state, self._depths) for state in (before, after)]
        cells = self._candidates.shown_under(look.gazes, after.inverse_z_per_m)
        self._memory.looked(look, cells, before=losses[0], after=losses[1], now_s=self._now_s())
        self._made += 1
        return WatchedLook(
            index=self._made,
            look=look,
            sighting=sighting,
            t_s=self._now_s(),
            loss=float(losses[1].mean()),
            decided_ms=decided_ms,
        )

    def _now_s(self) -> float:
        return self._clock.now_ns() / 1e9
