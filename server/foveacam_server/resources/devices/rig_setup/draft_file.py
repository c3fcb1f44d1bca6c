"""Reads a draft from a rig file and merges it into one; comments, order and other keys of the file stay.

Only differences of the draft from `before` are written, so that edits by hand stay as well.
"""

from collections.abc import Set
from typing import TypeVar, get_args

import tomlkit
from pydantic import BaseModel, ValidationError
from tomlkit import TOMLDocument
from tomlkit.items import AoT, Table

from foveacam_hardware.camera_config import (
    ROLES,
    AravisCameraConfig,
    OpenCvCameraConfig,
    PylonCameraConfig,
)
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig, ManualPanTiltConfig, PtuPanTiltConfig
from foveacam_server.resources.devices.rig_setup.rig_files import TomlTable
from foveacam_server.resources.devices.rig_setup.schema import (
    SIMULATED,
    DraftCamera,
    DraftCameras,
    DraftMarkers,
    DraftMirrors,
    DraftPanTilt,
    FoveaTrigger,
    RigDraft,
)

FOVEAE = ("left", "right")
BINNING = "working_binning"
CAMERAS: dict[str, type[BaseModel]] = {
    "aravis": AravisCameraConfig,
    "pylon": PylonCameraConfig,
    "opencv": OpenCvCameraConfig,
}
PAN_TILTS: dict[str, type[BaseModel]] = {
    "grbl": GrblPanTiltConfig,
    "ptu": PtuPanTiltConfig,
    "manual": ManualPanTiltConfig,
}
KEPT_BY_CAMERAS = frozenset(
    {"exposure_ms", "exposure_auto", "gain_db", "black_level", "pixel_format", "frame_rate_hz"}
    | {"frame_rate_auto", "width_px", "height_px"}
)
"""Keys of a role that stay when the kind of its camera changes; other keys are specific to the kind."""
NEW_RIG = """\
# A rig, written by the set-up page. Edit it as you like: comments and other keys stay.
format = "foveacam-rig"
version = 1
kind = "serial"
rig_id = ""
name = ""
baseline_m = 0.0  # between the mirrors, as built; a calibration measures it better

[mirrors]
port = ""
low_pass_hz = 0
settle_us = 0
pulse_us = 0
max_v = 0.0  # refused beyond; from the mirrors' own data sheet
bias_v = 0.0

# A camera is found by the serial number on its label, wherever it is plugged in.
[cameras.wide]
kind = "absent"

# Left and right must agree in all but their serial numbers: one pulse exposes both.
[cameras.left]
kind = "absent"

[cameras.right]
kind = "absent"

# What the mirrors are calibrated with: three ArUco markers (4X4_50) in one plane, one for each camera.
[markers]
side_mm = 0.0  # of the black square
spacing_mm = 0.0  # from the middle one to each of the others
wide_id = 0
left_id = 0
right_id = 0
"""
NEW_SIMULATED_RIG = """\
# A simulated rig, written by the set-up page. Edit it as you like: comments and other keys stay.
format = "foveacam-rig"
version = 1
kind = "simulated"
name = ""
"""
ModelT = TypeVar("ModelT", bound=BaseModel)


def is_simulated(draft: RigDraft) -> bool:
    """Return whether a draft has a simulated device."""
    cameras = (draft.cameras.wide, draft.cameras.left, draft.cameras.right)
    return draft.mirrors.port == SIMULATED or any(
        camera is not None and camera.kind == SIMULATED for camera in cameras
    )


def draft_of(content: TomlTable) -> RigDraft:
    """Return the draft of a rig file's content; missing or invalid values get their defaults."""
    if content.get("kind", SIMULATED) == SIMULATED:
        return _simulated_draft(content)
    cameras = _table(content, "cameras")
    head: TomlTable = {key: content[key] for key in ("rig_id", "name", BINNING) if key in content}
    if isinstance(baseline_m := content.get("baseline_m"), int | float):
        head["baseline_mm"] = round(1e3 * baseline_m, 6)
    parts = {
        "cameras": DraftCameras(**{role: _camera(_table(cameras, role)) for role in ROLES}),
        "fovea_trigger": _fovea_trigger(cameras),
        "mirrors": _valid(DraftMirrors, _table(content, "mirrors")),
        "pan_tilt": _valid(DraftPanTilt, _table(content, "pan_tilt")),
        "markers": _valid(DraftMarkers, _table(content, "markers")),
    }
    return _valid(RigDraft, head | parts) or RigDraft()


