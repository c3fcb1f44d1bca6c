"""`foveacam look` with a rig of its own: one fixation, and its shape where a file of it is asked for."""

from dataclasses import dataclass

from rich.console import Console

from foveacam_hardware.rig import Rig
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.estimator import BACKENDS, MatchedPair
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Fixation, VergeStep
from foveacam_server.commands.calibration_data import open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import RigChoice, open_enabled_rig
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id
from foveacam_server.foundation.progress_bar import progress_bar
from foveacam_server.resources.looking.clouds.collection import shape_content
from foveacam_server.resources.looking.clouds.shapes import VergedLook, fixation_shape
from foveacam_server.resources.looking.fixations.cli_order import LookOrder, print_answer, save_shape
from foveacam_server.resources.looking.fixations.documents import describe_fixation, drawing_of
from foveacam_server.resources.looking.fixations.request import check_target, target_of
from foveacam_server.resources.looking.fixations.schema import FixationDocument, FixationOrder

NO_JOB = ""
"""The job's id in the document of a fixation that no server made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Looked:
    """A fixation, its document, and the calibration that it was made with."""

    fixation: Fixation
    document: FixationDocument
    calibration: Calibration


def run_look(rig_options: RigOptions, order: LookOrder) -> None:
    """Open the rig, look, print the answer and save its shape."""
    choice = RigChoice.of(rig_options)
    console = Console(stderr=True, quiet=rig_options.as_json)
    with open_data(choice, lock=False) as data:
        calibration = data.calibration.require()
        check_target(target_of(order.request), calibration)
        with open_enabled_rig(choice, data.settle_times, console=console) as rig:
            looked = _look(rig, order, calibration, console=console)
    document = looked.document
    print_answer(order, document, as_json=rig_options.as_json)
    save_shape(order, document, lambda: _content(order, looked), as_json=rig_options.as_json)


def _look(rig: Rig, order: LookOrder, calibration: Calibration, *, console: Console) -> _Looked:
    with progress_bar(console, stage="look") as bar:

        def on_step(step: VergeStep) -> None:
            bar.progress(step.index + 1, total=None, note=step.phase.value)

        target = target_of(order.request)
        fixation = fixate(rig.head, calibration, target, clock=rig.clock, on_step=on_step)
    document = describe_fixation(
        fixation,
        calibration=calibration,
        fixation_id=new_id("fix"),
        job_id=NO_JOB,
        order=FixationOrder(pixel=order.request.pixel),
    )
    return _Looked(fixation=fixation, document=document, calibration=calibration)


def _content(order: LookOrder, looked: _Looked) -> bytes:
    """Return the shape's file; raise `NotFound` for a look of which nothing could be matched."""
    fixation, document = looked.fixation, looked.document
    drawing = drawing_of(fixation, label="look")
    if fixation.sighting is None or drawing is None:
        raise NotFound(f"look at {order.place}: it has no last look of both foveae; look again")
    seen = VergedLook(
        fixation_id=document.id,
        drawing=drawing,
        sighting=fixation.sighting,
        calibration=looked.calibration,
        target_id=None,
    )
    pair = rectify(seen.sighting, seen.calibration, scale=seen.scale)
    backend = BACKENDS["sgbm"]
    matched = MatchedPair(disparity=backend.estimate(pair), backend=backend.name, sha256=None)
    return shape_content(fixation_shape(seen, pair, matched), order.file)
