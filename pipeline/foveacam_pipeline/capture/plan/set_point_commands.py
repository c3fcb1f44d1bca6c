"""The `@` commands of the set-point language: each makes a new list of rows from all rows above its line."""

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from foveacam_hardware.contract import InvalidInput

MOST_SET_POINTS = 10_000
ZIGZAG = "zigzag"
REST = "..."
UNCHANGED = "-"
COLUMNS = ("x", "y", "distance", "shift")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_PART = re.compile(r"(-?\d{1,9})|(-?\d{1,9})?:(-?\d{1,9})?", re.ASCII)
_MOST_AXES = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPointRow:
    """A point during parsing, with the line that made it; its limits are checked after the last line."""

    ax_deg: float
    ay_deg: float
    distance_m: float | None
    shift_deg: float
    line: int

    @property
    def values(self) -> tuple[float, float, float | None, float]:
        """Its four columns."""
        return self.ax_deg, self.ay_deg, self.distance_m, self.shift_deg


Command: TypeAlias = Callable[[list[SetPointRow], list[str], int], list[SetPointRow]]
Operation: TypeAlias = Callable[[float, float], float]


def line_error(line: int, found: str, allowed: str) -> InvalidInput:
    """Return the error of one line: what was found, and what is allowed."""
    return InvalidInput(f"set points, line {line}: {found}; {allowed}")


def parse_number(word: str, line: int, *, allowed: str) -> float:
    """Return a word as a finite number."""
    value = float(word) if _NUMBER.fullmatch(word) else math.nan
    if not math.isfinite(value):
        raise line_error(line, f"`{word}` is no number", allowed)
    return value


def _row(values: Sequence[float | None], line: int) -> SetPointRow:
    ax_deg, ay_deg, distance_m, shift_deg = values
    return SetPointRow(
        ax_deg=ax_deg or 0.0,
        ay_deg=ay_deg or 0.0,
        distance_m=distance_m,
        shift_deg=shift_deg or 0.0,
        line=line,
    )


def _arithmetic(name: str, operation: Operation, neutral: float) -> Command:
    allowed = (
        f"`@{name}` takes one to four numbers (x, y, distance, shift), `-` for a column that stays, and `...`"
        " at the end for the first number in the columns that follow"
    )

    def command(rows: list[SetPointRow], words: list[str], line: int) -> list[SetPointRow]:
        rest = words[-1:] == [REST]
        words = [word.removesuffix(",") for word in (words[:-1] if rest else words)]
        if not 1 <= len(words) <= len(COLUMNS) - rest:
            raise line_error(line, f"`@{name}` has {len(words)} numbers", allowed)
        operands = [
            None if word == UNCHANGED else parse_number(word, line, allowed=allowed) for word in words
        ]
        if name == "div" and 0.0 in operands:
            raise line_error(line, "`0` is divided by", "divide by another number")
        following = operands[0] if rest else None
        operands += [following] * (len(COLUMNS) - len(operands))
        return [_changed(row, operands, line, stated=len(words)) for row in rows]

    def _changed(row: SetPointRow, operands: list[float | None], line: int, *, stated: int) -> SetPointRow:
        changed: list[float | None] = []
        for column, (value, operand) in enumerate(zip(row.values, operands, strict=True)):
            if operand is None or operand == neutral:
                changed.append(value)
            elif value is None:
                if column < stated:
                    found = f"`@{name}` changes the distance, but the point of line {row.line} has none"
                    raise line_error(line, found, "give that point a distance, or write `-` for the column")
                changed.append(None)
            else:
                result = operation(value, operand)
                if math.isinf(result) and not math.isinf(value):
                    raise line_error(line, f"`@{name}` leaves the range of numbers", "use smaller ones")
                changed.append(result)
        return _row(changed, row.line)

    return command


