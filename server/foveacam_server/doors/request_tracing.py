"""ASGI middleware for diagnosis of requests: id, log line, trace."""

import logging
import time
from collections.abc import Mapping
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_hardware.contract.spans import CURRENT_SPAN, Attribute
from foveacam_server.foundation.watching.tracing import TracedSpan, Traces
from foveacam_server.foundation.watching.work_ids import REQUEST_HEADER, REQUEST_ID, begin_request

_log = logging.getLogger(__name__)
_ANSWERS = frozenset({"http.response.start", "websocket.http.response.start", "websocket.accept"})
_READING = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods traced only when the caller has begun a trace, as pages request documents every second."""
CALLER = "traceparent"


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
    """Log a request without its query, which may contain a secret; reading requests only at DEBUG."""
    method = scope.get("method", "WebSocket")
    level = logging.DEBUG if method in ("GET", "HEAD") else logging.INFO
    path = quote(scope["path"])  # a line break in it would begin another line
    _log.log(level, "%s %s: %s after %.1f ms", method, path, status or "open", 1e3 * took_s)


class RequestTraces:
    """Makes a request a span of a trace, while the application sends traces."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        headers = Headers(scope=scope) if scope["type"] == "http" else Headers()
        traces = self._traces(scope, headers)
        if traces is None:
            CURRENT_SPAN.set(None)  # not the span of an earlier request on the connection
            await self._app(scope, receive, send)
            return
        request = _TracedRequest(traces, scope, headers, send)
        CURRENT_SPAN.set(request.span)
        try:
            await self._app(scope, receive, request.send)
        except BaseException as error:
            request.end(error)
            raise
        request.end()

    def _traces(self, scope: Scope, headers: Mapping[str, str]) -> Traces | None:
        if scope["type"] != "http" or (scope["method"] in _READING and CALLER not in headers):
            return None
        found = getattr(scope["app"].state, "traces", None)
        return found if isinstance(found, Traces) else None


class _TracedRequest:
    """The span of a request; route and status are set while it is served."""

    def __init__(self, traces: Traces, scope: Scope, headers: Mapping[str, str], send: Send) -> None:
        self._scope, self._send = scope, send
        self._known: dict[str, Attribute] = {"http.request.method": scope["method"]}
        self._known["foveacam.request_id"] = REQUEST_ID.get() or ""
        self.span: TracedSpan = traces.begin(scope["method"], headers, self._known)

    async def send(self, message: Message) -> None:
        """Send a message of the answer."""
        if message["type"] == "http.response.start":
            self._known["http.response.status_code"] = message["status"]
        await self._send(message)

    def end(self, error: BaseException | None = None) -> None:
        """End the span."""
        route = getattr(self._scope.get("route"), "path", None)
        if route is not None:
            self._known["http.route"] = route
        self.span.describe(f"{self._scope['method']} {route or 'other'}", self._known)
        self.span.end(error)
