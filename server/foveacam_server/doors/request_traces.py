"""ASGI middleware: begins the trace of a request that changes something, or that its caller traces."""

from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_hardware.contract.spans import CURRENT_SPAN, Attribute
from foveacam_server.foundation.watching.tracing import TracedSpan, Traces
from foveacam_server.foundation.watching.work_ids import REQUEST_ID

_READING = frozenset({"GET", "HEAD", "OPTIONS"})
"""Pages ask for documents every second: such a request has a trace where its caller has begun one."""
CALLER = "traceparent"


class RequestTraces:
    """Makes the work of a request part of a trace, while the application sends any."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        headers = Headers(scope=scope) if scope["type"] == "http" else Headers()
        traces = self._traces(scope, headers)
        if traces is None:
            CURRENT_SPAN.set(None)  # not that of an earlier request of the connection
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
    """The span of a request, which learns route and status while it is served."""

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
