"""One more look at a fixation's target at full resolution for a denser cloud; the answer stays."""

from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput, Sighting
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import aim_at, clamp_gazes, volts_for
from foveacam_pipeline.verge.values import Basis
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.resources.looking.clouds.shapes import FULL_SCALE, ShapeWorker, VergedLook
from foveacam_server.resources.looking.fixations.documents import drawing_of
from foveacam_server.resources.looking.fixations.schema import FixationDocument
from foveacam_server.resources.looking.fixations.table import FixationTable, TargetTable
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_web.scene_values import FixationDrawing

KIND = "full_resolution"
TOTAL = 2
"""Steps of the job's progress: the look, then its depth."""


class FullResolutionOrder(RequestModel):
    """The job's request: the fixation whose target is looked at."""

    fixation_id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FullResolutionTools:
    """Services and callbacks that the looks need."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    shapes: ShapeWorker
    fixations: FixationTable
    targets: TargetTable


class FullResolutionLooks:
    """Looks at the point of a fixation's answer at full resolution and computes its shape at that size."""

    def __init__(self, tools: FullResolutionTools) -> None:
        self._tools = tools
        tools.jobs.handle(KIND, self._run)

    def look(self, fixation_id: str, *, idempotency_key: str | None = None) -> Job:
        """Queue the look; raise at once where it cannot be made now."""
        tools = self._tools
        point_of(tools.fixations.get(fixation_id))
        tools.calibration.require()
        tools.hardware.check_may_move()
        order = FullResolutionOrder(fixation_id=fixation_id)
        return tools.jobs.submit(KIND, order, idempotency_key=idempotency_key, total=TOTAL)

    def _run(self, context: JobContext) -> str:
        fixation = self._tools.fixations.get(context.job.parse_request(FullResolutionOrder).fixation_id)
        target = None if fixation.target_id is None else self._tools.targets.find(fixation.target_id)
        answer = point_of(fixation, label=target.label if target else (fixation.order.label or "fixation"))
        calibration = self._tools.calibration.require()
        context.progress(0, total=TOTAL, note="look at full resolution")
        sighting = self._sighting(context, answer, calibration)
        context.check()
        context.progress(1, total=TOTAL, note="depth at full resolution")
        seen = VergedLook(
            fixation_id=fixation.id,
            drawing=answer,
            sighting=sighting,
            calibration=calibration,
            target_id=target.id if target else None,
            scale=FULL_SCALE,
        )
        with span("shape"):
            cloud = self._tools.shapes.make(seen, check=context.check)
        context.progress(TOTAL, total=TOTAL)
        return f"/api/v1/clouds/{cloud.id}"

    def _sighting(self, context: JobContext, answer: FixationDrawing, calibration: Calibration) -> Sighting:
        """Look once with both gazes on the answer's point, all cameras at binning 1."""
        x_m, y_m, z_m = answer.point_rig_m
        gazes = aim_at(calibration, np.array([x_m, y_m]) / z_m, 1.0 / z_m)
        volts = volts_for(calibration, clamp_gazes(calibration, gazes))
        with self._tools.hardware.session(
            f"a look at full resolution ({context.job.id})", cancelled=context.cancelled, binning=1
        ) as head:
            return head.look(volts)


def point_of(fixation: FixationDocument, *, label: str = "") -> FixationDrawing:
    """Return the drawing of the point of a fixation's answer, which may be a chosen alternative.

    Raise `InvalidInput` where it has no distance, or where one fovea does not see it, so that there is no
    pair.
    """
    answer = fixation.answer
    drawing = drawing_of(answer, label=label)
    if drawing is None or answer.basis is None:
        raise _no_cloud(fixation.id, "no distance of it is known", "look at something that has texture")
    if drawing.basis is Basis.FOVEA_AND_WIDE:
        raise _no_cloud(fixation.id, "one fovea does not see it", "look at something that both foveae see")
    return drawing


def _no_cloud(fixation_id: str, found: str, remedy: str) -> InvalidInput:
    asked = f"the cloud of {fixation_id} at full resolution"
    return InvalidInput(f"asked for {asked}: {found}", asked=asked, found=found, remedy=remedy)
