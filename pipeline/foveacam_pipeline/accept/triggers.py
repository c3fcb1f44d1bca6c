"""Check of the trigger and strobe lines: each fovea is exposed alone, and must send a frame and a strobe."""

from contextlib import suppress
from dataclasses import dataclass

from foveacam_hardware.contract import (
    PARKED,
    Camera,
    ExposureReceipt,
    FoveaError,
    NotConnected,
    Role,
    Stopped,
    Timeout,
    TriggerSource,
)
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest, camera_of, other_eye
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.capture.run.access import CaptureRig

EXPOSURE_NS = 2_000_000
PULSE_US = 1_000
TRIES = 3
"""Exposures of an eye until one succeeds: a frame may be lost."""
FRAME_MS = 500.0
STILL_MS = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LineState:
    """What one fovea's lines did. `strobe_ms`: from the trigger to its strobe; None without one."""

    exposed: bool
    strobe_ms: float | None


def check_triggers(rig: RigUnderTest) -> tuple[AcceptanceCheck, dict[Role, LineState]]:
    """Return the result, and the state of each fovea's lines; late strobes are judged by the timing."""
    settings = rig.settings()
    if any(settings[role].trigger_source is TriggerSource.SOFTWARE for role in EYES):
        note = "the foveae are exposed by commands, so there are no lines to test"
        return judged("triggers", TITLE, note=note), {}
    rig.access.head.expose_foveae(exposure_ns=EXPOSURE_NS, gain_db=0.0)
    try:
        states = {role: _tried(rig, role) for role in EYES}
    finally:
        left = settings[Role.LEFT]
        rig.access.head.expose_foveae(exposure_ns=left.exposure_ns, gain_db=left.gain_db)
    figures = [
        Measured(
            name=f"{role} strobe after the trigger",
            value=round(state.strobe_ms, 4),
            unit="ms",
        )
        for role, state in states.items()
        if state.strobe_ms is not None
    ]
    return judged("triggers", TITLE, figures=figures, findings=_findings(states)), states


TITLE = "Trigger and strobe lines"


def _findings(states: dict[Role, LineState]) -> list[NamedFault]:
    found = []
    for role, state in states.items():
        if not state.exposed:
            detail = f"the {role} camera was triggered {TRIES} times and sent no frame"
            found.append(NamedFault(fault=Fault.NO_TRIGGER, subject=str(role), detail=detail))
        elif state.strobe_ms is None:
            detail = f"the {role} camera sent its frames, but no strobe reached the controller"
            found.append(NamedFault(fault=Fault.NO_STROBE, subject=str(role), detail=detail))
    return found


def _tried(rig: RigUnderTest, role: Role) -> LineState:
    """Expose one eye until a frame and a strobe came; return the best of the tries."""
    best = LineState(exposed=False, strobe_ms=None)
    for _ in range(TRIES):
        state = rig.access.run_moving(lambda devices: _exposed_alone(devices, role))
        exposed = best.exposed or state.exposed
        strobe_ms = state.strobe_ms if state.strobe_ms is not None else best.strobe_ms
        best = LineState(exposed=exposed, strobe_ms=strobe_ms)
        if best.exposed and best.strobe_ms is not None:
            break
    return best


def _exposed_alone(rig: CaptureRig, role: Role) -> LineState:
    other = other_eye(role)
    camera = camera_of(rig, role)
    _drain(camera)
    receipt: ExposureReceipt | None = None
    try:
        receipt = rig.mirrors.expose(PARKED, settle_us=0, pulse_us=PULSE_US, without=other)
    except (NotConnected, Stopped):
        raise
    except FoveaError:  # no strobe in time: the frame shows whether it was exposed
        receipt = None
    strobe_ms = None if receipt is None else (receipt.t_exposure_start_ns - receipt.t_trigger_ns) / 1e6
    return LineState(exposed=_frame_came(camera), strobe_ms=strobe_ms)


def _frame_came(camera: Camera) -> bool:
    try:
        camera.read(timeout_ms=FRAME_MS)
    except Timeout:
        return False
    return True


def _drain(camera: Camera) -> None:
    with suppress(Timeout):
        while True:
            camera.read(timeout_ms=STILL_MS)
