"""What every pan-tilt's or rail's board has in common, seen from its serial port: what may go wrong, and how.

A board is one of `grbl_far_end` or `ptu_far_end`; `board_loopback` has it in this process, `board_process` in
another.
"""

from collections import deque
from collections.abc import Mapping, Set
from enum import StrEnum
from typing import Protocol, TypedDict, Unpack

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.line_faults import LineFaults


class BoardKind(StrEnum):
    """Who answers at the port."""

    GRBL = "grbl"
    GRBL_WITH_RAIL = "grbl-rail"
    """Its third axis moves a rail."""
    PTU = "ptu"


class BoardFaults(TypedDict, total=False):
    """How a board behaves; what is left out stays. A board refuses what it does not have."""

    silent: bool
    """It hears nothing and says nothing."""
    slow_ns: int
    """Every answer comes so much later."""
    seized: bool
    """Its motors do not turn, whatever it says."""
    has_switches: bool
    """Grbl: whether the reference switches' cable is on."""
    settings: Mapping[int, float]
    """Grbl: settings by their numbers."""
    steps_per_s: int
    """FLIR: how fast its motors can turn."""


class BoardFarEnd(Protocol):
    """A board as a state machine: bytes in, bytes out, in time; its faults are methods."""

    to_device: LineFaults
    to_host: LineFaults
    unplugged: bool

    @property
    def state(self) -> str:
        """What it is doing, in its own word."""
        ...

    def feed(self, data: bytes) -> None:
        """Take bytes from the host, now."""
        ...

    def take_output(self) -> bytes:
        """Return the bytes for the host that have come up."""
        ...

    def next_event_ns(self) -> int | None:
        """Return when something will happen by itself."""
        ...

    def advance(self, t_ns: int) -> None:
        """Do everything that was due up to `t_ns`."""
        ...

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change how it behaves."""
        ...

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit, as a cable that has caught lets it."""
        ...

    def power_cycle(self) -> None:
        """Lose the supply and come back, wherever the rig stands then."""
        ...

    def unplug(self) -> None:
        """Pull the cable."""
        ...

    def plug(self) -> None:
        """Put the cable back."""
        ...


def refuse_unknown_faults(changes: BoardFaults, known: Set[str]) -> None:
    """Raise `ValueError` for what a board does not have: nothing would be impaired."""
    if unknown := changes.keys() - known:
        raise ValueError(f"this board has no {', '.join(sorted(unknown))}; it has {', '.join(sorted(known))}")


class PendingAnswers:
    """Lines on their way to the host, each in its own good time."""

    def __init__(self, clock: Clock, line: LineFaults) -> None:
        self._clock = clock
        self._line = line
        self._waiting: deque[tuple[int, bytes]] = deque()

    def add_line(self, line: str, *, ready_ns: int, gap_ns: int = 0) -> None:
        """Let a line come at a moment, and not before the last one and a gap."""
        if self._waiting:
            ready_ns = max(ready_ns, self._waiting[-1][0] + gap_ns)
        self._waiting.append((ready_ns, line.encode("ascii") + b"\r\n"))

    def take_output(self) -> bytes:
        """Return what has come up, as the line leaves it."""
        now_ns = self._clock.now_ns()
        data = bytearray()
        while self._waiting and self._waiting[0][0] <= now_ns:
            data += self._line.apply(self._waiting.popleft()[1])
        return bytes(data)

    def next_event_ns(self, planned_ns: int | None) -> int | None:
        """Return when the next line comes, or what is planned if that is sooner."""
        moments_ns = [planned_ns, self._waiting[0][0] if self._waiting else None]
        return min((t_ns for t_ns in moments_ns if t_ns is not None), default=None)

    def clear(self) -> None:
        """Say nothing of it any more."""
        self._waiting.clear()
