"""An application served in a thread of the test's process."""

import asyncio
import functools
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from fastapi.dependencies import models
from starlette.types import ASGIApp

from foveacam_hardware.contract import DeviceFault
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.server import WatchedServer, server_config

_START_TIMEOUT_S = 20.0


class _Server(WatchedServer):
    """A server that sets an event when it has started."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.begun = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start listening, and set the event."""
        await super().startup(sockets)
        self.begun.set()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop, and abort connections whose peers do not read: else their sockets stay open."""
        await super().shutdown(sockets)
        for connection in list(self.server_state.connections):
            connection.transport.abort()
        await asyncio.sleep(0)  # lets the loop close the aborted transports


@contextmanager
def serving(app: ASGIApp, *, certificate: tuple[Path, Path] | None = None, port: int = 0) -> Iterator[int]:
    """Serve `app` on a port of 127.0.0.1, by default a free one, and yield the port, until the context ends.

    `certificate`: with its key, to serve https.
    """
    listener = listen("127.0.0.1", port)
    config = server_config(app)
    if certificate is not None:
        config.ssl_certfile, config.ssl_keyfile = certificate
    server = _Server(config)

    def run() -> None:
        try:
            asyncio.run(server.serve(sockets=[listener]))
        finally:
            server.begun.set()

    thread = threading.Thread(target=run, name="local server")
    thread.start()
    try:
        if not server.begun.wait(_START_TIMEOUT_S) or not server.started:
            raise DeviceFault("the local server did not start; its message stands above")
        yield int(listener.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join()
        listener.close()
        forget_functions_of_routes()


def forget_functions_of_routes() -> None:
    """Empty FastAPI's caches of route functions, which keep each application in memory for good.

    A server has one application; a worker of the tests opens dozens, of 100 to 200 MB each.
    """
    for cached in vars(models).values():
        if isinstance(cached, functools._lru_cache_wrapper):
            cached.cache_clear()
