"""The HTTP server: uvicorn with limits, and with a watch that aborts connections without progress."""

import asyncio
import contextlib
import logging
import resource
import socket
import ssl
from collections.abc import Sequence
from typing import cast

import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketDisconnect, WebSocketDisconnected
from uvicorn._types import ASGISendEvent
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from foveacam_server.doors.connection_watch import Connection, ConnectionWatch

_log = logging.getLogger("uvicorn.error")  # uvicorn's logger of errors of requests

GRACE_S = 1.0
"""Time for open requests at shutdown, after which connections are aborted and requests cancelled."""
ABORTED_S = 0.3
"""Longest wait for aborted requests; the server does not wait for one that ignores its cancellation."""
PING_S = 10.0
"""Interval of the pings of a WebSocket, and their timeout."""
KEEP_ALIVE_S = 75
"""Time after which an idle connection is closed: longer than clients and proxies keep one (httpx 5 s, nginx
60 s). Otherwise a request sent at that moment would meet a closing connection."""
HANDSHAKE_S = 10.0
"""Timeout of a TLS handshake."""
MESSAGE_BYTES = 2**20
"""Largest message of a WebSocket: subscriptions and viser's messages are a thousand times smaller."""
OPEN_FILES = 65_536
"""Limit of open files that the server requests; with 1 024, as many idle clients would lock out all
others."""


class RefusableWebSocket(WebSocketsSansIOProtocol):
    """Marks the handshake complete when it is answered by HTTP, for which uvicorn would log an error."""

    async def send(self, message: ASGISendEvent) -> None:
        """Send one message."""
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and self.close_sent:
            self.handshake_complete = True


class QuietEnds:
    """Suppresses the errors of requests cancelled by the shutdown, and of a WebSocket whose client has left.

    The latter appears with the next or a later message to or from it. uvicorn would log a traceback of each.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        try:
            await self._app(scope, receive, send)
        except (WebSocketDisconnect, WebSocketDisconnected):
            return
        except asyncio.CancelledError:
            if scope["type"] == "lifespan":
                raise


class KeptConnections:
    """Logs an error raised after the complete answer, and keeps the connection.

    uvicorn would close it, and the client, which has its answer, would notice only at its next request.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        complete = False

        async def note(message: Message) -> None:
            nonlocal complete
            await send(message)
            complete = message["type"] == "http.response.body" and not message.get("more_body", False)

        try:
            await self._app(scope, receive, note)
        except Exception:
            if not complete:
                raise
            _log.exception("Exception in ASGI application")


def server_config(app: ASGIApp, *, trusted_proxies: Sequence[str] = ()) -> uvicorn.Config:
    """Return the uvicorn settings common to all servers of this project.

    `trusted_proxies`: addresses or networks whose X-Forwarded-For and X-Forwarded-Proto are used; those of
    any other peer are ignored.
    """
    return uvicorn.Config(
        QuietEnds(KeptConnections(app)),
        http="h11",  # the watch reads this implementation's state
        ws=RefusableWebSocket,
        proxy_headers=bool(trusted_proxies),
        forwarded_allow_ips=list(trusted_proxies),
        ws_per_message_deflate=False,  # costs twelve times what it saves for JPEG
        ws_ping_interval=PING_S,
        ws_ping_timeout=PING_S,
        ws_max_size=MESSAGE_BYTES,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=GRACE_S + ABORTED_S,  # type: ignore[arg-type]  # handed to asyncio alone
        log_config=None,  # its records go to the root logger
        log_level="warning",
        access_log=False,
    )


class WatchedServer(uvicorn.Server):
    """A server that watches its connections and can adopt accepted ones."""

    def __init__(self, config: uvicorn.Config, *, tls: ssl.SSLContext | None = None) -> None:
        """`tls`: of adopted connections; None: plain http."""
        super().__init__(config)
        self._tls = tls
        self.watch = ConnectionWatch()
        self._watching: asyncio.Task[None] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._adopted: set[asyncio.Task[None]] = set()

    @property
    def watched(self) -> set[Connection]:
        """Every open connection, HTTP or WebSocket; the server's own set."""
        return cast(set[Connection], self.server_state.connections)  # of h11 and sansio only

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen and to watch."""
        await super().startup(sockets)
        if self.started:
            self._loop = asyncio.get_running_loop()
            self._watching = asyncio.create_task(self.watch.run(self.watched))

    def adopt(self, peer: socket.socket) -> None:
        """Serve a connection that another thread accepted; callable from any thread while the loop runs."""
        if self._loop is None:
            raise RuntimeError("the server has not started")
        self._loop.call_soon_threadsafe(self._create_adoption, peer)

    def _create_adoption(self, peer: socket.socket) -> None:
        adoption = asyncio.create_task(self._serve_adopted(peer))
        self._adopted.add(adoption)
        adoption.add_done_callback(self._adopted.discard)

    async def _serve_adopted(self, peer: socket.socket) -> None:
        def protocol() -> asyncio.Protocol:
            return H11Protocol(
                config=self.config, server_state=self.server_state, app_state=self.lifespan.state
            )

        try:
            await asyncio.get_running_loop().connect_accepted_socket(
                protocol,
                peer,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else HANDSHAKE_S,
            )
        except OSError:
            peer.close()  # the peer has closed it meanwhile, or speaks no TLS

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop; keep watching until the last connection has ended."""
        aborting = asyncio.create_task(self._abort_requests())
        await super().shutdown(sockets)
        aborting.cancel()
        if self._watching is not None:
            self._watching.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._watching

    async def _abort_requests(self) -> None:
        """Abort, after `GRACE_S`, the connections that are still open, and cancel their requests.

        A peer that does not read would keep its connection open for ever. A request is aborted first, so that
        it finds its client gone and its cancellation is no error.
        """
        await asyncio.sleep(GRACE_S)
        for connection in list(self.watched):
            connection.transport.abort()
        for task in list(self.server_state.tasks):
            task.cancel()


def allow_open_files() -> int:
    """Raise this process's limit of open files towards `OPEN_FILES`; return the new limit."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = OPEN_FILES if hard == resource.RLIM_INFINITY else min(OPEN_FILES, hard)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return soft
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    except (OSError, ValueError):  # macOS allows fewer than its hard limit says
        return soft
    return wanted
