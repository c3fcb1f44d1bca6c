"""Corrections of a fixation's answer: their kinds, and which distances they leave."""

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
    """Return what kind of correction an order is; None when it corrects nothing."""
    if order.corrects is None:
        return None
    return order.correction or ("click" if order.rectangle is None else "rectangle")


SIGMAS = 3.0
"""Standard errors about the present answer that are excluded with it."""


LEAST_SHARE = 0.01
"""Least share of the present distance that is excluded: else its neighbour on the same surface answers."""


def remaining_range(fixation: FixationDocument, direction: RangeSide) -> DistanceRange:
    """Return the distances nearer or farther than the answer of a fixation.

    They are within the range of its own request, too. Raise `InvalidInput` when there is no answer, or
    nothing remains.
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
    """Return the nearest and the farthest distance, m, that the present answer takes up."""
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
    """Return the distance that halves the range of disparities between two distances, m."""
    return 2.0 / (1.0 / nearest_m + (0.0 if farthest_m is None else 1.0 / farthest_m))
