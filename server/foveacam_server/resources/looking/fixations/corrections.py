"""Kinds of corrections of a fixation's answer, and the range of distances that each leaves."""

import math
from typing import Literal, TypeAlias

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.verge.values import DistanceRange
from foveacam_server.resources.looking.fixations.request import depth_range_of
from foveacam_server.resources.looking.fixations.schema import (
    DistanceLimits,
    FixationDocument,
    FixationOrder,
    RangeSide,
)

CorrectionKind: TypeAlias = Literal["choice", "nearer", "farther", "rectangle", "click"]


def kind_of(order: FixationOrder) -> CorrectionKind | None:
    """Return the kind of correction that an order requests; None for an ordinary fixation."""
    if order.corrects is None:
        return None
    return order.correction or ("click" if order.rectangle is None else "rectangle")


SIGMAS = 3.0
"""Width of the excluded interval on each side of the present answer, in standard errors."""


LEAST_SHARE = 0.01
"""Smallest excluded share of the present distance; with less, a point beside it on the same surface would
answer."""


def remaining_range(fixation: FixationDocument, direction: RangeSide) -> DistanceRange:
    """Return the range of distances nearer or farther than a fixation's answer.

    It lies within the range of the fixation's own request, too. Raise `InvalidInput` when there is no answer,
    or nothing remains.
    """
    nearest_m, farthest_m = _excluded(fixation)
    before = depth_range_of(fixation.order) or DistanceRange(nearest_m=0.0, farthest_m=math.inf)
    if direction == "nearer":
        left = DistanceRange(nearest_m=before.nearest_m, farthest_m=min(before.farthest_m, nearest_m))
    else:
        left = DistanceRange(nearest_m=max(before.nearest_m, farthest_m), farthest_m=before.farthest_m)
    if not left.nearest_m < left.farthest_m:
        raise InvalidInput(
            f"nothing {direction} remains: {left.nearest_m:.2f} m to {left.farthest_m:.2f} m is empty after "
            "the corrections before",
            asked=direction,
            found="an empty range of distances",
            remedy="click on the target again to begin anew",
        )
    return left


def limits_of(depth_range: DistanceRange) -> DistanceLimits:
    """Return the range as a request's `within`."""
    farthest_m = depth_range.farthest_m
    return DistanceLimits(
        nearest_m=round(depth_range.nearest_m, 6),
        farthest_m=round(farthest_m, 6) if math.isfinite(farthest_m) else None,
    )


def _excluded(fixation: FixationDocument) -> tuple[float, float]:
    """Return the nearest and the farthest distance, m, that are excluded with the present answer."""
    answer = fixation.answer
    if answer.distance_m is not None and answer.distance_sigma_m is not None:
        margin_m = max(SIGMAS * answer.distance_sigma_m, LEAST_SHARE * answer.distance_m)
        return answer.distance_m - margin_m, answer.distance_m + margin_m
    bound = fixation.bound
    if bound is None:
        raise InvalidInput(
            "this fixation has neither a distance nor limits, so nothing is nearer or farther",
            asked="nearer or farther",
            found="no distance",
            remedy="click on the target again",
        )
    middle_m = _middle_m(bound.nearest_m, bound.farthest_m)
    return middle_m, middle_m


def _middle_m(nearest_m: float, farthest_m: float | None) -> float:
    """Return the distance, m, in the middle of the disparities of two distances: their harmonic mean."""
    return 2.0 / (1.0 / nearest_m + (0.0 if farthest_m is None else 1.0 / farthest_m))