def _delete(rows: list[SetPointRow], words: list[str], line: int) -> list[SetPointRow]:
    allowed = "`@delete` takes points counted from 0 as in `3`, `0:5`, `-2:`, `:` (all) or `0,4:6`"
    if len(words) != 1:
        raise line_error(line, f"`@delete` has {len(words)} selections", allowed)
    gone: set[int] = set()
    for part in words[0].split(","):
        chosen = _PART.fullmatch(part)
        if chosen is None:
            raise line_error(line, f"`{part}` is no selection", allowed)
        if chosen[1] is None:
            first, last = (int(end) if end else None for end in (chosen[2], chosen[3]))
            gone.update(range(len(rows))[first:last])
            continue
        index = int(chosen[1])
        if not -len(rows) <= index < len(rows):
            raise line_error(line, f"there is no point `{index}`", f"there are {len(rows)}, counted from 0")
        gone.add(index % len(rows))
    return [row for k, row in enumerate(rows) if k not in gone]


def _reverse(rows: list[SetPointRow], words: list[str], line: int) -> list[SetPointRow]:
    if words:
        raise line_error(line, f"`@reverse` is followed by `{words[0]}`", "it stands alone")
    return rows[::-1]


def _interpolate(rows: list[SetPointRow], words: list[str], line: int) -> list[SetPointRow]:
    zigzag = words[-1:] == [ZIGZAG]
    counts = _counts(words[:-1] if zigzag else words, line)
    corners = 2 ** len(counts)
    if len(rows) < corners:
        allowed = f"{len(counts)} numbers take the last {corners} points as corners"
        raise line_error(line, f"there are {len(rows)} points above", allowed)
    kept, last = rows[:-corners], rows[-corners:]
    _check_distances(last, line)
    if len(kept) + math.prod(counts) > MOST_SET_POINTS:
        raise line_error(
            line, f"it makes {math.prod(counts)} points", f"at most {MOST_SET_POINTS} are allowed"
        )
    return kept + [replace(_between(last, weights), line=line) for weights in _weights(counts, zigzag=zigzag)]


def _counts(words: list[str], line: int) -> list[int]:
    allowed = "`@interpolate` takes whole numbers of points from 1, one an axis, and `zigzag` at the end"
    if not 1 <= len(words) <= _MOST_AXES:
        raise line_error(line, f"`@interpolate` has {len(words)} numbers", f"{allowed}; at most {_MOST_AXES}")
    for word in words:
        if not re.fullmatch(r"[1-9]\d{0,5}", word, re.ASCII):
            raise line_error(line, f"`{word}` is no number of points", allowed)
    return [int(word) for word in words]


def _check_distances(corners: list[SetPointRow], line: int) -> None:
    kinds = {None if row.distance_m is None else math.isinf(row.distance_m) for row in corners}
    if len(kinds) > 1:
        found = "some corners have a distance in metres and others have not"
        raise line_error(line, found, "between them there is none; give every corner one, or none")


def _weights(counts: list[int], *, zigzag: bool) -> list[tuple[float, ...]]:
    """Return the position of every new point along each axis, 0 to 1; the first axis varies fastest."""
    weights = []
    for k in range(math.prod(counts)):
        place, left = [], k
        for count in counts:
            left, step = divmod(left, count)
            step = count - 1 - step if zigzag and left % 2 else step
            place.append(step / (count - 1) if count > 1 else 0.5)
        weights.append(tuple(place))
    return weights


def _between(corners: list[SetPointRow], weights: tuple[float, ...]) -> SetPointRow:
    for weight in weights:
        corners = [_blend(one, other, weight) for one, other in zip(corners[::2], corners[1::2], strict=True)]
    return corners[0]


def _blend(one: SetPointRow, other: SetPointRow, weight: float) -> SetPointRow:
    blended = []
    for a, b in zip(one.values, other.values, strict=True):
        if a is None or b is None or a == b:
            blended.append(a)
        else:
            blended.append(a * (1.0 - weight) + b * weight)
    return _row(blended, one.line)


COMMANDS: Mapping[str, Command] = {
    "add": _arithmetic("add", operator.add, 0.0),
    "sub": _arithmetic("sub", operator.sub, 0.0),
    "mul": _arithmetic("mul", operator.mul, 1.0),
    "div": _arithmetic("div", operator.truediv, 1.0),
    "delete": _delete,
    "reverse": _reverse,
    "interpolate": _interpolate,
}
