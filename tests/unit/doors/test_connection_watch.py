import asyncio
import socket
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from types import SimpleNamespace

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol

from foveacam_server.doors import connection_watch
from foveacam_server.doors.connection_watch import (
    BODY_S,
    HEADERS_S,
    PERIOD_S,
    UNREAD_S,
    Connection,
    ConnectionWatch,
)
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.server import WatchedServer, server_config

REQUEST = b"GET /hello HTTP/1.1\r\nHost: x\r\n\r\n"
UPGRADE = (
    b"GET /socket HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


class Seats:
    """How many streams are being served."""

    def __init__(self) -> None:
        self.taken = 0
        self.changed = asyncio.Condition()

    @asynccontextmanager
    async def seat(self) -> AsyncIterator[None]:
        await self._add(1)
        try:
            yield
        finally:
            await asyncio.shield(self._add(-1))

    async def reach(self, taken: int) -> None:
        async with asyncio.timeout(20.0), self.changed:
            await self.changed.wait_for(lambda: self.taken == taken)

    async def _add(self, change: int) -> None:
        async with self.changed:
            self.taken += change
            self.changed.notify_all()


class Running:
    """A watched server with streams that never end, and the peers that ask it."""

    def __init__(self) -> None:
        self.seats = Seats()
        routes = [
            Route("/hello", self._hello, methods=["GET", "POST"]),
            Route("/stream", self._stream),
            WebSocketRoute("/socket", self._socket),
        ]
        self.server = WatchedServer(server_config(Starlette(routes=routes)))
        self.listener = listen("127.0.0.1", 0)
        self.aborted = 0

    async def connect(self, sent: bytes) -> socket.socket:
        peer = socket.socket()
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        peer.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(peer, self.listener.getsockname())
        await loop.sock_sendall(peer, sent)
        return peer

    def look(self, *, later_s: float = 0.0) -> int:
        """Let the watch look as if time had passed; return how many it has aborted."""
        connections = [peer for peer in self.server.watched if not peer.transport.is_closing()]
        self.server.watch.check(connections, now_s=time.monotonic() + later_s)
        self.aborted += sum(peer.transport.is_closing() for peer in connections)
        return self.aborted

    async def connected(self, count: int) -> None:
        await until(lambda: len(self.server.watched) == count)

    async def _hello(self, request: Request) -> Response:
        await request.body()
        return PlainTextResponse("hello")

    async def _stream(self, request: Request) -> Response:
        async def parts() -> AsyncIterator[bytes]:
            async with self.seats.seat():
                while True:
                    yield bytes(100_000)
                    await asyncio.sleep(0)

        return StreamingResponse(parts())

    async def _socket(self, websocket: WebSocket) -> None:
        await websocket.accept()
        try:
            async with self.seats.seat():
                while True:
                    await websocket.send_bytes(bytes(100_000))
                    await asyncio.sleep(0)
        except WebSocketDisconnect:
            return


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():  # noqa: ASYNC110 - uvicorn tells nobody
            await asyncio.sleep(0)


def run(scenario: Callable[[Running], Awaitable[None]]) -> None:
    async def whole() -> None:
        running = Running()
        serving = asyncio.create_task(running.server.serve(sockets=[running.listener]))
        try:
            await until(lambda: running.server.started)
            running.server.force_exit = True
            await scenario(running)
        finally:
            running.server.should_exit = True
            await serving
            running.listener.close()

    asyncio.run(whole())


def test_half_sent_headers_end_the_connection() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(REQUEST[:-2])
        await running.connected(1)
        assert running.look() == 0
        assert running.look(later_s=HEADERS_S - 1) == 0
        assert running.look(later_s=HEADERS_S + 1) == 1
        await running.connected(0)
        peer.close()

    run(scenario)


def test_a_silent_connection_ends() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(b"")
        await running.connected(1)
        running.look()
        assert running.look(later_s=HEADERS_S + 1) == 1
        peer.close()

    run(scenario)


def test_a_half_sent_body_ends_later_than_headers() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(b"POST /hello HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\nhalf")
        await running.connected(1)
        await until(lambda: len(running.server.server_state.tasks) == 1)
        assert running.look() == 0
        assert running.look(later_s=HEADERS_S + 1) == 0
        assert running.look(later_s=BODY_S + 1) == 1
        peer.close()

    run(scenario)


def test_each_request_of_a_kept_connection_has_its_own_time() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(REQUEST)
        loop = asyncio.get_running_loop()
        await loop.sock_recv(peer, 1000)
        running.look()
        await loop.sock_sendall(peer, REQUEST)
        await loop.sock_recv(peer, 1000)
        assert running.look(later_s=HEADERS_S + 1) == 0
        peer.close()

    run(scenario)


def test_a_kept_connection_may_wait_for_its_next_request() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(REQUEST)
        loop = asyncio.get_running_loop()
        await loop.sock_recv(peer, 1000)
        running.look()
        assert running.look(later_s=HEADERS_S + 1) == 0
        await loop.sock_sendall(peer, REQUEST[:-2])
        await until(lambda: any(_received(connection) for connection in running.server.watched))
        running.look()
        assert running.look(later_s=HEADERS_S + 1) == 1
        peer.close()

    run(scenario)


def _received(connection: Connection) -> bool:
    assert isinstance(connection, H11Protocol)
    return connection.conn.trailing_data[0] != b""


def test_a_peer_that_reads_nothing_loses_its_seat() -> None:
    async def scenario(running: Running) -> None:
        peers = [
            await running.connect(b"GET /stream HTTP/1.1\r\nHost: x\r\n\r\n"),
            await running.connect(UPGRADE),
        ]
        await running.seats.reach(2)
        await _until_full(running, count=2)
        running.look()
        assert running.look(later_s=UNREAD_S - 1) == 0
        assert running.look(later_s=UNREAD_S + 1) == 2
        await running.seats.reach(0)
        for peer in peers:
            peer.close()

    run(scenario)


def test_a_peer_that_reads_slowly_keeps_its_seat() -> None:
    async def scenario(running: Running) -> None:
        peer = await running.connect(b"GET /stream HTTP/1.1\r\nHost: x\r\n\r\n")
        await running.seats.reach(1)
        await _until_full(running, count=1)
        running.look()
        unsent_bytes = _unsent(running)
        while _unsent(running) == unsent_bytes:
            await asyncio.get_running_loop().sock_recv(peer, 4096)
        assert running.look(later_s=UNREAD_S + 1) == 0
        peer.close()

    run(scenario)


async def _until_full(running: Running, *, count: int) -> None:
    """Wait until every connection has bytes that its peer does not take."""

    def full() -> bool:
        waiting = [c.transport.get_write_buffer_size() for c in running.server.watched]
        return len(waiting) == count and min(waiting) > 0

    await until(full)
    await asyncio.sleep(0.1)  # what the kernel still takes


def _unsent(running: Running) -> int:
    return sum(c.transport.get_write_buffer_size() for c in running.server.watched)


def test_time_in_which_the_loop_was_blocked_is_nobodys_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    watch, seen_s = ConnectionWatch(), list[float]()
    times_s = iter([100.0, 101.0, 101.0 + PERIOD_S + 60.0, 102.0 + PERIOD_S + 60.0])

    def look(_connections: object, *, now_s: float) -> None:
        seen_s.append(now_s)
        if len(seen_s) == 3:
            raise asyncio.CancelledError

    async def at_once(_delay_s: float) -> None:
        return

    monkeypatch.setattr(watch, "check", look)
    monkeypatch.setattr(connection_watch, "time", SimpleNamespace(monotonic=lambda: next(times_s)))
    monkeypatch.setattr(connection_watch, "asyncio", SimpleNamespace(sleep=at_once))
    with pytest.raises(asyncio.CancelledError):
        watch.run([]).send(None)
    assert seen_s == pytest.approx([101.0, 102.0, 103.0])
