"""The server ends in time whatever its peers do, and logs no error about them."""

import asyncio
import logging
import socket
from collections.abc import AsyncIterator, Iterator

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from foveacam_server.doors import server as doors_server
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.server import WatchedServer, server_config

PATIENCE_S = 20.0
UPGRADE = (
    b"GET /left HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


@pytest.fixture
def complaints(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    log = logging.getLogger("uvicorn.error")  # its records do not propagate
    log.addHandler(caplog.handler)
    yield caplog
    log.removeHandler(caplog.handler)


class Application:
    """Answers that never end: one that is written for ever, one that waits, and a WebSocket that is late."""

    def __init__(self) -> None:
        self.begun = asyncio.Event()
        self.answered = asyncio.Event()
        routes = [
            Route("/endless", self._endless),
            Route("/waiting", self._wait),
            WebSocketRoute("/left", self._late),
        ]
        self.asgi = Starlette(routes=routes)

    async def _endless(self, _request: Request) -> Response:
        async def parts() -> AsyncIterator[bytes]:
            while True:
                yield bytes(1_000_000)
                self.begun.set()
                await asyncio.sleep(0)

        return StreamingResponse(parts())

    async def _wait(self, _request: Request) -> Response:
        self.begun.set()
        await asyncio.Event().wait()
        return Response()

    async def _late(self, websocket: WebSocket) -> None:
        await websocket.accept()
        try:
            while True:
                await websocket.receive_text()
        except WebSocketDisconnect:
            self.answered.set()
        await websocket.send_text("too late")


async def _ended_with(request: bytes, *, leaves: bool = False) -> None:
    """Serve one connection, whose peer reads nothing, and end the server once it is served."""
    application = Application()
    server = WatchedServer(server_config(application.asgi))
    with listen("127.0.0.1", 0) as listener, socket.socket() as peer:
        serving = asyncio.create_task(server.serve(sockets=[listener]))
        peer.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(peer, listener.getsockname())
        await loop.sock_sendall(peer, request)
        async with asyncio.timeout(PATIENCE_S):
            if leaves:
                await loop.sock_recv(peer, 1000)
                peer.close()
                await application.answered.wait()
            else:
                await application.begun.wait()
            server.should_exit = True
            await serving


@pytest.mark.parametrize("path", ["/endless", "/waiting"])
def test_a_peer_that_reads_nothing_delays_the_end_by_the_grace_alone(
    path: str, complaints: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doors_server, "GRACE_S", 0.1)
    monkeypatch.setattr(doors_server, "ABORTED_S", 10.0)  # it is the abort that ends it, not this limit
    asyncio.run(_ended_with(f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode()))
    assert [record.getMessage() for record in complaints.records if record.levelno >= logging.ERROR] == []


def test_an_answer_to_a_client_that_has_left_is_no_error(complaints: pytest.LogCaptureFixture) -> None:
    asyncio.run(_ended_with(UPGRADE, leaves=True))
    assert [record.getMessage() for record in complaints.records if record.levelno >= logging.ERROR] == []
