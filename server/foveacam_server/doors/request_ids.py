"""ASGI middleware: gives each request its id, for the log lines of its work and for its answer."""

import logging
import time
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_server.foundation.watching.work_ids import REQUEST_HEADER, begin_request

_log = logging.getLogger(__name__)
_ANSWERS = frozenset({"http.response.start", "websocket.http.response.start", "websocket.accept"})


class RequestIds:
    """Sets the id of each request and WebSocket, sends it with the answer, and logs the request."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request_id, began_s = begin_request(Headers(scope=scope).get(REQUEST_HEADER)), time.perf_counter()

        async def send_with_id(message: Message) -> None:
            if message["type"] in _ANSWERS:
                message.setdefault("headers", [])
                MutableHeaders(scope=message)[REQUEST_HEADER] = request_id
                _log_answer(scope, message.get("status"), took_s=time.perf_counter() - began_s)
            await send(message)

        await self._app(scope, receive, send_with_id)


def _log_answer(scope: Scope, status: object, *, took_s: float) -> None:
    """Log a request without its query, which may hold a secret; reading is logged for who debugs alone."""
    method = scope.get("method", "WebSocket")
    level = logging.DEBUG if method in ("GET", "HEAD") else logging.INFO
    path = quote(scope["path"])  # a line break in it would begin another line
    _log.log(level, "%s %s: %s after %.1f ms", method, path, status or "open", 1e3 * took_s)
