"""Runs a viser server on a Unix socket in a folder of mode 0700: no TCP port, no public share tunnel.

viser authenticates nobody; the relay that connects to the socket does. viser has no option for a socket, so
`websockets.serve` is replaced while viser starts.
"""

import contextlib
import fcntl
import logging
import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rich
import viser
import websockets.asyncio.server as websockets_server

from foveacam_hardware.contract import NotConnected

_FOLDER_PREFIX = "foveacam-viser-"
_log = logging.getLogger(__name__)


class SocketFolder:
    """A temporary folder of mode 0700 for a socket, locked while its process lives.

    `close` removes it; after a kill the next start does.
    """

    def __init__(self) -> None:
        clear_abandoned(Path(tempfile.gettempdir()))
        folder = Path(tempfile.mkdtemp(prefix=_FOLDER_PREFIX))
        self.path = folder / "socket"
        self._lock_fd = os.open(folder, os.O_RDONLY)
        fcntl.flock(self._lock_fd, fcntl.LOCK_EX)

    def close(self) -> None:
        """Remove the folder; call once."""
        shutil.rmtree(self.path.parent, ignore_errors=True)
        os.close(self._lock_fd)


class PrivateViser:
    """A running viser server and the Unix socket that it listens on."""

    def __init__(self) -> None:
        """Start the server; raise `OSError` without a socket, `NotConnected` when viser opens a port."""
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


def clear_abandoned(parent: Path) -> None:
    """Remove the folders that killed processes of this user left; one without a socket is not locked yet."""
    for folder in parent.glob(f"{_FOLDER_PREFIX}*"):
        with contextlib.suppress(OSError):  # another user's, or removed meanwhile
            if (folder / "socket").exists() and not _locked(folder):
                shutil.rmtree(folder)


def _locked(folder: Path) -> bool:
    lock_fd = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(lock_fd)
    return False


def _open(path: Path) -> viser.ViserServer:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(str(path))
        with _quiet(), _listening_on(listener) as taken:
            server = viser.ViserServer(host="127.0.0.1", port=0, label="FoveaCam Duo", verbose=False)
            if not taken:  # another version, which opened a TCP port
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
    """Make viser listen on `listener`; the yielded list contains it as soon as viser does."""
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
    """Suppress viser's banner, which is printed even with `verbose=False`."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
