"""Codec of FLIR (Directed Perception) pan-tilt units: ASCII commands, one reply to each.

Pure functions. A command ends with a space or a carriage return; the reply begins with `*` on success and
with `!` and a reason on failure. `!P` and `!T` are sent unrequested when an axis runs into a limit. Positions
are motor steps: pan > 0 to the left, tilt > 0 up.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

ECHO_OFF = "ED"
TERSE = "FT"
LIMITS_ON = "LE"
IMMEDIATE = "I"
"""Immediate mode: a position command is executed on arrival, not at the next await."""
INDEPENDENT = "CI"
"""Independent control mode: speeds are magnitudes, and moves are commanded as positions."""
VERSION = "V"
RESET = "R"
"""Drive both axes to their limits and back to zero; answered when done."""
HALT = "H"
MAX_UNTERMINATED_BYTES = 4096
"""Bytes without a line end beyond which the input is discarded as noise."""
LONGEST_COMMAND = 24


class PtuAxis(StrEnum):
    """An axis, by the letter that its commands begin with."""

    PAN = "P"
    TILT = "T"


class PtuQuery(StrEnum):
    """A queryable number of an axis, by the letter after the axis letter."""

    POSITION = "P"
    RESOLUTION = "R"
    """Arc seconds per step."""
    LOWEST = "N"
    HIGHEST = "X"
    """Reachable positions found by the last reset."""
    SPEED = "S"
    SLOWEST = "L"
    FASTEST = "U"
    """Steps per second."""


class BadPtuReply(Exception):
    """A received line is not a reply of such a unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuDone:
    """A command succeeded, or a query was answered with `text`; `echo`: the echoed command before it."""

    text: str = ""
    echo: str = ""

    @property
    def number(self) -> float:
        """The number in the answer; raise `BadPtuReply` when it has none or several."""
        found = _NUMBER.findall(self.text)
        if len(found) != 1:
            raise BadPtuReply(self.text)
        return float(found[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuRefused:
    """A command failed, with the unit's reason."""

    reason: str
    echo: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuLimitHit:
    """An axis ran into a limit and lost count of its steps."""

    axis: PtuAxis


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuBanner:
    """The unrequested message after a start."""

    text: str


Line: TypeAlias = PtuDone | PtuRefused | PtuLimitHit | PtuBanner

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
_REPLY = re.compile(
    r"(?P<echo>[A-Za-z][A-Za-z0-9.,-]*(?: [A-Za-z][A-Za-z0-9.,-]*)*)?\s*(?P<mark>[*!])(?P<rest>.*)"
)
_LIMIT = re.compile(r"!([PT])(?![a-z])")


def query(axis: PtuAxis, what: PtuQuery) -> str:
    """Return the command that queries a number of an axis."""
    return f"{axis.value}{what.value}"


def move(axis: PtuAxis, position: int) -> str:
    """Return the command that moves an axis to a position, steps; allowed while it moves."""
    return f"{axis.value}P{position:d}"


def speed(axis: PtuAxis, steps_per_s: int) -> str:
    """Return the command that sets the speed of an axis, steps per second."""
    return f"{axis.value}S{steps_per_s:d}"


def encode(command: str) -> bytes:
    """Return the bytes of a command; raise `ValueError` when it is not a single command."""
    if not command or len(command) > LONGEST_COMMAND or not command.isascii() or " " in command:
        raise ValueError(f"{command!r} is no single command")
    return command.encode("ascii") + b" "


def parse(text: str) -> list[Line]:
    """Parse a received line: limit messages may precede a reply. Raise `BadPtuReply` for noise."""
    lines: list[Line] = []
    while found := _LIMIT.match(text):
        lines.append(PtuLimitHit(axis=PtuAxis(found[1])))
        text = text[found.end() :].lstrip()
    if not text:
        return lines
    if text.startswith("#"):
        return [*lines, PtuBanner(text=text.strip("# "))]
    if not (reply := _REPLY.fullmatch(text)):
        raise BadPtuReply(text)
    echo, rest = reply["echo"] or "", reply["rest"].strip()
    if reply["mark"] == "*":
        return [*lines, PtuDone(text=rest, echo=echo)]
    return [*lines, PtuRefused(reason=rest or "it gave no reason", echo=echo)]


def is_version(text: str) -> bool:
    """Return whether a reply is the one to `VERSION`, which differs from every other."""
    return "pan-tilt" in text.lower() and re.search(r"v\d", text.lower()) is not None


class PtuReplyReader:
    """Splits a byte stream into lines; empty lines are dropped."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that `data` completes."""
        *lines, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > MAX_UNTERMINATED_BYTES:
            self._rest = b""
        return [text for line in lines if (text := line.decode("ascii", "replace").strip())]
