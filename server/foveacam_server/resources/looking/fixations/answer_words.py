"""The answer of a fixation in words: one line for the event log, several for the command line."""

import math
from typing import TYPE_CHECKING, TypeAlias

from foveacam_server.resources.looking.fixations.schema import (
    AlternativeDocument,
    BoundDocument,
    FixationDocument,
    FixationEstimate,
)

if TYPE_CHECKING:
    from foveacam_client import models

AnyFixation: TypeAlias = "FixationDocument | models.FixationDocument"
"""A fixation of this program, or as a server's client has it."""
AnyAlternative: TypeAlias = "AlternativeDocument | models.AlternativeDocument"
AnyBound: TypeAlias = "BoundDocument | models.BoundDocument"

BASIS_WORDS = {
    "both_foveae": "by both foveae",
    "fovea_and_wide": "by one fovea and the wide camera",
    "surroundings": "from its surroundings",
}

BASIS_SENTENCES = {
    "both_foveae": "Measured by both foveae: left against right, confirmed by the wide view.",
    "fovea_and_wide": "Measured by the {eye} fovea and the wide camera: the other eye does not see it. Half"
    " the baseline: a larger ±.",
    "surroundings": "Inferred from its surroundings: nothing on it can be matched; interpolated by a surface"
    " through the depth measured around it.",
    "bound": "Limits only: the distance itself could not be measured.",
}
"""What the page shows over a distance, and what it means."""


def fixation_words(fixation: FixationDocument) -> str:
    """Return the result of a fixation as one line for the event log."""
    if fixation.basis is None:
        return f"{fixation.state.replace('_', ' ')}: {fixation.reason}"
    return f"{distance_words(fixation)}, in {len(fixation.steps)} steps"


def estimate_words(estimate: FixationEstimate) -> str:
    """Return an estimate as one line."""
    when = f"after look {estimate.step}" if estimate.step else "before the first look"
    return f"{distance_words(estimate)}, {when}"


def distance_words(answer: FixationDocument | FixationEstimate) -> str:
    """Return distance, standard error and basis of an answer in words, or the limits of the distance."""
    if answer.distance_m is not None and answer.distance_sigma_m is not None:
        basis = BASIS_WORDS.get(answer.basis or "", "")
        return f"at {_measured(answer.distance_m, answer.distance_sigma_m)} {basis}".rstrip()
    return "at no known distance" if answer.bound is None else _bound_words(answer.bound)


def answer_lines(fixation: AnyFixation) -> list[str]:
    """Return an answer with a distance or limits as lines: the distance, its basis, the alternatives."""
    if fixation.distance_m is not None and fixation.distance_sigma_m is not None:
        known = _measured(fixation.distance_m, fixation.distance_sigma_m)
    else:
        known = "no distance" if fixation.bound is None else _bound_words(fixation.bound)
    lines = [known, BASIS_SENTENCES[fixation.basis or "bound"].format(eye=_seeing_eye(fixation))]
    if fixation.alternatives:
        lines.append("It may be at one of these distances:")
        lines += [f"  {_alternative_words(other)}" for other in fixation.alternatives]
    return lines


def _alternative_words(other: AnyAlternative) -> str:
    known = _measured(other.distance_m, other.distance_sigma_m)
    return f"{known} {BASIS_WORDS.get(other.basis, '')}, probability {100.0 * other.probability:.0f} %"


def _seeing_eye(fixation: AnyFixation) -> str:
    """Return "left" or "right" where exactly one eye saw the target, else "one"."""
    views = {"left": fixation.left_view, "right": fixation.right_view}
    seeing = [eye for eye, view in views.items() if view is not None and view.sees_target]
    return seeing[0] if len(seeing) == 1 else "one"


def _measured(distance_m: float, sigma_m: float) -> str:
    """Return a distance with its standard error, of which two digits are shown."""
    digits = 3 if sigma_m <= 0.0 else min(5, max(0, 1 - math.floor(math.log10(sigma_m))))
    return f"{distance_m:.{digits}f} ± {sigma_m:.{digits}f} m"


def _bound_words(bound: AnyBound) -> str:
    nearest = f"farther than {bound.nearest_m:.1f} m"
    return nearest if bound.farthest_m is None else f"{nearest}, nearer than {bound.farthest_m:.1f} m"
