"""WebSockets whose client has left, which are no errors."""

import asyncio

import pytest
from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from starlette.types import Message
from starlette.websockets import WebSocket, WebSocketDisconnect

from foveacam_server.doors.server import QuietEnds


async def _send_then_receive(websocket: WebSocket) -> None:
    """Send to a client that has left, and ask for its next message, as two tasks of one session do."""
    await websocket.accept()
    with pytest.raises(WebSocketDisconnect):
        await websocket.send_text("a picture")
    await websocket.receive_text()


async def _receive_twice(websocket: WebSocket) -> None:
    await websocket.accept()
    with pytest.raises(WebSocketDisconnect):
        await websocket.receive_text()
    await websocket.receive_text()


async def _break(websocket: WebSocket) -> None:
    await websocket.accept()
    raise RuntimeError("nobody foresaw it")


def _serve(path: str) -> None:
    """Serve one WebSocket whose connection is gone as soon as it is accepted."""
    routes = [
        WebSocketRoute("/sends", _send_then_receive),
        WebSocketRoute("/receives", _receive_twice),
        WebSocketRoute("/breaks", _break),
    ]
    come: list[Message] = [{"type": "websocket.connect"}, {"type": "websocket.disconnect", "code": 1006}]

    async def receive() -> Message:
        return come.pop(0)

    async def send(message: Message) -> None:
        if message["type"] != "websocket.accept":
            raise OSError("the connection is gone")

    scope = {"type": "websocket", "path": path, "headers": [], "query_string": b"", "subprotocols": []}
    asyncio.run(QuietEnds(Starlette(routes=routes))(scope, receive, send))


@pytest.mark.parametrize("path", ["/sends", "/receives"])
def test_a_websocket_ends_without_an_error_when_its_client_has_left(path: str) -> None:
    _serve(path)


def test_any_other_error_of_a_websocket_is_passed_on() -> None:
    with pytest.raises(RuntimeError, match="nobody foresaw it"):
        _serve("/breaks")
