"""Checks the rig's own devices: each is opened once and identified; on request, the trigger wiring.

The trigger test keeps the mirrors parked and gives one pulse, which must expose both foveae. A camera that
answers a command but no pulse has a faulty wire; one that answers neither is itself faulty.
"""

from contextlib import suppress
from dataclasses import replace

from foveacam_hardware.contract import PARKED, Camera, CameraSettings, FoveaError, Role, TriggerSource
from foveacam_hardware.rig import Rig
from foveacam_server.checks.findings import Finding, fine, problem

TIMEOUT_MS = 2000.0
PULSE = "trigger_pulse"


def check_devices(rig: Rig) -> list[Finding]:
    """Return a finding for each device of a rig that has tried to connect."""
    wrong = {trouble.device: trouble.detail for trouble in rig.problems}
    found = [fine("rig", f"{rig.name} ({rig.rig_id})")]
    for name, info in _device_infos(rig).items():
        if name in wrong:
            what, _, remedy = wrong[name].rpartition("; ")
            found.append(problem(name, what or remedy, remedy if what else ""))
        else:
            found.append(fine(name, info))
    return found


def _device_infos(rig: Rig) -> dict[str, str]:
    devices = {"mirrors": rig.mirrors.info}
    devices |= {str(camera.role): camera.info for camera in rig.cameras}
    for name, device in (("pan_tilt", rig.pan_tilt), ("rail", rig.rail)):
        if device is not None:
            devices[name] = device.info
    return {
        name: " ".join(part for part in (info.vendor, info.model, info.serial, info.version) if part)
        for name, info in devices.items()
    }


def check_trigger(rig: Rig) -> list[Finding]:
    """Expose both foveae by one pulse; when that fails, each by a command."""
    try:
        rig.mirrors.enable()
        rig.head.look(PARKED)
    except FoveaError as failure:
        pulse = problem(PULSE, str(failure), "see the verdict on each camera below")
        return [pulse, *(_verdict(rig.camera(role)) for role in (Role.LEFT, Role.RIGHT))]
    finally:
        _disable(rig)
    return [fine(PULSE, "one pulse exposed both foveae, and both reported it")]


def _verdict(camera: Camera) -> Finding:
    """Return the verdict on a camera: its wires are faulty if it exposes on command, else itself."""
    name, before = f"trigger_{camera.role}", camera.settings
    try:
        camera.configure(replace(before, triggered=True, trigger_source=TriggerSource.SOFTWARE))
        camera.software_trigger()
        camera.read(timeout_ms=TIMEOUT_MS)
    except FoveaError as failure:
        return problem(
            name,
            f"camera: it does not expose on command either ({failure})",
            "look at the camera first, not at the wires",
        )
    finally:
        _restore(camera, before)
    return problem(
        name,
        "wiring: it exposes on command, so a wire is at fault if a pulse does not expose it or no strobe"
        " arrives",
        "check the pulse's wire to its trigger_line, the strobe's from its strobe_line to the controller,"
        " both grounds, and both names in the rig file",
    )


def _restore(camera: Camera, before: CameraSettings) -> None:
    with suppress(FoveaError):  # it has been reported already
        camera.configure(before)


def _disable(rig: Rig) -> None:
    with suppress(FoveaError):
        rig.mirrors.disable()
