"""A connection that ends at once when the sign-in or token that opened it is revoked."""

import asyncio

from starlette.types import Message, Receive, Scope, Send

SIGNED_OUT = 4401
"""Close code of a WebSocket whose sign-in was revoked."""


class OpenConnection:
    """Stands between the server and the application for one WebSocket or GET."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._websocket = scope["type"] == "websocket"
        self._receive, self._send = receive, send
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._waiting: asyncio.Task[Message] | None = None
        self._closed = False
        self._unfinished = False
        """Whether an answer has begun that has not ended."""

    def end(self) -> None:
        """End it; callable from any thread."""
        self._loop.call_soon_threadsafe(self._ended.set)

    async def receive(self) -> Message:
        """Return the next message of the peer; that it has left once the connection has ended."""
        if self._waiting is None:
            self._waiting = asyncio.create_task(_awaited(self._receive))
        ended = asyncio.create_task(self._ended.wait())
        try:
            await asyncio.wait({self._waiting, ended}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            ended.cancel()
        if self._ended.is_set():
            return await self._leave()
        message, self._waiting = self._waiting.result(), None
        return message

    async def send(self, message: Message) -> None:
        """Send a message; raise `OSError`, as for a peer that has left, once the connection has ended."""
        if self._ended.is_set():
            await self._leave()
            raise OSError("the sign-in of this connection was revoked")
        await self._send(message)
        if not self._websocket:
            self._unfinished = message["type"] == "http.response.start" or message.get("more_body", False)

    async def release(self) -> None:
        """Stop waiting for the peer, and end the answer if the application was stopped within it."""
        if self._waiting is not None:
            self._waiting.cancel()
        if self._unfinished and self._ended.is_set():
            await self._send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _leave(self) -> Message:
        if not self._websocket:
            return {"type": "http.disconnect"}
        if not self._closed:
            self._closed = True
            await self._send({"type": "websocket.close", "code": SIGNED_OUT, "reason": "signed out"})
        return {"type": "websocket.disconnect", "code": SIGNED_OUT, "reason": "signed out"}


async def _awaited(receive: Receive) -> Message:
    return await receive()
