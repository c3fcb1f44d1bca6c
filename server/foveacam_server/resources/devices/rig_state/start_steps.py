"""Turns the steps of the rig's start into REST's schema."""

from foveacam_server.resources.devices.rig_state.schema import StartDocument, StartStepDocument
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_thread.opening_steps import OpeningStep, StepState
from foveacam_server.rig.ports import CalibrationInForce


def start_document(hardware: HardwareThread, calibration: CalibrationInForce) -> StartDocument:
    """Return each step of the rig's last start: pending, active, done, or failed and why."""
    file, *devices = hardware.opening.steps.every
    failing = {problem.device for problem in hardware.status.problems}
    return StartDocument(
        steps=[
            _start_step(file, failing),
            _calibration_step(calibration, after=file),
            *(_start_step(device, failing) for device in devices),
        ]
    )


def _start_step(step: OpeningStep, failing: set[str]) -> StartStepDocument:
    late = step.state is StepState.FAILED and step.device not in failing
    return StartStepDocument(
        device=step.device,
        state="done" if late else step.state.value,
        detail="It answered later." if late else step.detail,
        remedy="" if late else step.remedy or "",
        left_s=None if step.left_s is None else round(step.left_s, 1),
    )


def _calibration_step(calibration: CalibrationInForce, *, after: OpeningStep) -> StartStepDocument:
    problem = calibration.problem
    if after.state is not StepState.DONE:
        return StartStepDocument(device="calibration", state="pending", detail="", remedy="")
    return StartStepDocument(
        device="calibration",
        state="done" if problem is None else "failed",
        detail=problem or "",
        remedy="" if problem is None else "calibrate this rig, or load its calibration",
    )
