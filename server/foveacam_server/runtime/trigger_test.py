"""Tests of the trigger, eye by eye: a command exposes the camera; then one pulse of the controller does.

The verdict tells what to look at. Each step is a piece of work for the thread that owns the rig.
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
from foveacam_server.runtime.ports import AssembledRig

_log = logging.getLogger(__name__)

STILL_MS = 200.0
"""A camera stands still once no frame has come for so long."""
LEAST_MS = 1000.0
MARGIN_MS = 500.0
LONGEST_AFTER_PULSE_US = 4000
"""An exposure must end this soon after the pulse: the controller gives up 5 ms after it."""


class TriggerVerdict(StrEnum):
    """What a test found."""

    UNTESTED = "untested"
    OK = "ok"
    SOFTWARE_ONLY = "ok_software_only"
    CAMERA = "camera"
    WIRING = "wiring"
    NO_PROBE = "no_probe"


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeTestResult:
    """What was found of one eye, in words; `software_ms`, `hardware_ms`: from trigger to frame."""

    role: Role
    verdict: TriggerVerdict
    detail: str
    software_ms: float | None = None
    hardware_ms: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerProbe:
    """What one kind of trigger did: a frame after so long, or why none came."""

    took_ms: float | None = None
    why: str = ""
    possible: bool = True
    """Whether it could be tried at all."""


def patience_ms(settings: CameraSettings) -> float:
    """Return how long a triggered frame is waited for."""
    return max(LEAST_MS, 2.0 * settings.exposure_ns / 1e6 + MARGIN_MS)


def probe_by_software(rig: AssembledRig, camera: Camera) -> TriggerProbe:
    """Let a camera wait for commands, give it one, and see what comes; the settings stay so."""
    by_hand = replace(camera.settings, exposure_auto=AutoMode.OFF)
    try:
        camera.configure(replace(by_hand, triggered=True, trigger_source=TriggerSource.SOFTWARE))
    except (OutOfRange, InvalidInput) as error:
        return TriggerProbe(why=str(error), possible=False)
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    try:
        _await_stillness(rig, camera)
        began_ns = rig.clock.now_ns()
        camera.software_trigger()
        camera.read(timeout_ms=patience_ms(camera.settings))
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    return TriggerProbe(took_ms=(rig.clock.now_ns() - began_ns) / 1e6)


def probe_by_pulse(
    rig: AssembledRig, cameras: tuple[Camera, ...], *, gaze: StereoVolts
) -> dict[Role, TriggerProbe] | None:
    """Let the eyes wait for their lines, and give them one pulse; None when no pulse could be given.

    The settings stay so.
    """
    exposure_ns = min(camera.settings.exposure_ns for camera in cameras)
    found = {camera.role: _listen(rig, camera, exposure_ns) for camera in cameras}
    began_ns = rig.clock.now_ns()
    exposure_us = exposure_ns // 1000
    pulse_us = max(1, exposure_us // 2, exposure_us - LONGEST_AFTER_PULSE_US)
    complaint = ""
    try:
        rig.mirrors.expose(gaze, settle_us=0, pulse_us=pulse_us)
    except (NotConnected, Stopped):
        return None
    except FoveaError as error:  # perhaps one strobe is missing: the frames tell more
        complaint = str(error)
    for camera in cameras:
        if not found[camera.role].why:
            found[camera.role] = _after_pulse(rig, camera, began_ns)
    if complaint and not any(probe.why for probe in found.values()):
        why = f"its frame came, but a strobe did not reach the controller ({complaint})"
        found = {role: replace(probe, why=why) for role, probe in found.items()}
    return found


def verdict_of(role: Role, software: TriggerProbe, hardware: TriggerProbe | None) -> EyeTestResult:
    """Return what both probes say together; `hardware` is None where no pulse could be given."""

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
    told = "commands expose it and pulses do not" if by_command else "pulses do not expose it"
    return found(TriggerVerdict.WIRING, f"{told}: {hardware.why}; check its trigger and strobe cables")


def put_back(cameras: Iterable[Camera], before: Mapping[Role, CameraSettings]) -> dict[Role, CameraSettings]:
    """Let every camera run as it did; return what those still need that are gone."""
    owed = {}
    for camera in cameras:
        try:
            camera.configure(before[camera.role])
        except FoveaError as error:
            _log.warning("after the trigger test: %s", error)
            owed[camera.role] = before[camera.role]
    return owed


def _listen(rig: AssembledRig, camera: Camera, exposure_ns: int) -> TriggerProbe:
    """Let a camera wait for its line; return why it does not."""
    by_hand = replace(camera.settings, exposure_ns=exposure_ns, exposure_auto=AutoMode.OFF)
    wish = replace(by_hand, triggered=True, trigger_source=TriggerSource.HARDWARE)
    try:
        camera.configure(wish)
        _await_stillness(rig, camera)
    except FoveaError as error:
        return TriggerProbe(why=str(error), possible=not isinstance(error, OutOfRange))
    return TriggerProbe()


def _after_pulse(rig: AssembledRig, camera: Camera, began_ns: int) -> TriggerProbe:
    try:
        camera.read(timeout_ms=patience_ms(camera.settings))
    except FoveaError as error:
        return TriggerProbe(why=str(error))
    return TriggerProbe(took_ms=(rig.clock.now_ns() - began_ns) / 1e6)


def _await_stillness(rig: AssembledRig, camera: Camera) -> None:
    """Read until nothing comes any more: what was under way is over."""
    until_ns = rig.clock.now_ns() + round(patience_ms(camera.settings) * 1e6)
    while rig.clock.now_ns() < until_ns:
        try:
            camera.read(timeout_ms=STILL_MS)
        except Timeout:
            return
    raise DeviceFault(
        f"camera {camera.role}: told to wait for a trigger, and it goes on delivering; check its trigger"
        " setting"
    )
