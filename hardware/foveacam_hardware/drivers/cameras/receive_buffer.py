"""The receive buffer of a UDP socket that a library opened in this process, and does not give away."""

import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

logger = logging.getLogger(__name__)

SO_RCVBUFFORCE = 33  # Linux: socket(7); Python's module does not name it
_OPEN = Path("/proc/self/fd")


def widen(port: int, *, size_bytes: int) -> int:
    """Let the socket at a local UDP port hold `size_bytes`; return what it holds then, 0 where there is none.

    Beyond `net.core.rmem_max` only for who administers the network (CAP_NET_ADMIN); others get that much.
    """
    for entry in _OPEN.iterdir():
        with _udp_socket(int(entry.name)) as found:
            if found is not None and found.getsockname()[1] == port:
                return _widened(found, size_bytes)
    logger.warning("no socket at UDP port %d: its receive buffer stays as it is", port)
    return 0


def _widened(found: socket.socket, size_bytes: int) -> int:
    try:
        found.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, size_bytes)
    except PermissionError:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size_bytes)
    return found.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2  # Linux tells its own overhead with it


@contextmanager
def _udp_socket(number: int) -> Iterator[socket.socket | None]:
    """Yield a second handle on an IPv4 UDP socket of this process; None when the number is something else."""
    try:
        duplicate = os.dup(number)
    except OSError:  # closed meanwhile
        yield None
        return
    try:
        found = socket.socket(fileno=duplicate)
    except OSError:
        os.close(duplicate)
        yield None
        return
    with found:
        plain = found.family == socket.AF_INET and found.type == socket.SOCK_DGRAM
        yield found if plain else None
