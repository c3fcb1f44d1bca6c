"""Tests of a draft's devices: identify the device on a port; a small step of the mirrors and back."""

from collections.abc import Callable
from pathlib import Path

from foveacam_hardware.contract import Clock, DeviceInfo, FoveaError, MirrorVolts, NotConnected, StereoVolts
from foveacam_hardware.device_trials import ask_controller, ask_pan_tilt
from foveacam_hardware.rig_config import SerialRigConfig, parse_rig_config
from foveacam_server.resources.devices.rig_setup.rig_files import TomlTable
from foveacam_server.resources.devices.rig_setup.schema import SIMULATED, RigDraft, TryResult
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.status import RigStatus

STEP_V = 3.0
"""Step of the mirrors in a test: visible in the pictures, and far from every limit."""
STEP_NS = 250_000_000
"""Pause after each step, for the operator to see it."""


def try_controller(
    draft: RigDraft, hardware: HardwareThread, *, open_ports: set[str], clock: Clock
) -> TryResult:
    """Identify the device on the port of the draft's controller; nothing is switched on."""
    port = draft.mirrors.port
    if not port:
        return TryResult(good=False, sentence="No port is chosen for the controller.", remedy="Choose one.")
    if port in open_ports:
        return _of_open_rig(hardware.status, "mirrors", hardware.status.controller)
    return _tried(lambda: ask_controller(port, clock=clock), "controller")


def try_pan_tilt(
    draft: RigDraft,
    table: TomlTable,
    hardware: HardwareThread,
    *,
    open_ports: set[str],
    clock: Clock,
) -> TryResult:
    """Identify the device on the port of the draft's pan-tilt; nothing turns.

    `table`: in the draft's file.
    """
    pan_tilt = draft.pan_tilt
    if draft.mirrors.port == SIMULATED or (pan_tilt is not None and pan_tilt.port in open_ports):
        found = hardware.status.pan_tilt
        return _of_open_rig(hardware.status, "pan_tilt", None if found is None else found.info)
    if pan_tilt is None:
        return TryResult(
            good=False, sentence="No pan-tilt is chosen.", remedy="Choose its kind and its port."
        )
    if pan_tilt.kind == "manual":
        return TryResult(good=True, sentence="Somebody turns the rig by hand: nothing to ask.", remedy="")
    return _tried(lambda: ask_pan_tilt(_rig_around(table), clock=clock), "pan-tilt")


def step_mirrors(hardware: HardwareThread, *, clock: Clock) -> TryResult:
    """Move each mirror a small step on each axis and back; raise what a move raises."""
    start = hardware.gaze
    try:
        for volts in _steps(start):
            answer_of(hardware.steer(volts), asked="a small step")
            clock.sleep_until_ns(clock.now_ns() + STEP_NS)
    finally:
        answer_of(hardware.steer(start), asked="the way back")
    return TryResult(
        good=True,
        sentence=f"Both mirrors took a step of {STEP_V:g} V on each axis and came back, and the controller"
        " confirmed each.",
        remedy="",
    )


def _steps(start: StereoVolts) -> list[StereoVolts]:
    """Return a step of the left mirror right and down, then of the right mirror; towards rest, never away."""
    steps = []
    for eye in ("left", "right"):
        volts = getattr(start, eye)
        across = MirrorVolts(x_v=_stepped(volts.x_v), y_v=volts.y_v)
        down = MirrorVolts(x_v=volts.x_v, y_v=_stepped(volts.y_v))
        other = {"left": start.left, "right": start.right}
        steps += [StereoVolts(**(other | {eye: step})) for step in (across, down)]
    return steps


def _stepped(volts_v: float) -> float:
    return volts_v - STEP_V if volts_v > 0.0 else volts_v + STEP_V


def _rig_around(table: TomlTable) -> SerialRigConfig:
    """Return a rig with only this pan-tilt, to test it before the rest of the draft is valid."""
    content = {"kind": "serial", "rig_id": "try", "mirrors": {"port": "auto"}, "pan_tilt": table}
    config = parse_rig_config(content, file=Path("draft"))
    if not isinstance(config, SerialRigConfig):
        raise NotConnected("a simulated rig has no port to ask")
    return config


def _tried(ask: Callable[[], DeviceInfo], what: str) -> TryResult:
    try:
        return _answered(ask(), what)
    except FoveaError as error:
        sentence, remedy = error.parts
        return TryResult(good=False, sentence=sentence, remedy=remedy)


def _of_open_rig(status: RigStatus, device: str, info: DeviceInfo | None) -> TryResult:
    """Return the result for a device of the open rig from its status, without a request to it."""
    problem = next((one for one in status.problems if one.device == device), None)
    if problem is not None:
        return TryResult(good=False, sentence=problem.detail, remedy=problem.remedy)
    if info is None:
        return TryResult(
            good=False,
            sentence="The rig that is open has no such device.",
            remedy="See the steps of its start.",
        )
    return _answered(info, "controller" if device == "mirrors" else "pan-tilt")


def _answered(info: DeviceInfo, what: str) -> TryResult:
    name = info.model if info.model.startswith(info.vendor) else f"{info.vendor} {info.model}"
    details = [f"version {info.version}"] if info.version else []
    details += [f"serial {info.serial}"] if info.serial else []
    return TryResult(good=True, sentence=f"The {what} answers: {', '.join([name, *details])}.", remedy="")
