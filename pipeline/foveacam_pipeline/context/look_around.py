"""Look at the whole steering field once, so that the wide context knows its depth.

The field is covered by directions a fovea's field apart. Each is looked at with the gazes crossing where the
context expects its surface, and again where that look showed surfaces at another depth.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled, Clock, Head, OutOfRange
from foveacam_pipeline.context.looks import fuse_look, overlap_share
from foveacam_pipeline.context.wide_context import WideContext
from foveacam_pipeline.context.wide_matches import NEAREST_M
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import aim_at, reach_span, volts_for
from foveacam_pipeline.verge.depth_samples import DepthSamples

SPACING = 0.85
"""Distance of neighbouring directions as a share of a fovea's field."""
FIRST_GUESS_PER_M = 0.15
"""1/Z that is expected where nothing is known."""
AGAIN_OVERLAP = 0.75
"""Surfaces that less than this share of both foveae would see are worth a look of their own."""
LEAST_SHARE = 0.2
"""Share of a look's samples that must lie at another depth for that."""
LOOKS_EACH = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class LookedAround:
    """How a look around went: directions of the field, those done, looks taken, time on the rig's clock."""

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
    """Look at every direction of the field and fuse what is seen; a cancelled one keeps what it has found.

    `on_direction` is told how many directions are done, and of how many.
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
    """Takes the looks of one direction after the other."""

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
        wanted: float | None = float(np.median(known)) if len(known) else self._last_per_m
        seen: list[float] = []
        while wanted is not None and len(seen) < LOOKS_EACH:
            q = float(np.clip(wanted, *span))
            try:
                coarse = self._look(direction, q)
            except OutOfRange:
                return
            seen.append(q)
            wanted = self._unseen(coarse, seen, span)

    def _look(self, direction: NDArray[np.float64], q: float) -> DepthSamples:
        gazes = aim_at(self._calibration, direction, q)
        sighting = self._head.look(volts_for(self._calibration, gazes))
        self.looks += 1
        coarse = fuse_look(self._context, sighting, self._calibration)
        if len(coarse):
            self._last_per_m = float(np.median(coarse.inverse_z_per_m))
        return coarse

    def _unseen(self, coarse: DepthSamples, seen: list[float], span: tuple[float, float]) -> float | None:
        """Return the 1/Z of surfaces that no look at this direction came near enough to; None without any.

        Near the edge of the field only depths that both eyes reach are asked for.
        """
        q = coarse.inverse_z_per_m
        apart = np.min([np.abs(q - known) for known in seen], axis=0)
        missed = (overlap_share(apart, self._calibration) < AGAIN_OVERLAP) & (q >= span[0]) & (q <= span[1])
        if len(q) == 0 or np.count_nonzero(missed) < LEAST_SHARE * len(q):
            return None
        return float(np.median(q[missed]))


def _spread(low: float, high: float, step: float) -> NDArray[np.float64]:
    """Return places from `low` to `high`, at most `step` apart."""
    count = max(1, math.ceil((high - low) / step) + 1)
    return np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
