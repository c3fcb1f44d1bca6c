"""Aborts connections whose peer has stalled: half-sent requests, and answers that the peer does not read.

uvicorn would close such a connection, which waits for a send buffer that never drains.
"""

import asyncio
import logging
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

_log = logging.getLogger(__name__)

PERIOD_S = 1.0
HEADERS_S = 10.0
"""Timeout of a request's line and headers. A kept-alive connection without a next request may wait longer:
uvicorn closes it."""
BODY_S = 120.0
"""Timeout of a request's body."""
UNREAD_S = 10.0
"""Timeout of a peer that reads no byte of an answer; one that reads a few stays connected."""


class Connection(Protocol):
    """The part of uvicorn's protocol objects that is used here; there is one per connection."""

    @property
    def transport(self) -> asyncio.Transport:
        """Transport of the connection."""
        ...

    @property
    def client(self) -> object:
        """The peer's address."""
        ...


@dataclass(slots=True)
class _Progress:
    """Phase of a connection at the last check, and its start time."""

    phase: tuple[str, object]
    """What the peer must send next, and the request it belongs to: a connection may carry many."""
    phase_since_s: float
    unsent_bytes: int = 0
    unread_since_s: float = 0.0


class ConnectionWatch:
    """Checks the progress of each connection every second; aborts stalled ones."""

    def __init__(self) -> None:
        self._progress: dict[object, _Progress] = {}

    async def run(self, connections: Iterable[Connection]) -> None:
        """Check once a second, until cancelled; `connections` is the server's own set.

        Time in which the event loop itself was blocked does not count: it read and sent nothing.
        """
        blocked_s, checked_s = 0.0, time.monotonic()
        while True:
            await asyncio.sleep(PERIOD_S)
            now_s = time.monotonic()
            blocked_s += max(0.0, now_s - checked_s - PERIOD_S)
            checked_s = now_s
            self.check(list(connections), now_s=now_s - blocked_s)

    def check(self, connections: Iterable[Connection], *, now_s: float) -> None:
        """Abort each connection that has made no progress for too long."""
        before, self._progress = self._progress, {}
        for connection in connections:
            progress = _progress_of(connection, before.get(connection), now_s=now_s)
            reason = _overdue(progress, now_s=now_s)
            if reason is None:
                self._progress[connection] = progress
                continue
            _log.info("connection of %s aborted: %s", connection.client, reason)
            connection.transport.abort()


def _progress_of(connection: Connection, before: _Progress | None, *, now_s: float) -> _Progress:
    phase = _phase(connection)
    unsent_bytes = connection.transport.get_write_buffer_size()
    if before is None:
        return _Progress(phase, now_s, unsent_bytes, now_s)
    phase_since_s = before.phase_since_s if phase == before.phase else now_s
    taken = unsent_bytes == 0 or unsent_bytes < before.unsent_bytes
    return _Progress(phase, phase_since_s, unsent_bytes, now_s if taken else before.unread_since_s)


def _phase(connection: Connection) -> tuple[str, object]:
    """Return what the peer must send (`headers`, `body` or `nothing`) and the newest request's cycle."""
    if not isinstance(connection, H11Protocol):
        return "nothing", None  # a WebSocket: uvicorn's pings find out whether it is alive
    state, cycle = connection.conn.their_state, connection.cycle
    if state is h11.IDLE and cycle is not None and not connection.conn.trailing_data[0]:
        return "nothing", cycle  # it has its answer
    return {h11.IDLE: "headers", h11.SEND_BODY: "body"}.get(state, "nothing"), cycle


def _overdue(progress: _Progress, *, now_s: float) -> str | None:
    """Return why the connection must be aborted; None while it makes progress."""
    waited_s = now_s - progress.phase_since_s
    if progress.phase[0] == "headers" and waited_s > HEADERS_S:
        return f"no whole request in {HEADERS_S:g} s"
    if progress.phase[0] == "body" and waited_s > BODY_S:
        return f"no whole body in {BODY_S:g} s"
    if now_s - progress.unread_since_s > UNREAD_S:
        return f"nothing read in {UNREAD_S:g} s"
    return None
