"""Codec of Grbl 1.1 (and grblHAL): command lines, answer lines, and real-time bytes that bypass the queue.

Pure functions. Grbl answers every line in order by one `ok` or `error:n`; status reports, alarms and messages
arrive in between. Numbers are in the machine's units: degrees for a rotating axis.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

STATUS = b"?"
"""Request a status report; answered at any time except while homing."""
FEED_HOLD = b"!"
RESUME = b"~"
RESET = b"\x18"
"""Stop, clear the queue and restart. The position is kept unless an axis was moving."""
JOG_CANCEL = b"\x85"
"""Decelerate to a stop and clear queued jogs; ignored when no jog is running."""
REALTIME = STATUS + FEED_HOLD + RESUME + RESET + JOG_CANCEL

LETTERS = "XYZ"
"""Axes in the order of the positions in reports."""
HOME = "$H"
SETTINGS = "$$"
BUILD_INFO = "$I"
UNLOCK = "$X"
PARSER_STATE = "$G"
"""Request the parser state, which includes the programmed feed (see `feed`); not answered during a hold."""

STATES = frozenset({"Idle", "Run", "Hold", "Jog", "Alarm", "Door", "Check", "Home", "Sleep", "Tool"})
LONGEST_LINE = 70
"""Longest line in characters (80 in the firmware, less what it adds)."""
MAX_UNTERMINATED_BYTES = 4096
"""Bytes without a line end beyond which the input is discarded as noise."""

ERRORS = {
    1: "a word had no letter",
    2: "a number could not be read",
    3: "the command is not known to it",
    5: "homing is switched off in its settings ($22)",
    8: "it must be at rest for that",
    9: "it is locked after an alarm",
    10: "soft limits need homing",
    11: "the line was too long",
    15: "the path leads beyond its travel ($130, $131)",
    16: "the jog was malformed",
    20: "the command is not supported",
    22: "the speed was missing",
}
ALARMS = {
    1: "a limit switch was hit while moving",
    2: "it was sent beyond its travel",
    3: "it was reset while moving and has lost its position",
    6: "it was reset while homing",
    7: "the safety door opened while homing",
    8: "a switch did not open again when it backed off",
    9: "a reference switch was not found",
    11: "it must be homed first",
}


class BadGrblLine(Exception):
    """A received line is not a Grbl line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblOk:
    """A line was accepted (`ok`)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblRefused:
    """A line was refused (`error:n`); nothing moved."""

    code: int

    def __str__(self) -> str:
        return f"error {self.code}: {ERRORS.get(self.code, 'a reason that this program does not know')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblAlarm:
    """Grbl raised an alarm and locked itself."""

    code: int

    def __str__(self) -> str:
        return f"alarm {self.code}: {ALARMS.get(self.code, 'a reason that this program does not know')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblWelcome:
    """The greeting after a start or restart."""

    version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblSetting:
    """One numbered setting."""

    number: int
    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblMessage:
    """A message in brackets."""

    text: str


UNLOCKED = GrblMessage(text="MSG:Caution: Unlocked")
"""Sent before the answer to `UNLOCK`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblStatusReport:
    """A status report, with either the `machine` or the `work` position, in the machine's units."""

    state: str
    substate: int | None = None
    machine: tuple[float, ...] | None = None
    work: tuple[float, ...] | None = None
    offset: tuple[float, ...] | None = None
    """Work offset, present in some reports only: machine = work + offset."""


Line: TypeAlias = (
    GrblOk | GrblRefused | GrblAlarm | GrblWelcome | GrblSetting | GrblMessage | GrblStatusReport
)

_NUMBERED = re.compile(r"(error|ALARM):(\d+)")
_FEED = re.compile(r"GC:.* F(\d+)(?:\.0*)?(?: .*)?")
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d*)?)")
_WELCOME = re.compile(r"Grbl(?:HAL)? (\d\S*)", re.IGNORECASE)


def jog(goals: Mapping[str, float], *, feed_per_min: float) -> str:
    """Return the jog line that moves axes, by their letters, to positions in machine coordinates.

    A jog can be stopped cleanly. The feed is along the path, in the machine's units (degrees, millimetres).
    """
    words = "".join(f"{letter}{goals[letter]:.3f}" for letter in LETTERS if letter in goals)
    return f"$J=G21G53{words}F{feed_per_min:.1f}"


def feed(value: int) -> str:
    """Return the line that programs the feed of cutting moves, which jogs neither use nor change.

    The board holds it in its working memory alone: it is 0 after every start and reset.
    """
    return f"F{value:d}"


def programmed_feed(message: GrblMessage) -> int | None:
    """Return the programmed feed in an answer to `PARSER_STATE`; None for any other message."""
    found = _FEED.fullmatch(message.text)
    return int(found[1]) if found else None


def encode(line: str) -> bytes:
    """Return the bytes of a line; raise `ValueError` when it is too long."""
    if len(line) > LONGEST_LINE:
        raise ValueError(f"a line of {len(line)} characters: Grbl takes {LONGEST_LINE}")
    return line.encode("ascii") + b"\n"


def parse(line: str) -> Line:
    """Parse a received line; raise `BadGrblLine` for noise."""
    if line == "ok":
        return GrblOk()
    if found := _NUMBERED.fullmatch(line):
        code = int(found[2])
        return GrblRefused(code=code) if found[1] == "error" else GrblAlarm(code=code)
    if line.startswith("<") and line.endswith(">"):
        return _report(line[1:-1])
    if line.startswith("[") and line.endswith("]"):
        return GrblMessage(text=line[1:-1])
    if found := _SETTING.match(line):
        return GrblSetting(number=int(found[1]), value=float(found[2]))
    if found := _WELCOME.match(line):
        return GrblWelcome(version=found[1])
    raise BadGrblLine(line)


def _report(body: str) -> GrblStatusReport:
    head, *fields = body.split("|")
    state, _, substate = head.partition(":")
    if state not in STATES or not (substate.isdigit() or not substate):
        raise BadGrblLine(body)
    values = dict(field.partition(":")[::2] for field in fields)
    if "MPos" not in values and "WPos" not in values:
        raise BadGrblLine(body)
    return GrblStatusReport(
        state=state,
        substate=int(substate) if substate else None,
        machine=_numbers(values.get("MPos")),
        work=_numbers(values.get("WPos")),
        offset=_numbers(values.get("WCO")),
    )


def _numbers(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise BadGrblLine(text) from error
    if len(numbers) < 2 or not all(math.isfinite(number) for number in numbers):
        raise BadGrblLine(text)
    return numbers


class GrblLineReader:
    """Splits a byte stream into lines; empty lines are dropped."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that `data` completes."""
        *lines, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > MAX_UNTERMINATED_BYTES:
            self._rest = b""
        return [text for line in lines if (text := line.decode("ascii", "replace").strip())]
