"""Sub-pixel match of a point in one fovea against the other by `match_point`, checked for ambiguity.

Disparity may slope across the window. A prior keeps the rows matched where texture cannot determine them.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.point import PositionPrior, match_point
from foveacam_pipeline.matching.windows import MatchWindow, bell

ROW_SIGMA_PX = 4.0
"""Prior error of the row offset by the calibration, sensor px; negligible where there is texture."""
SLOPE_SIGMA = 0.5
"""Prior standard deviation of slopes of disparity, px a px; across the rows the slope of a level surface is
the baseline over the height above it."""
ELSEWHERE_PX = 10.0
"""Distance along the line at which a match is compared with alternatives, sensor px."""
LEAST_LEAD = 0.004
"""Least lead in correlation over the alternatives; it must also be twice what noise took from the match."""
FLOOR_SIGMA_PX = 0.03
"""Error left by interpolation and equalisation (deduced from rendered pairs), sensor px; painted planes show
errors of the same size at both binnings."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SubpixelPosition:
    """Right minus left place, (2,) picture px; its error along x and y; weighted correlation there.

    `slope`: (2,) gradient of the place along x and along y, px a px.
    """

    position_px: NDArray[np.float64]
    slope: NDArray[np.float64]
    sigma_px: tuple[float, float]
    score: float


def match_in_rows(
    left: InterpolatedPicture,
    right: InterpolatedPicture,
    start: WindowPlacement,
    *,
    window: MatchWindow,
    expected_px: NDArray[np.float64],
    binning: Binning = 1,
) -> SubpixelPosition:
    """Refine a start, right minus left place, to a fraction of a pixel.

    `expected_px`: (2,) the place at which the rows match. `binning`: of the pictures; all places are in their
    pixels.
    """
    prior = PositionPrior(
        y_px=float(expected_px[1]), y_sigma_px=ROW_SIGMA_PX / binning, slope_sigma=SLOPE_SIGMA
    )
    found = match_point(left, right, start, window=window, prior=prior)
    if found is None:
        unknown = (math.inf, math.inf)
        return SubpixelPosition(
            position_px=np.array([start.x_px, start.y_px]),
            slope=np.array([start.xx, start.xy]),
            sigma_px=unknown,
            score=0.0,
        )
    sigma_x_px, sigma_y_px = (math.hypot(sigma, FLOOR_SIGMA_PX / binning) for sigma in found.sigma_px)
    if math.isfinite(sigma_x_px):
        lead = found.score - _elsewhere(left, right, found.placement, window, ELSEWHERE_PX / binning)
        if lead < max(LEAST_LEAD, 2.0 * (1.0 - found.score)):
            sigma_x_px = math.inf
    return SubpixelPosition(
        position_px=found.position_px,
        slope=np.array([found.placement.xx, found.placement.xy]),
        sigma_px=(sigma_x_px, sigma_y_px),
        score=found.score,
    )


def _elsewhere(
    left: InterpolatedPicture,
    right: InterpolatedPicture,
    place: WindowPlacement,
    window: MatchWindow,
    apart_px: float,
) -> float:
    """Return the better correlation at either side along the line: an edge along the line also fits there."""
    lens = bell(window)
    reference = lens.normalised(left.cut(lens.half))
    best = -1.0
    for aside_px in (-apart_px, apart_px):
        moved = lens.normalised(right.cut(lens.half, replace(place, x_px=place.x_px + aside_px)))
        if moved is not None and reference is not None:
            best = max(best, lens.mean(reference * moved))
    return best
