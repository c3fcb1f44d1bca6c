"""Whether the probabilities of alternative distances are true: of those stated at p a share of p is right."""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from foveacam_bench.figures import Figures
from foveacam_pipeline.verge.values import Alternative

SAID_PROBABILITY = 0.15
"""Least probability at which an alternative counts as said."""
RIGHT_SHARE, RIGHT_SIGMAS, MOST_SHARE = 0.03, 3.0, 0.1
"""Largest error of a right alternative: a share of the distance, or standard errors up to a larger share."""
BINS = (0.0, 0.15, 0.3, 0.5, 0.7, 1.01)
"""Limits of the probabilities that are judged together."""


def right(alternative: Alternative, range_m: float) -> bool:
    """Return whether an alternative is the true distance, within its error; the background has none."""
    error_m = abs(alternative.distance_m - range_m)
    errors_m = min(RIGHT_SIGMAS * alternative.distance_sigma_m, MOST_SHARE * range_m)
    return math.isfinite(range_m) and error_m <= max(RIGHT_SHARE * range_m, errors_m)


def said(alternatives: Iterable[Alternative], range_m: float) -> bool:
    """Return whether a true distance is among the alternatives, and not as an unlikely one."""
    return any(one.probability >= SAID_PROBABILITY and right(one, range_m) for one in alternatives)


def reliability(stated: list[tuple[float, bool]]) -> Figures:
    """Return how far stated probabilities are from the share that is right, and both by range.

    `stated`: probability and whether it was right, of every alternative.
    """
    if not stated:
        return {"alternatives": 0, "stated_probability_error": None, "reliability": []}
    table = np.array(stated, dtype=np.float64)
    bins = [table[(table[:, 0] >= low) & (table[:, 0] < high)] for low, high in pairwise(BINS)]
    shown = [(len(one), *one.mean(axis=0).tolist()) for one in bins if len(one)]
    error = sum(count * abs(probability - share) for count, probability, share in shown) / len(table)
    rows = [{"count": n, "stated": round(p, 3), "right": round(share, 3)} for n, p, share in shown]
    return {"alternatives": len(table), "stated_probability_error": float(error), "reliability": rows}
