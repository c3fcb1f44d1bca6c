"""Comparison of the disparities that two backends found for one pair, against their stated errors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.values import DisparityMap

SIGMAS = 5.0
"""Half width of the histogram, standard errors; values beyond count in its last bins."""
BINS = 40
SPREAD_OF_MAD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
LEAST_SIGMA_PX = 1e-3
UNKNOWN_RGB = (38, 42, 50)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisparityComparison:
    """First minus second disparity, px: (h, w) float32, NaN where either is unknown.

    `known_first`, `known_second`, `known_both`: shares of all pixels. `median_px`, `spread_px`: median and
    robust standard deviation of the difference; None without a pixel known to both. `within_1`, `within_2`:
    shares of the differences of at most one and two standard errors of a difference of independent errors:
    .683 and .954 if both state their errors correctly; backends that see the same noise agree better.
    `edges`, (n + 1,), and `shares`, (n,): histogram of the difference in such standard errors.
    """

    difference_px: NDArray[np.float32]
    known_first: float
    known_second: float
    known_both: float
    median_px: float | None
    spread_px: float | None
    within_1: float | None
    within_2: float | None
    edges: NDArray[np.float64]
    shares: NDArray[np.float64]


def compare_disparities(first: DisparityMap, second: DisparityMap) -> DisparityComparison:
    """Return how two disparity maps of one pair differ."""
    difference = first.residual_px - second.residual_px
    both = np.isfinite(difference)
    sigma_px = np.hypot(first.sigma_px, second.sigma_px)[both]
    values = difference[both].astype(np.float64)
    edges = np.linspace(-SIGMAS, SIGMAS, BINS + 1)
    shares = np.zeros(BINS)
    median_px = spread_px = within_1 = within_2 = None
    if values.size:
        scaled = values / np.maximum(np.nan_to_num(sigma_px, nan=np.inf), LEAST_SIGMA_PX)
        shares = np.histogram(np.clip(scaled, -SIGMAS, SIGMAS), bins=edges)[0] / values.size
        median_px = float(np.median(values))
        spread_px = SPREAD_OF_MAD * float(np.median(np.abs(values - median_px)))
        within_1, within_2 = (float((np.abs(scaled) <= count).mean()) for count in (1.0, 2.0))
    return DisparityComparison(
        difference_px=difference,
        known_first=float(np.isfinite(first.residual_px).mean()),
        known_second=float(np.isfinite(second.residual_px).mean()),
        known_both=float(both.mean()),
        median_px=median_px,
        spread_px=spread_px,
        within_1=within_1,
        within_2=within_2,
        edges=edges,
        shares=shares,
    )


def difference_picture(comparison: DisparityComparison, *, limit_px: float) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: blue where the first is smaller, red where it is larger, white where equal."""
    share = np.clip(np.nan_to_num(comparison.difference_px) / limit_px, -1.0, 1.0)
    fade = (255.0 * (1.0 - np.abs(share))).astype(np.uint8)
    full = np.full_like(fade, 255)
    picture = np.where(
        (share > 0.0)[..., None], np.stack([full, fade, fade], axis=2), np.stack([fade, fade, full], axis=2)
    )
    picture[~np.isfinite(comparison.difference_px)] = UNKNOWN_RGB
    return picture
