"""The listening socket: bound before the server starts, with small send buffers that connections inherit."""

import socket

from foveacam_hardware.contract import InvalidInput

SEND_BUFFER_BYTES = 128 * 1024
"""About one picture: what the kernel holds for a slow client is already old (its default is up to 4 MB)."""
_BACKLOG = 256


def listen(host: str, port: int) -> socket.socket:
    """Return a listening TCP socket for `uvicorn.Server.serve(sockets=[…])`; port 0 lets the system choose.

    Raise `InvalidInput` when the address cannot be bound, naming what to do.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        listener.bind((host, port))
        listener.listen(_BACKLOG)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise InvalidInput(
            f"cannot listen on {host} port {port}: {error.strerror or error}; "
            "choose another port with --port, or stop the program that uses it",
            asked=f"{host}:{port}",
            found=str(error.strerror or error),
            remedy="choose another port with --port",
        ) from error
    return listener
