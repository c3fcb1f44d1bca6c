"""Set points as text: one a line, `#` comments, `@` commands; and back. `pipeline/CAPTURE.md` is its manual.

The language is that of the authors' application. What theirs passes over in silence (a word that is no
number, a selection that selects nothing) is refused here, with the line and the word.
"""

import re
from collections.abc import Sequence

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan.set_point import (
    INFINITY,
    LARGEST_DEG,
    LARGEST_DISTANCE_M,
    LARGEST_SHIFT_DEG,
    SetPoint,
    distance_of,
    metres,
)
from foveacam_pipeline.capture.plan.set_point_commands import (
    COMMANDS,
    MOST_SET_POINTS,
    SetPointRow,
    number,
    refusal,
)

LONGEST_TEXT = 1_000_000
INFINITIES = ("inf", "infinity", "∞")
OMITTED = "-"
_LINE = "a line is `x deg, y deg`, then if wanted `distance m` (a number, `inf` or `-`), then `shift deg`"


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
            raise refusal(line, f"there are more than {MOST_SET_POINTS} points", "take fewer")
    if not rows:
        raise InvalidInput(
            "set points: there is no point in the text; write at least one line `x deg, y deg`"
        )
    return tuple(_point(row) for row in rows)


def format_set_points(points: Sequence[SetPoint]) -> str:
    """Return the points as text, one a line; parsing it gives the same points to the last bit."""
    return "".join(f"{', '.join(_words(point))}\n" for point in points)


def _words(point: SetPoint) -> list[str]:
    words = [repr(point.ax_deg), repr(point.ay_deg)]
    if point.distance_m is not None:
        words.append("inf" if point.distance_m == INFINITY else repr(metres(point.distance_m)))
    if point.shift_deg != 0.0:
        words += [*([OMITTED] if point.distance_m is None else []), repr(point.shift_deg)]
    return words


def _command(rows: list[SetPointRow], words: str, line: int) -> list[SetPointRow]:
    name, *operands = words[1:].split() or [""]
    command = COMMANDS.get(name)
    if command is None:
        raise refusal(line, f"`@{name}` is no command", f"commands are @{', @'.join(COMMANDS)}")
    return command(rows, operands, line)


def _row(words: str, line: int) -> SetPointRow:
    values = re.split(r"\s*,\s*|\s+", words)
    if not 2 <= len(values) <= 4:
        raise refusal(line, f"`{words}` has {len(values)} value{'s' * (len(values) != 1)}", _LINE)
    ax_deg, ay_deg = (number(value, line, allowed=_LINE) for value in values[:2])
    return SetPointRow(
        ax_deg=ax_deg,
        ay_deg=ay_deg,
        distance_m=_distance(values[2], line) if len(values) > 2 else None,
        shift_deg=number(values[3], line, allowed=_LINE) if len(values) > 3 else 0.0,
        line=line,
    )


def _distance(word: str, line: int) -> float | None:
    if word == OMITTED:
        return None
    return float("inf") if word.lower() in INFINITIES else number(word, line, allowed=_LINE)


def _point(row: SetPointRow) -> SetPoint:
    for name, value_deg, largest_deg in (
        ("x", row.ax_deg, LARGEST_DEG),
        ("y", row.ay_deg, LARGEST_DEG),
        ("shift", row.shift_deg, LARGEST_SHIFT_DEG),
    ):
        if not abs(value_deg) <= largest_deg:
            raise refusal(row.line, f"{name} is {value_deg:g}° in the end", f"±{largest_deg:g}° is allowed")
    distance_m = row.distance_m
    if distance_m is not None and not (0.0 < distance_m <= LARGEST_DISTANCE_M or distance_m == float("inf")):
        allowed = f"above 0 and up to {LARGEST_DISTANCE_M:g} m, `inf` or `-` are allowed"
        raise refusal(row.line, f"the distance is {distance_m:g} m in the end", allowed)
    return SetPoint(
        ax_deg=row.ax_deg,
        ay_deg=row.ay_deg,
        distance_m=None if distance_m is None else distance_of(distance_m),
        shift_deg=row.shift_deg,
    )
