"""A link to a far end in the same process: a read waits on the rig's clock.

On virtual time a whole session takes no time and always runs the same way.
"""

import threading
from typing import Protocol

from foveacam_hardware.contract import Clock, NotConnected


class PluggedFarEnd(Protocol):
    """A far end whose cable may be pulled."""

    unplugged: bool

    def feed(self, data: bytes) -> None:
        """Take bytes from the host, now."""
        ...

    def take(self) -> bytes:
        """Return the bytes for the host that have come up."""
        ...

    def next_event_ns(self) -> int | None:
        """Return when something will happen by itself."""
        ...

    def advance(self, t_ns: int) -> None:
        """Do everything that was due up to `t_ns`."""
        ...


class LoopbackBoard(Protocol):
    """A far end in this process, its clock, and the lock under which it is used."""

    clock: Clock
    lock: threading.RLock

    @property
    def far_end(self) -> PluggedFarEnd:
        """The device itself."""
        ...


class BoardLink:
    """A `Link` to a far end in this process. A new one is what opening the port again is."""

    def __init__(self, board: LoopbackBoard) -> None:
        self._board = board
        self._open = True
        self._check()

    def write(self, data: bytes) -> None:
        """Hand `data` to the board."""
        with self._board.lock:
            self._check()
            self._board.far_end.feed(data)

    def read(self, timeout_s: float) -> bytes:
        """Return what the board has said, letting up to `timeout_s` go by on the clock."""
        board = self._board
        with board.lock:
            deadline_ns = board.clock.now_ns() + round(timeout_s * 1e9)
            while True:
                self._check()
                board.far_end.advance(board.clock.now_ns())
                data = board.far_end.take()
                if data or board.clock.now_ns() >= deadline_ns:
                    return data
                due_ns = board.far_end.next_event_ns()
                board.clock.sleep_until_ns(deadline_ns if due_ns is None else min(due_ns, deadline_ns))

    def close(self) -> None:
        """Release the link."""
        self._open = False

    def _check(self) -> None:
        if self._board.far_end.unplugged or not self._open:
            raise NotConnected("simulated pan-tilt: the link is gone; plug it in again and reconnect")
