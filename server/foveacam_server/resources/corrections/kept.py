"""A correction as it is kept with its target, and the target's document after it."""

from typing import Literal, TypeAlias

from foveacam_server.runtime.store import Document

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


def entry(kind: Kind, *, fixation_id: str, created_utc: str, alternative: int | None = None) -> Document:
    """Return one correction as it is kept."""
    return {
        "kind": kind,
        "created_utc": created_utc,
        "fixation_id": fixation_id,
        "alternative": alternative,
    }


def with_correction(target: Document, correction: Document) -> Document:
    """Return the target's document with one more correction."""
    return {**target, "corrections": [*target.get("corrections", []), correction]}


def with_alternative(target: Document, fixation: Document, alternative: int) -> Document:
    """Return the target's document with one of the fixation's alternatives as its distance."""
    chosen = fixation["alternatives"][alternative]
    measured = {key: chosen[key] for key in ("basis", "distance_m", "distance_sigma_m", "point_rig_m")}
    kept = {"alternatives": fixation["alternatives"], "bound": None, "fixation_id": fixation["id"]}
    return {**target, **measured, **kept, "cloud_id": fixation["cloud_id"]}
