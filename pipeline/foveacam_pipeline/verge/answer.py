"""The answer to one target, before it becomes a fixation."""

from dataclasses import dataclass

from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.closed_loop import VergedTarget
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.values import Alternative, Basis, DistanceBound, EyeView


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """How a distance is known, and the distance or its limits; `basis` None: no eye can look there."""

    basis: Basis | None
    reason: str
    left_view: EyeView
    right_view: EyeView
    point: LocatedPoint | None = None
    bound: DistanceBound | None = None
    alternatives: tuple[Alternative, ...] = ()
    score: float | None = None
    verged: VergedTarget | None = None


def both_foveae(verged: VergedTarget) -> Answer:
    """Return the answer of a loop that verged."""
    return Answer(
        basis=Basis.BOTH_FOVEAE,
        reason=verdict.verged(verged.point, verged.fine),
        left_view=EyeView(sees_target=True),
        right_view=EyeView(sees_target=True),
        point=verged.point,
        score=verged.fine.score,
        verged=verged,
    )


def beyond_reach(reason: str) -> Answer:
    """Return the answer where no eye can look."""
    out = EyeView(sees_target=False, reason=verdict.CANNOT_TURN)
    return Answer(basis=None, reason=reason, left_view=out, right_view=out)


def alternative(basis: Basis, point: LocatedPoint, probability: float) -> Alternative:
    """Return one of several answers to choose from."""
    return Alternative(
        basis=basis,
        distance_m=point.distance_m,
        distance_sigma_m=point.distance_sigma_m,
        point_rig_m=point.point_rig_m,
        probability=probability,
    )
