"""JSON lines over a socket between a far end's process and the world's.

To the world: `{"event": drive|rail|low_pass|trigger, "t_ns", …}`, `{"ask": "strobe", "role"}`,
`{"done": id, "status"}`, `{"ready"}`. To the far end: `{"strobe_us"}`, `{"command", "id", …}`.
"""

import contextlib
import json
import socket
import threading
from dataclasses import dataclass
from typing import Any, TypeAlias

RECEIVE_BYTES = 65_536

Message: TypeAlias = dict[str, Any]
"""A JSON object; Any because its values are whatever the message's kind says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerStatus:
    """What the far end's process says of itself."""

    dead: bool
    enabled: bool
    malformed: int
    """Packets received that were no packets, since it was switched on."""


class ChannelClosed(Exception):
    """The process at the other end is gone."""


class SideChannel:
    """One end of the socket; any thread sends, one receives."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self._rest = b""

    def shut_down(self) -> None:
        """Tell whoever receives, at either end, that there is nothing more; harmless when told."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Hang up and release the socket, which nobody receives from any more; harmless when closed."""
        self.shut_down()
        with self._lock:
            self._connection.close()

    @property
    def file(self) -> int:
        """The file number, for select."""
        return self._connection.fileno()

    def send(self, message: Message) -> None:
        """Send one message."""
        line = json.dumps(message, separators=(",", ":")).encode("utf-8") + b"\n"
        try:
            with self._lock:
                self._connection.sendall(line)
        except OSError as failure:
            raise ChannelClosed from failure

    def receive(self) -> list[Message]:
        """Return the messages that have arrived, at least a part of one; raise when the other end is gone."""
        try:
            data = self._connection.recv(RECEIVE_BYTES)
        except OSError as failure:
            raise ChannelClosed from failure
        if not data:
            raise ChannelClosed
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [json.loads(line) for line in lines]
