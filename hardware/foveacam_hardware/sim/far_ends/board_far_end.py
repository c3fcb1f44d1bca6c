"""The interface of a simulated motor controller board (pan-tilt, rail), its kinds and its faults.

The boards are in `grbl_far_end` and `ptu_far_end`; `board_loopback` runs one in this process, and
`board_process` in a process of its own.
"""

from collections import deque
from collections.abc import Mapping, Set
from enum import StrEnum
from typing import Protocol, TypedDict, Unpack

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.line_faults import LineFaults


class BoardKind(StrEnum):
    """The controller that answers at the port."""

    GRBL = "grbl"
    GRBL_WITH_RAIL = "grbl-rail"
    """With a third axis, the rail."""
    PTU = "ptu"


class BoardFaults(TypedDict, total=False):
    """Faults of a board; keys left out are not changed, keys that a board does not have are refused."""

    silent: bool
    """It ignores its input and sends nothing."""
    slow_ns: int
    """Additional delay of every answer."""
    seized: bool
    """Its motors do not turn, although it answers."""
    has_switches: bool
    """Grbl: whether the cable of the reference switches is connected."""
    settings: Mapping[int, float]
    """Grbl: settings by number."""
    steps_per_s: int
    """FLIR: the top speed of its motors."""


class BoardFarEnd(Protocol):
    """A board as a state machine: bytes in, bytes out, in time; faults are methods."""

    to_device: LineFaults
    to_host: LineFaults
    unplugged: bool

    @property
    def state(self) -> str:
        """The state of the firmware, in its own term."""
        ...

    def feed(self, data: bytes) -> None:
        """Receive bytes from the host, now."""
        ...

    def take_output(self) -> bytes:
        """Return the bytes for the host that are due."""
        ...

    def next_event_ns(self) -> int | None:
        """Return the time of the next planned event; None without one."""
        ...

    def advance(self, t_ns: int) -> None:
        """Run everything due up to `t_ns`."""
        ...

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change faults."""
        ...

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit."""
        ...

    def power_cycle(self) -> None:
        """Switch the supply off and on, wherever the axes are."""
        ...

    def unplug(self) -> None:
        """Unplug the cable."""
        ...

    def plug(self) -> None:
        """Plug the cable in again."""
        ...


def refuse_unknown_faults(changes: BoardFaults, known: Set[str]) -> None:
    """Raise `ValueError` for faults that a board does not have."""
    if unknown := changes.keys() - known:
        raise ValueError(f"this board has no {', '.join(sorted(unknown))}; it has {', '.join(sorted(known))}")


class PendingAnswers:
    """Lines for the host, each with the time from which it can be read."""

    def __init__(self, clock: Clock, line: LineFaults) -> None:
        self._clock = clock
        self._line = line
        self._waiting: deque[tuple[int, bytes]] = deque()

    def add_line(self, line: str, *, ready_ns: int, gap_ns: int = 0) -> None:
        """Append a line that is due at `ready_ns`, at least `gap_ns` after the last one."""
        if self._waiting:
            ready_ns = max(ready_ns, self._waiting[-1][0] + gap_ns)
        self._waiting.append((ready_ns, line.encode("ascii") + b"\r\n"))

    def take_output(self) -> bytes:
        """Return the bytes that are due, with the faults of the line applied."""
        now_ns = self._clock.now_ns()
        data = bytearray()
        while self._waiting and self._waiting[0][0] <= now_ns:
            data += self._line.apply(self._waiting.popleft()[1])
        return bytes(data)

    def next_event_ns(self, planned_ns: int | None) -> int | None:
        """Return the earlier of the next line's time and `planned_ns`; None without either."""
        moments_ns = [planned_ns, self._waiting[0][0] if self._waiting else None]
        return min((t_ns for t_ns in moments_ns if t_ns is not None), default=None)

    def clear(self) -> None:
        """Discard every line."""
        self._waiting.clear()
