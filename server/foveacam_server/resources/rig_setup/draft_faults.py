"""What is wrong with a draft, field by field, as `foveacam serve --rig` would refuse its file."""

from foveacam_hardware.camera_config import ROLES
from foveacam_hardware.rig_config import rig_faults
from foveacam_server.resources.rig_setup.draft_file import is_simulated
from foveacam_server.resources.rig_setup.rig_files import TomlTable
from foveacam_server.resources.rig_setup.schema import SIMULATED, DraftFault, RigDraft

CAMERA_KEYS = frozenset({"kind", "serial", "source"})
"""Keys of a camera's table that the draft's choice of a camera stands for."""


def faults_of(draft: RigDraft, content: TomlTable) -> list[DraftFault]:
    """Return the faults of a draft whose file would have this content."""
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
    """Return the faults of a draft that has simulated devices: all are, and each in its own place."""
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
