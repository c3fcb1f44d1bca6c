"""A viser server that only its owner can reach: a Unix socket, no port, no way to a public tunnel.

viser asks nobody who they are; the relay that connects here does. viser has no option for such a socket, so
it is put where websockets would open a port while viser starts.
"""

import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rich
import viser
import websockets.asyncio.server as websockets_server

from foveacam_hardware.contract import NotConnected
from foveacam_web.socket_folder import SocketFolder

_log = logging.getLogger(__name__)


class PrivateViser:
    """A running viser server and the socket that it listens on, in a folder that only its owner can enter."""

    def __init__(self) -> None:
        """Start it; raise `OSError` where no socket can be had, `NotConnected` where viser takes none."""
        self._folder = SocketFolder()
        self.socket_path = self._folder.path
        try:
            self.server = _open(self.socket_path)
        except BaseException:
            self._folder.close()
            raise

    def close(self) -> None:
        """Stop the server and its threads, and remove the socket."""
        with _quiet():
            self.server.stop()
        self._folder.close()


def _open(path: Path) -> viser.ViserServer:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(str(path))
        with _quiet(), _listening_on(listener) as taken:
            server = viser.ViserServer(host="127.0.0.1", port=0, label="FoveaCam Duo", verbose=False)
            if not taken:  # another version's, at a port that everybody can reach
                server.stop()
                raise NotConnected(
                    f"viser {viser.__version__} does not listen on the socket that it was given, "
                    "but at a port that others can reach; install the version that foveacam-duo asks for",
                    found=f"viser {viser.__version__}",
                    remedy="install the version of viser that foveacam-duo asks for",
                )
    except BaseException:
        listener.close()
        raise
    # Any viewer may ask viser for a public tunnel, whether or not the button is shown
    server.request_share_url = _refuse_tunnel  # type: ignore[method-assign]  # viser has no option for it
    server.disconnect_share_url = _no_tunnel  # type: ignore[method-assign]  # there never is one
    return server


@contextmanager
def _listening_on(listener: socket.socket) -> Iterator[list[socket.socket]]:
    """Let the server that viser opens listen on `listener`; what is yielded holds it once that is so."""
    taken: list[socket.socket] = []
    serve = websockets_server.serve

    def serve_privately(handler: Any, _host: str, _port: int, **options: Any) -> Any:  # noqa: ANN401  # viser's
        taken.append(listener)
        return serve(handler, sock=listener, **options)

    websockets_server.serve = serve_privately  # type: ignore[misc, assignment]  # a class; only called
    try:
        yield taken
    finally:
        websockets_server.serve = serve  # type: ignore[misc]  # mypy holds classes for constants


def _refuse_tunnel(verbose: bool = True) -> str | None:  # viser's own signature
    del verbose
    _log.warning("a viewer asked viser for a public share tunnel; refused")
    return None


def _no_tunnel() -> None:
    return


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's banner off the terminal; it is printed whatever `verbose` says."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
