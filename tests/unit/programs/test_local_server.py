"""The server in a thread: whoever is connected when it ends, nothing of it stays open."""

import gc
import socket
import sys

import pytest
from starlette.types import Receive, Scope, Send
from tests.support.servers.local_server import serving

REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
START = {"type": "http.response.start", "status": 200, "headers": []}
PART = {"type": "http.response.body", "body": b"x" * 1_000_000, "more_body": True}


async def endless(scope: Scope, receive: Receive, send: Send) -> None:
    """Send without end, as live pictures do."""
    if scope["type"] == "http":
        await send(START)
        while True:
            await send(PART)


def test_a_client_that_stops_reading_leaves_no_socket_open_behind_the_server(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gc.collect()  # what came before
    left: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda found: left.append(found.object))
    with serving(endless) as port:
        client = socket.create_connection(("127.0.0.1", port))
        client.sendall(REQUEST)
        assert client.recv(12) == b"HTTP/1.1 200"
    client.close()
    gc.collect()

    assert left == []
