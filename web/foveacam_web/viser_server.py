"""A viser server that is ours alone: this machine only, the port asked for, no way to a public tunnel."""

import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import rich
import viser

from foveacam_hardware.contract import InvalidInput

HOST = "127.0.0.1"
_log = logging.getLogger(__name__)


def open_viser(*, port: int = 0) -> viser.ViserServer:
    """Return a running viser server bound to 127.0.0.1; port 0 lets the system choose.

    Raise `InvalidInput` when the port is taken: viser itself would take the next one and say nothing.
    """
    if port != 0:
        _probe(port)
    with _quiet():
        server = viser.ViserServer(host=HOST, port=port, label="FoveaCam Duo", verbose=False)
    if port not in (0, server.get_port()):
        found = server.get_port()
        close_viser(server)
        raise InvalidInput(
            f"the 3D pane was to use port {port} and got {found}; another program took it just now",
            asked=f"port {port}",
            found=f"port {found}",
            remedy="choose another port, or 0",
        )
    # Any viewer may ask viser for a public tunnel, whether or not the button is shown
    server.request_share_url = _refuse_tunnel  # type: ignore[method-assign]  # viser has no option for it
    server.disconnect_share_url = _no_tunnel  # type: ignore[method-assign]  # there never is one
    return server


def close_viser(server: viser.ViserServer) -> None:
    """Stop the server and its threads."""
    with _quiet():
        server.stop()


def _probe(port: int) -> None:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise InvalidInput(
                f"the 3D pane cannot use port {port} of {HOST}: {error.strerror or error}",
                asked=f"port {port}",
                found=str(error.strerror or error),
                remedy="choose another port, or 0",
            ) from error


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
