"""FLIR (Directed Perception) pan-tilt units as a host sees them: words of ASCII out, one reply to each.

Pure functions. A command ends with a space or a carriage return; the reply begins with `*` when it was done
and with `!` and a reason when it was not. `!P` and `!T` come unasked when an axis runs into a limit.
Positions are steps of the motor: pan > 0 to the left, tilt > 0 up.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

ECHO_OFF = "ED"
TERSE = "FT"
LIMITS_ON = "LE"
IMMEDIATE = "I"
"""Carry positions out when they come, not when they are awaited."""
INDEPENDENT = "CI"
"""Speeds are magnitudes, and positions are what is commanded."""
VERSION = "V"
RESET = "R"
"""Drive both axes to their limits and back to zero; answered when that is done."""
HALT = "H"
NOISE_LIMIT = 4096
"""Bytes without a line's end that are no reply any more."""
LONGEST_COMMAND = 24


class PtuAxis(StrEnum):
    """One of the two motors, by the letter that its commands begin with."""

    PAN = "P"
    TILT = "T"


class PtuQuery(StrEnum):
    """What can be asked of an axis, by the letter after its own."""

    POSITION = "P"
    RESOLUTION = "R"
    """Seconds of arc a step."""
    LOWEST = "N"
    HIGHEST = "X"
    """Positions that its last reset found reachable."""
    SPEED = "S"
    SLOWEST = "L"
    FASTEST = "U"
    """Steps a second."""


class BadPtuReply(Exception):
    """What came is no line of such a unit's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuDone:
    """A command was carried out, or a question answered with `text`; `echo`: what it repeated before."""

    text: str = ""
    echo: str = ""

    @property
    def number(self) -> float:
        """The number that the answer holds; raise `BadPtuReply` when it holds none or several."""
        found = _NUMBER.findall(self.text)
        if len(found) != 1:
            raise BadPtuReply(self.text)
        return float(found[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuRefused:
    """A command was not carried out, and why."""

    reason: str
    echo: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuLimitHit:
    """An axis ran into a limit, and has lost count of its steps."""

    axis: PtuAxis


@dataclass(frozen=True, slots=True, kw_only=True)
class PtuBanner:
    """What it says by itself when it starts."""

    text: str


Line: TypeAlias = PtuDone | PtuRefused | PtuLimitHit | PtuBanner

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
_REPLY = re.compile(
    r"(?P<echo>[A-Za-z][A-Za-z0-9.,-]*(?: [A-Za-z][A-Za-z0-9.,-]*)*)?\s*(?P<mark>[*!])(?P<rest>.*)"
)
_LIMIT = re.compile(r"!([PT])(?![a-z])")


def query(axis: PtuAxis, what: PtuQuery) -> str:
    """Return the question for a number of an axis."""
    return f"{axis.value}{what.value}"


def move(axis: PtuAxis, position: int) -> str:
    """Return the command that sends an axis to a position, steps; it may be given while it moves."""
    return f"{axis.value}P{position:d}"


def speed(axis: PtuAxis, steps_per_s: int) -> str:
    """Return the command that sets an axis's speed, steps a second."""
    return f"{axis.value}S{steps_per_s:d}"


def encode(command: str) -> bytes:
    """Return a command as bytes."""
    if not command or len(command) > LONGEST_COMMAND or not command.isascii() or " " in command:
        raise ValueError(f"{command!r} is no single command")
    return command.encode("ascii") + b" "


def parse(text: str) -> list[Line]:
    """Return what a line says: limits hit may stand before a reply. Raise `BadPtuReply` for noise."""
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
    """Return whether an answer is the one to `VERSION`, which no other resembles."""
    return "pan-tilt" in text.lower() and re.search(r"v\d", text.lower()) is not None


class PtuReplyReader:
    """Cuts a stream of bytes into lines; empty ones are dropped."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that `data` completes."""
        *lines, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > NOISE_LIMIT:
            self._rest = b""
        return [text for line in lines if (text := line.decode("ascii", "replace").strip())]
