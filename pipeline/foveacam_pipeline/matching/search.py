"""Search a point of one picture in another: whole pixels by correlation, the fraction by `match_point`.

Two errors are stated: the standard error of a right match, and the probability that the match is wrong
because another position looks alike, which follows from the lead of the best score over the second best.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import best_outside, largest, score_map
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.point import PositionPrior, match_point
from foveacam_pipeline.matching.windows import MatchWindow

GUARD_PX = 3
"""Positions this near to the best one do not count as the second best."""
SPARE_PX = 6
WRONG_OFFSET, WRONG_PER_LEAD, WRONG_PER_LOSS = -1.7, -3.6, 11.9
"""Log-odds of a wrong match: constant, per unit of lead over the second best, per unit of 1 - correlation.
Fitted to every second point of three real pairs; `bench.matching` tests with the others."""

STRUCTURE, FLOOR_SIGMA_PX = 3.5, 0.05
"""Factor and least value of the standard error on real surfaces, which are not planar and have highlights:
these shift a whole window, which the residuals within it do not show (fitted to the same pairs)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchReach:
    """Search range, px: `low_px` to `high_px` along x, `rows_px` up and down along y."""

    low_px: int
    high_px: int
    rows_px: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundPoint:
    """Second minus first position, px, its standard errors if the match is right, and how distinct it is."""

    x_px: float
    y_px: float
    sigma_x_px: float
    sigma_y_px: float
    score: float
    lead: float

    @property
    def wrong_probability(self) -> float:
        """Probability that the match is wrong."""
        odds = WRONG_OFFSET + WRONG_PER_LEAD * self.lead + WRONG_PER_LOSS * (1.0 - self.score)
        return 1.0 / (1.0 + math.exp(-odds))


def find_point(
    first: NDArray[np.float32],
    second: NDArray[np.float32],
    at_px: tuple[int, int],
    *,
    reach: SearchReach,
    window: MatchWindow,
    prior: PositionPrior,
) -> FoundPoint | None:
    """Return where the point `at_px` (x, y) of the first picture lies in the second, both (h, w) float32.

    None if the window leaves a picture or has no contrast, or if nothing in the search range matches.
    """
    x, y = at_px
    half = window.half_px
    low, high = max(reach.low_px, half - x), min(reach.high_px, second.shape[1] - 1 - half - x)
    rows = min(reach.rows_px, y - half, second.shape[0] - 1 - half - y)
    patch = _part(first, x, y, half, half)
    if rows < 0 or high - low < 2 or patch is None:
        return None
    strip = second[y - half - rows : y + half + rows + 1, x + low - half : x + high + half + 1]
    scores = score_map(strip, patch)
    column, row = largest(scores)
    rival = best_outside(scores, (column, row), guard_px=(GUARD_PX, len(scores)))
    dx, dy = column + low, row - rows
    spare = half + SPARE_PX
    one, two = _part(first, x, y, spare, half), _part(second, x + dx, y + dy, spare, spare)
    if one is None or two is None:
        return None
    shifted = PositionPrior(
        y_px=prior.y_px - dy,
        y_sigma_px=prior.y_sigma_px,
        slope_sigma=prior.slope_sigma,
        slopes=prior.slopes,
    )
    found = match_point(
        InterpolatedPicture.of(one),
        InterpolatedPicture.of(two),
        WindowPlacement(),
        window=window,
        prior=shifted,
    )
    if found is None or not math.isfinite(found.sigma_px[0]):
        return None
    return FoundPoint(
        x_px=dx + found.placement.x_px,
        y_px=dy + found.placement.y_px,
        sigma_x_px=math.hypot(STRUCTURE * found.sigma_px[0], FLOOR_SIGMA_PX),
        sigma_y_px=math.hypot(STRUCTURE * found.sigma_px[1], FLOOR_SIGMA_PX),
        score=found.score,
        lead=float(scores[row, column]) - rival,
    )


def _part(image: NDArray[np.float32], x: int, y: int, half_x: int, half_y: int) -> NDArray[np.float32] | None:
    """Return the window about a whole pixel, the border repeated; None if more than the spare is missing."""
    height, width = image.shape
    if not (half_x - SPARE_PX <= x < width - half_x + SPARE_PX and 0 <= y < height):
        return None
    columns = np.clip(np.arange(x - half_x, x + half_x + 1), 0, width - 1)
    rows = np.clip(np.arange(y - half_y, y + half_y + 1), 0, height - 1)
    return np.ascontiguousarray(image[np.ix_(rows, columns)])
