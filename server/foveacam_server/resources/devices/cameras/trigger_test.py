"""Tests the trigger of both foveae: by a software command to each, then by one pulse of the controller.

The verdict names the likely cause. Each step runs in the hardware thread.
"""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraSettings,
    DeviceFault,
    FoveaError,
    InvalidInput,
    NotConnected,
    OutOfRange,
    Role,
    StereoVolts,
    Stopped,
    Timeout,
    TriggerSource,
)
from foveacam_server.rig.ports import AssembledRig

_log = logging.getLogger(__name__)

STILL_MS = 200.0
"""Time without a frame after which a camera counts as having stopped delivering."""
MIN_WAIT_MS = 1000.0
MARGIN_MS = 500.0
LONGEST_AFTER_PULSE_US = 4000
"""Longest time from the end of the pulse to that of the exposure: the controller times out after 5 ms."""


class TriggerVerdict(StrEnum):
    """Result of a test."""

    UNTESTED = "untested"
    OK = "ok"
    SOFTWARE_ONLY = "ok_software_only"
    CAMERA = "camera"
    WIRING = "wiring"
    NO_PROBE = "no_probe"


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeTestResult:
    """Result of one eye; `software_ms`, `hardware_ms`: from trigger to frame."""

    role: Role
    verdict: TriggerVerdict
    detail: str
    software_ms: float | None = None
    hardware_ms: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerProbe:
    """Result of one kind of trigger: the time until the frame, or the reason why none came."""

    took_ms: float | None = None
    why: str = ""
    possible: bool = True
    """Whether this kind of trigger could be tested at all."""


def patience_ms(settings: CameraSettings) -> float:
    """Return the timeout of a triggered frame, ms."""
    return max(MIN_WAIT_MS, 2.0 * settings.exposure_ns / 1e6 + MARGIN_MS)


def probe_by_software(rig: AssembledRig, camera: Camera) -> TriggerProbe:
    """Set a camera to software trigger, trigger it and read the frame; the settings stay changed."""
    by_hand = replace(camera.settings, exposure_auto=AutoMode.OFF)
    try:
        camera.configure(replace(by_hand, triggered=True, trigger_source=TriggerSource.SOFTWARE))
    except (OutOfRange, InvalidInput) as error:
        return TriggerProbe(why=str(error), possible=False)
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    try:
        _await_silence(rig, camera)
        began_ns = rig.clock.now_ns()
        camera.software_trigger()
        camera.read(timeout_ms=patience_ms(camera.settings))
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    return TriggerProbe(took_ms=(rig.clock.now_ns() - began_ns) / 1e6)


def probe_by_pulse(
    rig: AssembledRig, cameras: tuple[Camera, ...], *, gaze: StereoVolts
) -> dict[Role, TriggerProbe] | None:
    """Set the foveae to hardware trigger and give one pulse; None when no pulse could be given.

    The settings stay changed.
    """
    exposure_ns = min(camera.settings.exposure_ns for camera in cameras)
    found = {camera.role: _arm_for_pulse(rig, camera, exposure_ns) for camera in cameras}
    began_ns = rig.clock.now_ns()
    exposure_us = exposure_ns // 1000
    pulse_us = max(1, exposure_us // 2, exposure_us - LONGEST_AFTER_PULSE_US)
    complaint = ""
    try:
        rig.mirrors.expose(gaze, settle_us=0, pulse_us=pulse_us)
    except (NotConnected, Stopped):
        return None
    except FoveaError as error:  # one strobe may be missing: the frames show whose
        complaint = str(error)
    for camera in cameras:
        if not found[camera.role].why:
            found[camera.role] = _after_pulse(rig, camera, began_ns)
    if complaint and not any(probe.why for probe in found.values()):
        why = f"its frame came, but a strobe did not reach the controller ({complaint})"
        found = {role: replace(probe, why=why) for role, probe in found.items()}
    return found


def verdict_of(role: Role, software: TriggerProbe, hardware: TriggerProbe | None) -> EyeTestResult:
    """Return the verdict of both probes; `hardware` is None where no pulse could be given."""

    def found(verdict: TriggerVerdict, detail: str) -> EyeTestResult:
        return EyeTestResult(
            role=role,
            verdict=verdict,
            detail=detail,
            software_ms=software.took_ms,
            hardware_ms=None if hardware is None else hardware.took_ms,
        )

    by_command = software.took_ms is not None
    if hardware is not None and not hardware.why:
        return found(TriggerVerdict.OK, "commands and pulses expose it" if by_command else "pulses expose it")
    if by_command and (hardware is None or not hardware.possible):
        why = "the controller could not give a pulse" if hardware is None else hardware.why
        return found(TriggerVerdict.SOFTWARE_ONLY, f"commands expose it; its line was not tested: {why}")
    if not by_command and software.possible:
        return found(
            TriggerVerdict.CAMERA, f"not even a command exposes it: {software.why}; check the camera itself"
        )
    if hardware is None or not hardware.possible:
        return found(
            TriggerVerdict.NO_PROBE, f"it takes no commands, and no pulse could be given: {software.why}"
        )
    finding = "commands expose it and pulses do not" if by_command else "pulses do not expose it"
    return found(TriggerVerdict.WIRING, f"{finding}: {hardware.why}; check its trigger and strobe cables")


def put_back(cameras: Iterable[Camera], before: Mapping[Role, CameraSettings]) -> dict[Role, CameraSettings]:
    """Restore every camera's settings; return those of cameras that are lost."""
    pending = {}
    for camera in cameras:
        try:
            camera.configure(before[camera.role])
        except FoveaError as error:
            _log.warning("after the trigger test: %s", error)
            pending[camera.role] = before[camera.role]
    return pending


def _arm_for_pulse(rig: AssembledRig, camera: Camera, exposure_ns: int) -> TriggerProbe:
    """Set a camera to hardware trigger; return the result, with the reason if that failed."""
    by_hand = replace(camera.settings, exposure_ns=exposure_ns, exposure_auto=AutoMode.OFF)
    settings = replace(by_hand, triggered=True, trigger_source=TriggerSource.HARDWARE)
    try:
        camera.configure(settings)
        _await_silence(rig, camera)
    except FoveaError as error:
        return TriggerProbe(why=str(error), possible=not isinstance(error, OutOfRange))
    return TriggerProbe()


def _after_pulse(rig: AssembledRig, camera: Camera, began_ns: int) -> TriggerProbe:
    try:
        camera.read(timeout_ms=patience_ms(camera.settings))
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    return TriggerProbe(took_ms=(rig.clock.now_ns() - began_ns) / 1e6)


def _await_silence(rig: AssembledRig, camera: Camera) -> None:
    """Read frames until no more arrive; raise `DeviceFault` when they do not stop."""
    until_ns = rig.clock.now_ns() + round(patience_ms(camera.settings) * 1e6)
    while rig.clock.now_ns() < until_ns:
        try:
            camera.read(timeout_ms=STILL_MS)
        except Timeout:
            return
    raise DeviceFault(
        f"camera {camera.role}: set to wait for a trigger, and it still delivers; check its trigger setting"
    )
