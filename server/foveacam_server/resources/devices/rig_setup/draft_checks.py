"""Checks a draft of a rig file: findings of the doctor, and faults field by field."""

from collections.abc import Sequence

from foveacam_hardware.camera_config import ROLES
from foveacam_hardware.rig_config import rig_faults
from foveacam_server.checks import buses, ports
from foveacam_server.checks.cameras import check_named, look_for_cameras
from foveacam_server.checks.chosen_ports import chosen_ports
from foveacam_server.checks.findings import Finding, Severity
from foveacam_server.checks.needs import NamedCamera, RigNeeds
from foveacam_server.resources.devices.rig_setup.draft_file import is_simulated
from foveacam_server.resources.devices.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.devices.rig_setup.rig_files import TomlTable
from foveacam_server.resources.devices.rig_setup.schema import SIMULATED, AdviceDocument, DraftFault, RigDraft

FIELDS = {
    "camera_wide": "cameras.wide",
    "camera_left": "cameras.left",
    "camera_right": "cameras.right",
    "serial_permission": "mirrors.port",
    "held_devices": "mirrors.port",
    "ftdi_latency": "mirrors.port",
}
"""The draft's field of each finding; all other findings belong to the cameras as a whole."""
CAMERAS = "cameras"
CAMERA_KEYS = frozenset({"kind", "serial", "source"})
"""Keys of a camera's table that belong to the draft's choice of a camera."""


def needs_of_draft(draft: RigDraft) -> RigNeeds:
    """Return what the devices of a draft require of the machine; simulated ones require nothing."""
    chosen = [(role, getattr(draft.cameras, role)) for role in ROLES]
    cameras = tuple(
        NamedCamera(role=role, kind=camera.kind, wanted=camera.name)
        for role, camera in chosen
        if camera is not None and camera.kind != SIMULATED
    )
    named = {"mirrors": draft.mirrors.port, "pan_tilt": "" if draft.pan_tilt is None else draft.pan_tilt.port}
    used = {use: port for use, port in named.items() if port not in ("", SIMULATED)}
    return RigNeeds(simulated=False, cameras=cameras, ports=used)


def advice_on(draft: RigDraft, search: DeviceSearch, *, ours: bool) -> list[AdviceDocument]:
    """Run the checks of a draft's devices, with the cameras of the last search.

    `ours`: whether this server itself has the draft's devices open, which is then no problem.
    """
    machine, needs = search.machine, needs_of_draft(draft)
    cameras, searched = look_for_cameras(search.remembered(), needs)
    findings: Sequence[Finding] = [
        *check_named(cameras, needs),
        ports.check_port_permission(machine, needs),
        *([] if ours else [ports.check_holders(machine, needs)]),
        ports.check_latency(machine, needs),
        buses.check_usb_permission(machine),
        buses.check_usbfs(machine, needs),
        buses.check_receive_buffer(machine, needs),
        buses.check_mtu(machine, cameras),
        *searched,
    ]
    missing = [
        AdviceDocument(
            field=f"{port.use}.port",
            name="serial_ports",
            level="problem",
            found=port.problem,
            remedy=port.remedy,
        )
        for port in chosen_ports(machine, needs)
        if port.problem
    ]
    return missing + [_document(finding) for finding in findings if _counts(finding)]


def _counts(finding: Finding) -> bool:
    """Return whether to report a finding: good ones are reported of the chosen cameras only."""
    return finding.level is not Severity.OK or finding.name.removeprefix("camera_") in ROLES


def _document(finding: Finding) -> AdviceDocument:
    return AdviceDocument(
        field=FIELDS.get(finding.name, CAMERAS),
        name=finding.name,
        level=finding.level.value,
        found=finding.found,
        remedy=finding.remedy,
    )


def faults_of(draft: RigDraft, content: TomlTable) -> list[DraftFault]:
    """Return the faults of a draft; `content`: that of the rig file that it would make."""
    found = [DraftFault(field=_field(fault.key), message=fault.message) for fault in rig_faults(content)]
    return [*_mixed(draft), *found] if is_simulated(draft) else found


def _field(key: str) -> str:
    """Return the draft's field of a file's key; the key itself where the draft has none."""
    if key == "baseline_m":
        return "baseline_mm"
    table, _, rest = key.partition(".")
    role, _, last = rest.partition(".")
    if table == "cameras" and role in ROLES and last == "trigger":
        return "fovea_trigger"
    if table == "cameras" and role in ROLES and (not last or last in CAMERA_KEYS):
        return f"cameras.{role}"
    return key


def _mixed(draft: RigDraft) -> list[DraftFault]:
    """Return the faults of a simulated draft: all devices must be simulated, each in its own role."""
    faults = []
    if draft.mirrors.port != SIMULATED:
        faults.append(
            DraftFault(
                field="mirrors.port",
                message="simulated cameras look into simulated mirrors; choose the simulated controller, or"
                " other cameras",
            )
        )
    for role in ROLES:
        camera = getattr(draft.cameras, role)
        if camera is None or camera.kind != SIMULATED:
            message = "this rig is simulated, and its cameras belong together; choose the simulated one"
        elif camera.name != role:
            twice = getattr(draft.cameras, camera.name, None) == camera
            message = (
                f"the simulated {camera.name} camera is claimed by {camera.name} and by {role}; one camera is"
                f" one eye: give {role} its own"
                if twice
                else f"this is the simulated {camera.name} camera; give {role} its own"
            )
        else:
            continue
        faults.append(DraftFault(field=f"cameras.{role}", message=message))
    return faults
