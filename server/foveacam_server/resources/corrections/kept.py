"""A correction as it is kept with its target, and the target's document after it."""

from typing import Literal, TypeAlias

from foveacam_server.foundation.store import Document
from foveacam_server.resources.fixations.schema import CorrectionDocument, FixationDocument, TargetDocument

Kind: TypeAlias = Literal["choice", "nearer", "farther", "rectangle", "click"]


def kind_of(request: Document) -> Kind | None:
    """Return what kind of correction a stored fixation request is; None when it corrects nothing."""
    if request.get("corrects") is None:
        return None
    match request.get("correction"):
        case "nearer":
            return "nearer"
        case "farther":
            return "farther"
    return "click" if request.get("rectangle") is None else "rectangle"


def with_correction(target: TargetDocument, correction: CorrectionDocument) -> TargetDocument:
    """Return the target with one more correction."""
    return target.model_copy(update={"corrections": [*target.corrections, correction]})


def with_alternative(target: TargetDocument, fixation: FixationDocument, alternative: int) -> TargetDocument:
    """Return the target with one of the fixation's alternatives as its distance."""
    chosen = fixation.alternatives[alternative]
    return target.model_copy(
        update={
            "basis": chosen.basis,
            "distance_m": chosen.distance_m,
            "distance_sigma_m": chosen.distance_sigma_m,
            "point_rig_m": chosen.point_rig_m,
            "alternatives": fixation.alternatives,
            "bound": None,
            "fixation_id": fixation.id,
            "cloud_id": fixation.cloud_id,
        }
    )
