"""The listening socket: bound before the server starts, with small send buffers that connections inherit."""

import errno
import socket

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput

SEND_BUFFER_BYTES = 128 * 1024
"""About one picture: more in the kernel's buffer would be old when it is sent (default: up to 4 MB)."""
_BACKLOG = 256


def listen(host: str, port: int) -> socket.socket:
    """Return a listening TCP socket for `uvicorn.Server.serve(sockets=[…])`; port 0 lets the system choose.

    Raise `Busy` when the port is taken, `InvalidInput` when the address cannot be used at all.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listener = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise _refusal(error, host=host, port=port) from error
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        listener.bind((host, port))
        listener.listen(_BACKLOG)
    except OSError as error:
        listener.close()
        raise _refusal(error, host=host, port=port) from error
    listener.setblocking(False)
    return listener


def _refusal(error: OSError, *, host: str, port: int) -> FoveaError:
    asked, found = f"{host} port {port}", error.strerror or str(error)
    if error.errno == errno.EADDRINUSE:
        remedy = f"stop it, or choose another with --port {port + 1 if port < 65535 else 0}"
        message = f"port {port} on {host} is in use by another program; {remedy}"
        return Busy(message, asked=asked, found=found, remedy=remedy)
    remedy = "choose another --host or --port"
    return InvalidInput(
        f"cannot listen on {asked}: {found}; {remedy}", asked=asked, found=found, remedy=remedy
    )
