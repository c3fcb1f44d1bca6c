"""Bounded types for the numbers of requests, one per quantity; rounding of those of answers.

The bounds only keep arithmetic finite and messages short: they are wider than any rig's. Limits of a rig, or
of the cost of a request, are checked by its service.
"""

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

Pixels: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
"""A place or a length in an image."""
Degrees: TypeAlias = Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)]
"""A direction or a bearing; a pan-tilt may turn a whole circle either way."""
Metres: TypeAlias = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
"""A length or a distance; anything farther is effectively at infinity."""
DistanceM: TypeAlias = Annotated[float, Field(gt=0.0, le=1e6, allow_inf_nan=False)]
"""A distance from the rig."""
MapMetres: TypeAlias = Annotated[float, Field(ge=-1e7, le=1e7, allow_inf_nan=False)]
"""A coordinate of a map: a quarter of the earth either way."""
Volts: TypeAlias = Annotated[float, Field(ge=-1000.0, le=1000.0, allow_inf_nan=False)]
"""A differential drive of a mirror."""
Millimetres: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
"""A place on a rail: a kilometre either way."""
Seconds: TypeAlias = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
"""A moment of a recording: eleven days."""
ExposureMs: TypeAlias = Annotated[float, Field(ge=0.0, le=3.6e6, allow_inf_nan=False)]
"""A camera's exposure: an hour."""
Decibels: TypeAlias = Annotated[float, Field(ge=-1000.0, le=1000.0, allow_inf_nan=False)]
"""A camera's gain, also one that a driver counts in units of its own."""
BlackLevel: TypeAlias = Annotated[float, Field(ge=-65536.0, le=65536.0, allow_inf_nan=False)]
"""A camera's black level: all that 16 bits hold."""
Hertz: TypeAlias = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
"""A frame rate."""
Index: TypeAlias = Annotated[int, Field(ge=0, le=1_000_000)]
"""An index in a list, counted from 0."""
Bracket: TypeAlias = Annotated[int, Field(ge=0, le=99)]
"""The index of an exposure in a bracket, counted from 0."""

Label = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A name for people: no control characters."""
Text = Annotated[str, Field(max_length=400, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""One line for people: no control characters."""
CodecName = Literal["tiff", "png"]
"""How the images of a dataset are stored."""


def deg(angle_rad: float) -> float:
    """Return degrees to 1e-5 (a fortieth of a fovea pixel)."""
    return round(math.degrees(angle_rad), 5)


def rounded(value: float | None, digits: int) -> float | None:
    """Return `value` rounded to so many decimals; None for None, NaN or infinity, which JSON cannot carry."""
    return None if value is None or not math.isfinite(value) else round(value, digits)
