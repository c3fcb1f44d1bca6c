"""The rig's own devices: each is opened once, says who it is, and is closed again."""

from foveacam_hardware.rig import Rig
from foveacam_server.doctor.findings import Finding, fine, problem


def check_devices(rig: Rig) -> list[Finding]:
    """Return a finding for each device of a rig that has tried to connect."""
    wrong = {trouble.device: trouble.detail for trouble in rig.problems}
    found = [fine("rig", f"{rig.name} ({rig.rig_id})")]
    for name, info in _infos(rig).items():
        if name in wrong:
            what, _, remedy = wrong[name].rpartition("; ")
            found.append(problem(name, what or remedy, remedy if what else ""))
        else:
            found.append(fine(name, info))
    return found


def _infos(rig: Rig) -> dict[str, str]:
    devices = {"mirrors": rig.mirrors.info}
    devices |= {str(camera.role): camera.info for camera in rig.cameras}
    for name, device in (("pan_tilt", rig.pan_tilt), ("rail", rig.rail)):
        if device is not None:
            devices[name] = device.info
    return {
        name: " ".join(part for part in (info.vendor, info.model, info.serial, info.version) if part)
        for name, info in devices.items()
    }
