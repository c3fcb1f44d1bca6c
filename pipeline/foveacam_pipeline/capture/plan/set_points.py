"""Set points and their text form: one a line, `#` comments, `@` commands. Manual: `pipeline/CAPTURE.md`.

The language is that of the authors' application. What that application ignores (a word that is no number, a
selection that selects nothing) is refused here, with the line and the word.
"""

import math
import re
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan.set_point_commands import (
    COMMANDS,
    MOST_SET_POINTS,
    SetPointRow,
    line_error,
    parse_number,
)

LARGEST_DEG = 45.0
"""Limit of directions, beyond the reach of every rig; a rig's own reach is checked with its calibration."""
LARGEST_SHIFT_DEG = 2.0
"""Limit for either eye; the authors' application allows as much while it verges."""
LARGEST_DISTANCE_M = 100_000.0
INFINITY: Literal["infinity"] = "infinity"
"""How a document writes an infinite distance, with both eyes parallel: JSON has no number for it."""
LONGEST_TEXT = 1_000_000
INFINITIES = ("inf", "infinity", "∞")
OMITTED = "-"
_LINE = "a line is `x deg, y deg`, then if wanted `distance m` (a number, `inf` or `-`), then `shift deg`"

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
    """Vertical shift: the left eye looks this much lower than the target, the right eye this much higher."""


def metres(distance: float | Literal["infinity"]) -> float:
    """Return a document's distance as a number, m; infinity is `math.inf`."""
    return math.inf if distance == INFINITY else float(distance)


def document_distance(distance_m: float) -> float | Literal["infinity"]:
    """Return a distance, m, as a document writes it."""
    return INFINITY if distance_m == math.inf else distance_m


def parse_set_points(text: str) -> tuple[SetPoint, ...]:
    """Return the points of a text, in order; raise InvalidInput naming line, word and what is allowed."""
    if len(text) > LONGEST_TEXT:
        raise InvalidInput(
            f"set points: the text has {len(text)} characters, at most {LONGEST_TEXT} are read; split it"
        )
    rows: list[SetPointRow] = []
    for line, written in enumerate(text.splitlines(), start=1):
        words = written.split("#", maxsplit=1)[0].strip()
        if words.startswith("@"):
            rows = _command(rows, words, line)
        elif words:
            rows.append(_row(words, line))
        if len(rows) > MOST_SET_POINTS:
            raise line_error(line, f"there are more than {MOST_SET_POINTS} points", "take fewer")
    if not rows:
        raise InvalidInput(
            "set points: there is no point in the text; write at least one line `x deg, y deg`"
        )
    return tuple(_point(row) for row in rows)


def _command(rows: list[SetPointRow], words: str, line: int) -> list[SetPointRow]:
    name, *operands = words[1:].split() or [""]
    command = COMMANDS.get(name)
    if command is None:
        raise line_error(line, f"`@{name}` is no command", f"commands are @{', @'.join(COMMANDS)}")
    return command(rows, operands, line)


def _row(words: str, line: int) -> SetPointRow:
    values = re.split(r"\s*,\s*|\s+", words)
    if not 2 <= len(values) <= 4:
        raise line_error(line, f"`{words}` has {len(values)} value{'s' * (len(values) != 1)}", _LINE)
    ax_deg, ay_deg = (parse_number(value, line, allowed=_LINE) for value in values[:2])
    return SetPointRow(
        ax_deg=ax_deg,
        ay_deg=ay_deg,
        distance_m=_distance(values[2], line) if len(values) > 2 else None,
        shift_deg=parse_number(values[3], line, allowed=_LINE) if len(values) > 3 else 0.0,
        line=line,
    )


def _distance(word: str, line: int) -> float | None:
    if word == OMITTED:
        return None
    return float("inf") if word.lower() in INFINITIES else parse_number(word, line, allowed=_LINE)


def _point(row: SetPointRow) -> SetPoint:
    for name, value_deg, largest_deg in (
        ("x", row.ax_deg, LARGEST_DEG),
        ("y", row.ay_deg, LARGEST_DEG),
        ("shift", row.shift_deg, LARGEST_SHIFT_DEG),
    ):
        if not abs(value_deg) <= largest_deg:
            raise line_error(
                row.line, f"{name} is {value_deg:g}° in the end", f"±{largest_deg:g}° is allowed"
            )
    distance_m = row.distance_m
    if distance_m is not None and not (0.0 < distance_m <= LARGEST_DISTANCE_M or distance_m == float("inf")):
        allowed = f"above 0 and up to {LARGEST_DISTANCE_M:g} m, `inf` or `-` are allowed"
        raise line_error(row.line, f"the distance is {distance_m:g} m in the end", allowed)
    return SetPoint(
        ax_deg=row.ax_deg,
        ay_deg=row.ay_deg,
        distance_m=None if distance_m is None else document_distance(distance_m),
        shift_deg=row.shift_deg,
    )
