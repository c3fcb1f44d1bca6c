"""The steering socket of the stub: it takes every order as obeyed, and keeps what the page has said."""

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from fastapi import WebSocket, WebSocketDisconnect

Document = dict[str, Any]  # Any: a JSON document
LIMITS = {
    "max_v": 170.0,
    "calibrated": True,
    "shift_limit_deg": 0.5,
    "silent_after_s": 0.25,
    "park_after_s": 3.0,
}
AT_REST = {"left": {"x_v": 0.0, "y_v": 0.0}, "right": {"x_v": 0.0, "y_v": 0.0}}


@dataclass
class StubSteering:
    """Where it was steered to, and every message of the page."""

    messages: list[Document] = field(default_factory=list)
    pose: Document = field(default_factory=lambda: dict(AT_REST))
    ended: str | None = None
    """Why it tells that steering has ended."""

    def orders(self) -> list[Document]:
        """Return what was said with a place."""
        return [message for message in self.messages if "volts" in message or "gaze" in message]

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it leaves."""
        await socket.accept()
        with suppress(WebSocketDisconnect):
            while True:
                message: Document = await socket.receive_json()
                self.messages.append(message)
                if message["type"] == "begin":
                    await socket.send_json({"type": "hello", **LIMITS})
                self.pose = self.pose | (message.get("volts") or {})
                await socket.send_json(self._state(held=message.get("held", False)))

    def _state(self, *, held: bool) -> Document:
        status = "ended" if self.ended is not None and held else "steering" if held else "released"
        return {
            "type": "state",
            "status": status,
            "reason": self.ended,
            "by": "operator" if held else None,
            "pose": self.pose,
            "target": self.pose,
            "gaze": {"ax_deg": 0.0, "ay_deg": 0.0},
        }
