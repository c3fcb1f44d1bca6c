"""Applies the operator's corrections: chooses an alternative, or queues a look nearer or farther."""

from dataclasses import replace

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.looking.fixations.corrections import (
    limits_of,
    remaining_range,
)
from foveacam_server.resources.looking.fixations.documents import drawing_of
from foveacam_server.resources.looking.fixations.schema import (
    CorrectionDocument,
    FixationDocument,
    FixationOrder,
    RangeSide,
)
from foveacam_server.resources.looking.fixations.service import FixationService
from foveacam_server.rig.ports import SceneViewer

COPIED_FIELDS = {"pixel", "rectangle", "direction", "label", "depth"}
"""Request fields that a correcting look copies from the corrected fixation."""


def choose(
    fixations: FixationService, fixation_id: str, alternative: int, *, events: EventLog
) -> FixationDocument:
    """Make one alternative the answer of a fixation and of its target; return the fixation."""
    found = fixations.table.get(fixation_id)
    count = len(found.alternatives)
    if alternative >= count:
        has = (
            f"{count} alternatives, counted from 0"
            if count
            else "no alternatives, its answer is the only one"
        )
        raise InvalidInput(
            f"alternative {alternative} was asked; this fixation has {has}",
            asked=f"alternative {alternative}",
            found=has,
            remedy="choose one that it lists",
        )
    fixation = fixations.table.choose(fixation_id, alternative)
    events.emit("fixation.updated", f"alternative {alternative + 1} of {count} was chosen", data=fixation)
    target = fixations.targets.find(fixation.target_id) if fixation.target_id else None
    if target is not None:
        correction = CorrectionDocument(
            kind="choice", created_utc=utc_now(), fixation_id=fixation_id, alternative=alternative
        )
        corrections = (*target.corrections, correction)
        fixations.put_target(replace(target, fixation=fixation, corrections=corrections))
    return fixation


def show_choice(viewer: SceneViewer, fixation: FixationDocument) -> None:
    """Redraw the fixation at its chosen alternative, without the cloud of the other distance."""
    drawing = drawing_of(fixation.answer, label=fixation.order.label or "chosen")
    if drawing is not None and drawing.point_rig_m != fixation.point_rig_m:
        viewer.show_fixation(fixation.id, drawing)


def look_beside(fixations: FixationService, fixation_id: str, direction: RangeSide, *, source: str) -> Job:
    """Queue a look at the same target, restricted to distances nearer or farther than the present answer."""
    corrected = fixations.table.get(fixation_id)
    copied = corrected.order.model_dump(include=COPIED_FIELDS, exclude_unset=True, exclude_none=True)
    order = FixationOrder(
        **copied,
        within=limits_of(remaining_range(corrected, direction)),
        corrects=fixation_id,
        correction=direction,
        source=source,
    )
    return fixations.submit(order)