def merge_draft(text: str | None, draft: RigDraft, *, before: RigDraft | None) -> str:
    """Return a rig file's text with the draft's changes merged; `text`, `before` None: a new file."""
    kind = SIMULATED if is_simulated(draft) else "serial"
    document = None if text is None else tomlkit.parse(text)
    if document is None or document.get("kind", SIMULATED) != kind:
        document, before = tomlkit.parse(NEW_SIMULATED_RIG if kind == SIMULATED else NEW_RIG), None
    if kind == SIMULATED:
        _put(document, "name", draft.name, None if before is None else before.name)
        _merge_binning(document, draft, before)
        return tomlkit.dumps(document)
    _merge_head(document, draft, before)
    _merge_values(document, "mirrors", draft.mirrors, None if before is None else before.mirrors)
    for role in ROLES:
        old = None if before is None else getattr(before.cameras, role)
        if before is None or old != getattr(draft.cameras, role):
            _merge_camera(document, role, getattr(draft.cameras, role))
    if before is None or (before.fovea_trigger, before.cameras) != (draft.fovea_trigger, draft.cameras):
        _merge_trigger(document, draft.fovea_trigger)
    _merge_values(document, "markers", draft.markers, None if before is None else before.markers)
    if before is None or before.pan_tilt != draft.pan_tilt:
        _merge_pan_tilt(document, draft.pan_tilt, None if before is None else before.pan_tilt)
    return tomlkit.dumps(document)


def _merge_head(document: TOMLDocument, draft: RigDraft, before: RigDraft | None) -> None:
    _put(document, "rig_id", draft.rig_id, None if before is None else before.rig_id)
    _put(document, "name", draft.name, None if before is None else before.name)
    if before is None or before.baseline_mm != draft.baseline_mm:
        document["baseline_m"] = round(1e-3 * draft.baseline_mm, 9)
    _merge_binning(document, draft, before)


def _merge_binning(document: TOMLDocument, draft: RigDraft, before: RigDraft | None) -> None:
    """Write the working binning, or delete it where the default of the rig's kind is to apply."""
    if draft.working_binning == (None if before is None else before.working_binning):
        return
    head = [item for key, item in document.body if key is not None and not isinstance(item, Table | AoT)]
    if draft.working_binning is None:
        document.pop(BINNING, None)
    elif BINNING in document or not head:
        document[BINNING] = draft.working_binning
    else:  # after the last key, before the comments above the first table
        trivia = head[-1].trivia
        trivia.trail = f"{trivia.trail or chr(10)}{BINNING} = {draft.working_binning}\n"


def _merge_values(document: TOMLDocument, name: str, now: BaseModel, before: BaseModel | None) -> None:
    """Write the values of one table that differ from those before."""
    changed = {key: value for key, value in now if before is None or getattr(before, key) != value}
    if changed:
        table = document.setdefault(name, tomlkit.table())
        for key, value in changed.items():
            _set(table, key, value)


def _merge_camera(document: TOMLDocument, role: str, camera: DraftCamera | None) -> None:
    cameras = document.setdefault("cameras", tomlkit.table(is_super_table=True))
    table = cameras.get(role)
    if camera is None:
        if isinstance(table, Table) and table.get("kind") != "absent":
            cameras.pop(role)
        return
    if not isinstance(table, Table):
        table = cameras[role] = tomlkit.table()
    key, other = ("source", "serial") if camera.kind == "opencv" else ("serial", "source")
    if table.get("kind") != camera.kind:
        known = KEPT_BY_CAMERAS & CAMERAS[camera.kind].model_fields.keys()
        _drop_all_but(table, known | {"kind"})
        table["kind"] = camera.kind
    table.pop(other, None)
    if str(table.get(key)) != camera.name:
        _set(table, key, camera.name)


