"""Runs a capture, and keeps the times of its steps for the estimates of the next captures."""

from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_pipeline.capture.plan import plan_from
from foveacam_pipeline.capture.run import PaceMeter, RigAccess, run_capture
from foveacam_server.datasets.capture_paces import CapturePaces
from foveacam_server.datasets.capture_tools import rig_facts


def run_timed(access: RigAccess, writer: DatasetWriter, meter: PaceMeter, paces: CapturePaces) -> None:
    """Capture what the writer's dataset lacks; keep the times of one that is completed.

    `meter`: has watched how the capture was begun, and watches the rest.
    """
    pace, header = access.run_still(rig_facts).pace(), writer.header
    run_capture(access, writer, watch=meter)
    plan = plan_from(header.plan, what=f"plan of {writer.folder}")
    if header.rig_id is not None:
        paces.add(header.rig_id, meter.step_times(plan, pace))
