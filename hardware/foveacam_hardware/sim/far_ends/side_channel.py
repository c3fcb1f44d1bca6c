"""Messages (JSON lines) over a socket between a far end's process and its parent.

To the parent: `{"event": drive|rail|low_pass|trigger, "t_ns", …}`, `{"ask": "strobe", "role"}`,
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
"""A JSON object; Any, as the types of its values depend on the kind of message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerStatus:
    """The status of a simulated controller."""

    dead: bool
    enabled: bool
    malformed: int
    """Frames since power-up that were no valid packets."""


class ChannelClosed(Exception):
    """The other end of the channel is closed."""


class SideChannel:
    """One end of the channel; any thread may send, one thread receives."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self._partial = b""

    def shut_down(self) -> None:
        """End the communication at both ends; no effect when ended."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Shut down and release the socket, once no thread receives from it; no effect when closed."""
        self.shut_down()
        with self._lock:
            self._connection.close()

    @property
    def file(self) -> int:
        """The file descriptor, for `select`."""
        return self._connection.fileno()

    def send(self, message: Message) -> None:
        """Send one message; raise `ChannelClosed` when the other end is gone."""
        line = json.dumps(message, separators=(",", ":")).encode("utf-8") + b"\n"
        try:
            with self._lock:
                self._connection.sendall(line)
        except OSError as failure:
            raise ChannelClosed from failure

    def receive(self) -> list[Message]:
        """Wait for data, return the complete messages; raise `ChannelClosed` when the other end is gone."""
        try:
            data = self._connection.recv(RECEIVE_BYTES)
        except OSError as failure:
            raise ChannelClosed from failure
        if not data:
            raise ChannelClosed
        *lines, self._partial = (self._partial + data).split(b"\n")
        return [json.loads(line) for line in lines]
