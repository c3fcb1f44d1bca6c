"""One set point: a direction, and where it differs from the rest of its plan, a distance and a shift."""

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

LARGEST_DEG = 45.0
"""No rig steers so far; a rig's own reach is checked with its calibration."""
LARGEST_SHIFT_DEG = 2.0
"""Of either eye; the authors' application allows as much while it verges."""
LARGEST_DISTANCE_M = 100_000.0
INFINITY: Literal["infinity"] = "infinity"
"""How a document writes an infinite distance: both eyes look parallel. JSON has no number for it."""

AngleDeg: TypeAlias = Annotated[float, Field(ge=-LARGEST_DEG, le=LARGEST_DEG)]
ShiftDeg: TypeAlias = Annotated[float, Field(ge=-LARGEST_SHIFT_DEG, le=LARGEST_SHIFT_DEG)]
Distance: TypeAlias = Annotated[float, Field(gt=0.0, le=LARGEST_DISTANCE_M)] | Literal["infinity"]
"""Metres from the rig's origin, or "infinity"."""


class PlanModel(BaseModel):
    """Root of a plan's parts: unknown keys, NaN and text for numbers are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class SetPoint(PlanModel):
    """Where both eyes look; degrees of the rig frame, `ax_deg` > 0 to the right, `ay_deg` > 0 down."""

    ax_deg: AngleDeg
    ay_deg: AngleDeg
    distance_m: Distance | None = None
    """Where the eyes meet; None: at the plan's distance."""
    shift_deg: ShiftDeg = 0.0
    """The left eye looks so much lower than the target, the right eye so much higher."""


def metres(distance: float | Literal["infinity"]) -> float:
    """Return a document's distance as a number, m; infinity is `math.inf`."""
    return math.inf if distance == INFINITY else float(distance)


def distance_of(distance_m: float) -> float | Literal["infinity"]:
    """Return a distance, m, as a document writes it."""
    return INFINITY if distance_m == math.inf else distance_m
