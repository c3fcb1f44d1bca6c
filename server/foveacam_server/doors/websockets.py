"""WebSockets as uvicorn serves them, without an error in the log for each that is refused."""

from uvicorn._types import ASGISendEvent
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol


class RefusableWebSocket(WebSocketsSansIOProtocol):
    """Knows that an answer in the place of a handshake is complete; uvicorn logs an error for it."""

    async def send(self, message: ASGISendEvent) -> None:
        """Send one message."""
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and self.close_sent:
            self.handshake_complete = True
