"""Viewers that never read, for `bench doors`: how many still hold their place after 30 s."""

import socket
import time
from urllib.parse import urlsplit

from foveacam_server.bench.doors_load import upgrade

VIEWERS = 64
WAIT_S = 30.0
_SMALL_BUFFER_BYTES = 4096
_SUBSCRIPTION = b'{"type": "subscribe", "views": {"wide": {"scale": 1}, "left": {"scale": 1}}}'


def dead_viewers(url: str) -> int:
    """Open 64 viewers that ask for pictures and read nothing; return how many are still held after 30 s."""
    viewers = [_viewer(url) for _ in range(VIEWERS)]
    time.sleep(WAIT_S)
    held = sum(_held(viewer) for viewer in viewers)
    for viewer in viewers:
        viewer.close()
    return held


def _viewer(url: str) -> socket.socket:
    address = urlsplit(url)
    viewer = socket.socket()
    viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SMALL_BUFFER_BYTES)
    viewer.connect((address.hostname, address.port))
    viewer.sendall(upgrade(address.netloc) + _masked(_SUBSCRIPTION))
    return viewer


def _masked(text: bytes) -> bytes:
    """Return a WebSocket text message of a client; the mask is zero, which changes nothing."""
    return bytes((0x81, 0x80 | len(text))) + bytes(4) + text


def _held(viewer: socket.socket) -> bool:
    """Tell whether the server still has the connection: reading what waits does not end in its end."""
    viewer.settimeout(1.0)
    try:
        while viewer.recv(65_536):
            pass
    except TimeoutError:
        return True
    except OSError:
        return False
    return False
