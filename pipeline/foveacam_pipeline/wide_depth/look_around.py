"""Look at the whole steering field once and fuse its depth into the wide context.

The field is covered by directions one fovea's field apart. At each direction the gazes cross at the depth
that the context expects; another look follows where that look found surfaces at other depths.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled, Clock, Head, OutOfRange
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import aim_at, reach_span, volts_for
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.wide_depth.looks import fuse_look, overlap_share
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_pipeline.wide_depth.wide_matches import NEAREST_M

SPACING = 0.85
"""Distance of neighbouring directions as a share of a fovea's field."""
FIRST_GUESS_PER_M = 0.15
"""1/Z assumed where no depth is known, 1/m."""
AGAIN_OVERLAP = 0.75
"""Surfaces that are visible in less than this share of both foveae get a look of their own."""
LEAST_SHARE = 0.2
"""Least share of a look's samples at another depth that causes a further look."""
LOOKS_EACH = 3
"""Largest number of looks at one direction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookedAround:
    """Outcome of looking around: directions of the field and those done, looks, duration (rig's clock)."""

    directions: int
    done: int
    looks: int
    duration_s: float
    cancelled: bool


def field_directions(calibration: Calibration) -> NDArray[np.float64]:
    """Return (n, 2) tangents that cover what both eyes reach, row by row, every second row backwards."""
    left, right, top, bottom = np.tan(calibration.wide.field_rad)
    step_x, step_y = (
        SPACING * size / calibration.fovea_f_px
        for size in (calibration.fovea_width, calibration.fovea_height)
    )
    columns = _spread(left + step_x / 2, right - step_x / 2, step_x)
    rows = _spread(top + step_y / 2, bottom - step_y / 2, step_y)
    found = []
    for number, y in enumerate(rows):
        for x in columns if number % 2 == 0 else columns[::-1]:
            if reach_span(calibration, np.array([x, y]), nearest=1.0 / NEAREST_M) is not None:
                found.append((float(x), float(y)))
    return np.array(found).reshape(-1, 2)


def look_around(
    head: Head,
    calibration: Calibration,
    context: WideContext,
    *,
    clock: Clock,
    on_direction: Callable[[int, int], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> LookedAround:
    """Look at every direction of the field and fuse the depth; what was fused before a cancellation stays.

    `on_direction` is called with the number of directions done and the total.
    """
    began_ns = clock.now_ns()
    directions = field_directions(calibration)
    surveyor = _Surveyor(head, calibration, context)
    done, ended_early = 0, False
    for direction in directions:
        if cancelled is not None and cancelled():
            ended_early = True
            break
        try:
            surveyor.survey(direction)
        except Cancelled:
            ended_early = True
            break
        done += 1
        if on_direction is not None:
            on_direction(done, len(directions))
    return LookedAround(
        directions=len(directions),
        done=done,
        looks=surveyor.looks,
        duration_s=(clock.now_ns() - began_ns) / 1e9,
        cancelled=ended_early,
    )


class _Surveyor:
    """Makes the looks at one direction after another."""

    def __init__(self, head: Head, calibration: Calibration, context: WideContext) -> None:
        self._head = head
        self._calibration = calibration
        self._context = context
        self._last_per_m = FIRST_GUESS_PER_M
        self._reach_tan = 0.5 * math.hypot(calibration.fovea_width, calibration.fovea_height)
        self._reach_tan /= calibration.fovea_f_px
        self.looks = 0

    def survey(self, direction: NDArray[np.float64]) -> None:
        span = reach_span(self._calibration, direction, nearest=1.0 / NEAREST_M)
        if span is None:
            return
        known = self._context.around(direction, reach_tan=self._reach_tan).inverse_z_per_m
        next_per_m: float | None = float(np.median(known)) if len(known) else self._last_per_m
        looked_at: list[float] = []
        while next_per_m is not None and len(looked_at) < LOOKS_EACH:
            q = float(np.clip(next_per_m, *span))
            try:
                coarse = self._look(direction, q)
            except OutOfRange:
                return
            looked_at.append(q)
            next_per_m = self._unseen_depth(coarse, looked_at, span)

    def _look(self, direction: NDArray[np.float64], q: float) -> DepthSamples:
        gazes = aim_at(self._calibration, direction, q)
        sighting = self._head.look(volts_for(self._calibration, gazes))
        self.looks += 1
        coarse = fuse_look(self._context, sighting, self._calibration)
        if len(coarse):
            self._last_per_m = float(np.median(coarse.inverse_z_per_m))
        return coarse

    def _unseen_depth(
        self, coarse: DepthSamples, looked_at: list[float], span: tuple[float, float]
    ) -> float | None:
        """Return the 1/Z of surfaces too far from the depths looked at so far; None when there are none.

        Only depths within `span`, which both eyes reach, count.
        """
        q = coarse.inverse_z_per_m
        apart = np.min([np.abs(q - known) for known in looked_at], axis=0)
        missed = (overlap_share(apart, self._calibration) < AGAIN_OVERLAP) & (q >= span[0]) & (q <= span[1])
        if len(q) == 0 or np.count_nonzero(missed) < LEAST_SHARE * len(q):
            return None
        return float(np.median(q[missed]))


def _spread(low: float, high: float, step: float) -> NDArray[np.float64]:
    """Return evenly spaced positions from `low` to `high`, at most `step` apart."""
    count = max(1, math.ceil((high - low) / step) + 1)
    return np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