def _merge_trigger(document: TOMLDocument, trigger: FoveaTrigger) -> None:
    """Write the trigger of both foveae where it differs from the file's."""
    cameras = _table(document, "cameras")
    for role in FOVEAE:
        table = cameras.get(role)
        if isinstance(table, Table) and table.get("kind") in CAMERAS and _trigger_of(table) != trigger:
            _set(table, "trigger", trigger)


def _merge_pan_tilt(document: TOMLDocument, now: DraftPanTilt | None, before: DraftPanTilt | None) -> None:
    if now is None:
        document.pop("pan_tilt", None)
        return
    table = document.get("pan_tilt")
    if not isinstance(table, Table):
        document["pan_tilt"] = tomlkit.table()
        table = document["pan_tilt"]
    known = PAN_TILTS[now.kind].model_fields.keys()
    if table.get("kind") != now.kind:
        _drop_all_but(table, known)
        before = None
    old = before or DraftPanTilt(kind=now.kind)
    for key, value in now:
        if key == "kind" or (key in known and value != getattr(old, key)):
            table.pop(key, None) if value is None else _set(table, key, value)


def _set(table: Table, key: str, value: object) -> None:
    """Set a key; a new one is added after the last key, before the comments above the next table."""
    if key in table:
        table[key] = value
        return
    body = table.value.body
    own = max((place + 1 for place, (name, _) in enumerate(body) if name is not None), default=0)
    above_next = body[own:]
    del body[own:]
    table.append(key, tomlkit.item(value))
    body.extend(above_next)


def _drop_all_but(table: Table, kept: Set[str]) -> None:
    for key in [key for key in table if key not in kept]:
        table.pop(key)


def _put(document: TOMLDocument, key: str, value: object, before: object) -> None:
    if value != before:
        document[key] = value


def _simulated_draft(content: TomlTable) -> RigDraft:
    cameras = {role: DraftCamera(kind=SIMULATED, name=role) for role in ROLES}
    head = {key: content[key] for key in ("name", BINNING) if key in content}
    parts = {"cameras": DraftCameras(**cameras), "mirrors": DraftMirrors(port=SIMULATED)}
    return _valid(RigDraft, head | parts) or RigDraft()


def _camera(table: TomlTable) -> DraftCamera | None:
    kind, name = table.get("kind"), table.get("serial", table.get("source"))
    if kind not in CAMERAS or name is None or not str(name):
        return None
    return DraftCamera(kind=kind, name=str(name)[:300])


def _fovea_trigger(cameras: TomlTable) -> FoveaTrigger:
    return next((found for role in FOVEAE if (found := _trigger_of(_table(cameras, role)))), "hardware")


def _trigger_of(table: TomlTable) -> FoveaTrigger | None:
    """Return the trigger of a fovea's camera; None without a camera or for an invalid trigger."""
    if table.get("kind") not in CAMERAS:
        return None
    given = table.get("trigger", "none" if table["kind"] == "opencv" else "hardware")
    return next((trigger for trigger in get_args(FoveaTrigger) if trigger == given), None)


def _table(content: TomlTable, key: str) -> TomlTable:
    found = content.get(key)
    return found if isinstance(found, dict) else {}


def _valid(model: type[ModelT], content: TomlTable) -> ModelT | None:
    """Return the model of a table's values without the invalid ones, which the file's own check reports.

    None where a required value is missing or invalid.
    """
    given = {key: content[key] for key in model.model_fields if key in content}
    try:
        return model.model_validate(given)
    except ValidationError as error:
        wrong = {detail["loc"][0] for detail in error.errors()}
    if wrong - given.keys() or any(model.model_fields[str(key)].is_required() for key in wrong):
        return None
    return model.model_validate({key: value for key, value in given.items() if key not in wrong})
