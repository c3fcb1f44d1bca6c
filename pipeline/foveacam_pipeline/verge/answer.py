"""The answer to one target, before it becomes a fixation."""

from dataclasses import dataclass

from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.closed_loop import Verged
from foveacam_pipeline.verge.distance import Place
from foveacam_pipeline.verge.values import Alternative, Basis, DistanceBound, EyeView


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """How a distance is known, and the distance or its limits; `basis` None: no eye can look there."""

    basis: Basis | None
    reason: str
    left_view: EyeView
    right_view: EyeView
    place: Place | None = None
    bound: DistanceBound | None = None
    alternatives: tuple[Alternative, ...] = ()
    score: float | None = None
    verged: Verged | None = None


def both_foveae(verged: Verged) -> Answer:
    """Return the answer of a loop that verged."""
    return Answer(
        basis=Basis.BOTH_FOVEAE,
        reason=verdict.verged(verged.place, verged.fine),
        left_view=EyeView(sees_target=True),
        right_view=EyeView(sees_target=True),
        place=verged.place,
        score=verged.fine.score,
        verged=verged,
    )
