"""Ends connections whose peer has stopped: half-sent requests, and answers that nobody reads.

uvicorn closes such a connection politely, which waits for a buffer that never drains; here it is aborted.
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
"""How long a request's line and headers may take; a connection that is kept alive ends earlier."""
BODY_S = 120.0
"""How long a request's body may take."""
UNREAD_S = 10.0
"""How long a peer may take nothing of what waits for it; one that takes a little keeps its connection."""


class Connection(Protocol):
    """What is used of uvicorn's protocol objects, one a connection."""

    @property
    def transport(self) -> asyncio.Transport:
        """What carries the bytes."""
        ...

    @property
    def client(self) -> object:
        """The peer's address."""
        ...


@dataclass(slots=True)
class _Seen:
    """What a connection was doing when it was last looked at, and since when."""

    phase: tuple[str, object]
    """What is awaited of the peer, and the request it belongs to: a connection may carry many."""
    phase_since_s: float
    unsent_bytes: int = 0
    unread_since_s: float = 0.0


class ConnectionWatch:
    """Remembers how far each connection had come; aborts those that do not go on."""

    def __init__(self) -> None:
        self._seen: dict[object, _Seen] = {}
        self.aborted = 0

    async def run(self, connections: Iterable[Connection]) -> None:
        """Look once a second, until cancelled; `connections` is the server's own set."""
        while True:
            await asyncio.sleep(PERIOD_S)
            self.check(list(connections), now_s=time.monotonic())

    def check(self, connections: Iterable[Connection], *, now_s: float) -> None:
        """Abort each connection that has not gone on for too long."""
        before, self._seen = self._seen, {}
        for connection in connections:
            seen = _look(connection, before.get(connection), now_s=now_s)
            reason = _overdue(seen, now_s=now_s)
            if reason is None:
                self._seen[connection] = seen
                continue
            self.aborted += 1
            _log.info("connection of %s aborted: %s", connection.client, reason)
            connection.transport.abort()


def _look(connection: Connection, before: _Seen | None, *, now_s: float) -> _Seen:
    phase = _phase(connection)
    unsent_bytes = connection.transport.get_write_buffer_size()
    if before is None:
        return _Seen(phase, now_s, unsent_bytes, now_s)
    phase_since_s = before.phase_since_s if phase == before.phase else now_s
    taken = unsent_bytes == 0 or unsent_bytes < before.unsent_bytes
    return _Seen(phase, phase_since_s, unsent_bytes, now_s if taken else before.unread_since_s)


def _phase(connection: Connection) -> tuple[str, object]:
    """Return what is awaited of the peer (`headers`, `body` or `nothing`) and the newest request's cycle."""
    if not isinstance(connection, H11Protocol):
        return "nothing", None  # a WebSocket: uvicorn's pings tell whether it lives
    awaited = {h11.IDLE: "headers", h11.SEND_BODY: "body"}.get(connection.conn.their_state, "nothing")
    return awaited, connection.cycle


def _overdue(seen: _Seen, *, now_s: float) -> str | None:
    """Return why the connection is to be aborted; None while it goes on."""
    waited_s = now_s - seen.phase_since_s
    if seen.phase[0] == "headers" and waited_s > HEADERS_S:
        return f"no whole request in {HEADERS_S:g} s"
    if seen.phase[0] == "body" and waited_s > BODY_S:
        return f"no whole body in {BODY_S:g} s"
    if now_s - seen.unread_since_s > UNREAD_S:
        return f"nothing read in {UNREAD_S:g} s"
    return None
