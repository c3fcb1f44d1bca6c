"""Telemetry and descriptor messages of a recording: JSON with the names that the authors use."""

import json
import math
from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts
from foveacam_pipeline.capture.recording.values import NO_POSE, FramePose, RawFrame, TrackedBox

TELEMETRY_JSON_SCHEMA = {
    "type": "object",
    "required": ["stream", "seq", "t"],
    "properties": {
        "stream": {"type": "string"},
        "seq": {"type": "integer"},
        "t": {"type": "number", "description": "seconds, monotonic"},
    },
}
RAW_JSON_SCHEMA = {
    "type": "object",
    "description": "payload: pixels as on the wire; their format is in the channel's metadata",
}
DESCRIPTOR_JSON_SCHEMA = {
    "type": "object",
    "required": ["tNs", "bbox", "frames"],
    "properties": {"tNs": {"type": ["number", "string"]}, "frames": {"type": "object"}},
}


def telemetry_message(stream: str, frame: RawFrame) -> bytes:
    """Return the telemetry message that precedes a frame."""
    pose = frame.pose
    message_json: dict[str, object] = {"stream": stream, "seq": frame.seq, "t": frame.t_ns / 1e9}
    if pose.frame_id is not None:
        message_json["frame_id"] = pose.frame_id
    if pose.volts is not None:
        message_json["volt"] = {"x": pose.volts.x_v, "y": pose.volts.y_v}
        message_json["volt.unit"] = "volt"
        message_json["volt.source"] = pose.volts_source or "live-snapshot"
    if pose.angles_rad is not None:
        message_json["angle"] = {"x": pose.angles_rad[0], "y": pose.angles_rad[1]}
        message_json["angle.unit"] = "radian"
    if pose.wide_from_fovea is not None:
        message_json["affine"] = pose.wide_from_fovea.reshape(-1).tolist()
    if pose.exposure_ns is not None:
        message_json["exposure_ns"] = pose.exposure_ns
    return json.dumps(message_json, separators=(",", ":")).encode()


def parse_message(message: bytes) -> dict[str, Any] | None:  # Any: JSON that may come from any program
    """Return the content of a telemetry message; None when it cannot be read."""
    try:
        message_json = json.loads(message)
    except ValueError:
        return None
    return message_json if isinstance(message_json, dict) else None


def telemetry_pose(message_json: Mapping[str, Any] | None) -> FramePose:  # Any: as above
    """Return the pose that telemetry states; missing or non-numeric values are None."""
    if message_json is None:
        return NO_POSE
    volts, angles = _pair(message_json.get("volt")), _pair(message_json.get("angle"))
    if angles is not None and str(message_json.get("angle.unit", "radian")).startswith("deg"):
        angles = math.radians(angles[0]), math.radians(angles[1])
    frame_id, exposure_ns = message_json.get("frame_id"), message_json.get("exposure_ns")
    source = message_json.get("volt.source")
    return FramePose(
        frame_id=int(frame_id) if _is_number(frame_id) else None,
        volts=None if volts is None else MirrorVolts(x_v=volts[0], y_v=volts[1]),
        volts_source=source if isinstance(source, str) else None,
        angles_rad=angles,
        wide_from_fovea=_matrix(message_json.get("affine")),
        exposure_ns=int(exposure_ns) if _is_number(exposure_ns) else None,
    )


def descriptor_message(descriptor: TrackedBox) -> bytes:
    """Return the message of one tracked box."""
    box = descriptor.bbox_px
    message_json = {
        "tNs": descriptor.t_ns,
        "bbox": None if box is None else dict(zip(("x", "y", "width", "height"), box, strict=True)),
        "frames": dict(descriptor.frames),
    }
    return json.dumps(message_json, separators=(",", ":")).encode()


def parse_descriptor(slot: str, message: bytes, *, t_ns: int) -> TrackedBox | None:
    """Return the tracked box of a message of time `t_ns`; None when it cannot be read."""
    message_json = parse_message(message)
    if message_json is None:
        return None
    frames = message_json.get("frames")
    found = {
        str(stream): int(seq) if _is_number(seq) else None
        for stream, seq in (frames.items() if isinstance(frames, dict) else ())
    }
    return TrackedBox(slot=slot, t_ns=t_ns, bbox_px=_box(message_json.get("bbox")), frames=found)


def _box(found: object) -> tuple[float, float, float, float] | None:
    if isinstance(found, dict):
        found = [
            found.get("x"),
            found.get("y"),
            found.get("width", found.get("w")),
            found.get("height", found.get("h")),
        ]
    if isinstance(found, list) and len(found) == 4 and all(_is_number(side) for side in found):
        x, y, width, height = (float(side) for side in found)
        return x, y, width, height
    return None


def _pair(found: object) -> tuple[float, float] | None:
    if not isinstance(found, dict):
        return None
    x, y = found.get("x"), found.get("y")
    return (float(x), float(y)) if _is_number(x) and _is_number(y) else None


def _matrix(found: object) -> NDArray[np.float64] | None:
    if not (isinstance(found, list) and len(found) == 9 and all(_is_number(entry) for entry in found)):
        return None
    return np.array(found, dtype=np.float64).reshape(3, 3)


def _is_number(found: object) -> TypeGuard[int | float]:
    return isinstance(found, int | float) and not isinstance(found, bool) and math.isfinite(found)
