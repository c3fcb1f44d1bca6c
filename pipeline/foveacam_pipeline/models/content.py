"""Convert a calibrated model to plain JSON values and compute its content hash."""

import dataclasses
import hashlib
import json
from typing import TypeAlias

import numpy as np

Plain: TypeAlias = dict[str, "Plain"] | list["Plain"] | str | float | int | bool | None
"""A JSON value."""

OMITTED = "omitted while None"
"""Key of the metadata of a field that was added to a model later: while None it is left out, so that earlier
calibrations keep their ids."""
ID_LENGTH = 16
"""Hexadecimal digits of the SHA-256 in a calibration's id: 64 bits, plenty for one rig's lifetime."""


def plain(value: object) -> Plain:
    """Return a frozen model, array or number as JSON values; floats are exact when printed."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if not (OMITTED in field.metadata and getattr(value, field.name) is None)
        }
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, bool | int | float | str) or value is None:
        return value
    raise TypeError(f"{type(value).__name__} has no plain form")


def content_id(content: Plain) -> str:
    """Return the id of `content`: the first digits of the SHA-256 of its canonical JSON."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:ID_LENGTH]
