"""Documents of stills, for REST and the command line."""

import math
from collections.abc import Mapping, Sequence

from pydantic import JsonValue

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.values import FrameRecord
from foveacam_server.foundation.store import Document
from foveacam_server.resources.stills.collection import URL, StoredStill

UNCALIBRATED = (
    "the rig was not calibrated: pictures and volts are kept, no angles, and no pair can be rectified"
)
_CAMERAS = (Role.WIDE, Role.LEFT, Role.RIGHT)


def still_document(found: StoredStill) -> Document:
    """Return a still as a document; a damaged one has no cameras and says why."""
    stored, dataset = found.stored, found.stored.dataset
    document: Document = {
        "id": stored.id,
        "name": stored.name,
        "state": found.state.value,
        "trouble": stored.trouble,
        "folder": str(stored.folder.resolve()),
        "url": f"{URL}/{stored.id}",
    }
    return document | (_nothing() if dataset is None else _content(dataset))


def _nothing() -> Document:
    return {
        "label": "",
        "licence": "",
        "created_utc": None,
        "codec": None,
        "rig_id": None,
        "calibration_id": None,
        "stack_frames": 0,
        "stack_keep": "mean",
        "cameras": [],
        "distance_m": None,
        "rail_mm": None,
        "pan_deg": None,
        "tilt_deg": None,
        "size_bytes": 0,
        "warnings": [],
    }


def _content(dataset: Dataset) -> Document:
    header = dataset.document.header
    frames = [frame for point in dataset for frame in point.frames]
    place = dataset[0].place if len(dataset) else None
    rail_m = None if place is None else place.rail_m
    return {
        "label": header.label,
        "licence": header.licence,
        "created_utc": header.created_utc,
        "codec": header.codec.value,
        "rig_id": header.rig.get("rig_id"),
        "calibration_id": None if header.calibration is None else header.calibration.id,
        "stack_frames": header.plan.get("frames"),
        "stack_keep": header.plan.get("keep"),
        "cameras": _cameras(header.conditions, header.plan, frames),
        "distance_m": None if place is None else place.distance_m,
        "rail_mm": None if rail_m is None else 1e3 * rail_m,
        "pan_deg": None if place is None else _deg(place.pan_rad),
        "tilt_deg": None if place is None else _deg(place.tilt_rad),
        "size_bytes": sum(frame.size_bytes for frame in frames),
        "warnings": [UNCALIBRATED] if header.calibration is None else [],
    }


def _cameras(
    conditions: Mapping[str, JsonValue], plan: Mapping[str, JsonValue], frames: Sequence[FrameRecord]
) -> list[Document]:
    """Return a document for every requested camera, with its files and what is missing."""
    exposures, missing = (
        _rows(conditions, "exposures"),
        {row["role"]: row for row in _rows(conditions, "missing")},
    )
    asked = plan.get("roles")
    wanted = asked if isinstance(asked, list) else [frame.role.value for frame in frames]
    return [
        _camera(
            role,
            plan.get("frames"),
            [frame for frame in frames if frame.role is role],
            [row for row in exposures if row["role"] == role.value],
            missing.get(role.value, {}),
        )
        for role in _CAMERAS
        if role.value in wanted
    ]


def _camera(
    role: Role,
    asked: object,
    files: Sequence[FrameRecord],
    exposures: Sequence[Document],
    missing: Document,
) -> Document:
    first = files[0] if files else None
    volts = None if first is None else first.volts_v
    gaze = None if first is None else first.gaze_rad
    return {
        "camera": role.value,
        "asked": asked,
        "came": len(exposures),
        "files": len(files),
        "width": 0 if first is None else first.width,
        "height": 0 if first is None else first.height,
        "channels": 0 if first is None else first.channels,
        "bits": 0 if first is None else first.bits,
        "exposure_ms": None if first is None else first.exposure_ns / 1e6,
        "gain_db": exposures[0]["gain_db"] if exposures else None,
        "first_t_ns": exposures[0]["t_ns"] if exposures else None,
        "last_t_ns": exposures[-1]["t_ns"] if exposures else None,
        "x_v": None if volts is None else volts[0],
        "y_v": None if volts is None else volts[1],
        "ax_deg": None if gaze is None else math.degrees(gaze[0]),
        "ay_deg": None if gaze is None else math.degrees(gaze[1]),
        "detail": missing.get("detail", ""),
        "remedy": missing.get("remedy", ""),
    }


def _rows(conditions: Mapping[str, JsonValue], name: str) -> list[Document]:
    rows = conditions.get(name)
    return [row for row in rows if isinstance(row, dict)] if isinstance(rows, list) else []


def _deg(angle_rad: float | None) -> float | None:
    return None if angle_rad is None else math.degrees(angle_rad)
