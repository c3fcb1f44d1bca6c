"""ASGI middleware: refusals as problem documents, HEAD for every GET, unbuffered streams, timings.

FastAPI enforces `max_body_size` of a router or route and answers in plain text; here that answer is replaced.
"""

import time
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.body_limit import MAX_BODY_SIZE_SCOPE_KEY
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_server.doors.error_handlers import problem_of_status
from foveacam_server.foundation.errors import HEADERS_TOO_LARGE, TOO_LARGE, ProblemDetails
from foveacam_server.foundation.http.answers import BODY_BYTES, MIB
from foveacam_server.foundation.watching import timings


class FrameworkProblems:
    """ASGI middleware: replaces refusals of the framework in plain text (400, 413, 416) by problems."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        await self._app(scope, receive, _AnswerSender(scope, receive, send).send)


HEADER_BYTES = 16 * 1024
"""Most bytes of a request's path, query and headers."""


class HeaderLimit:
    """ASGI middleware: answers 431 to a request whose line and headers are larger than `HEADER_BYTES`.

    The parser's own limit applies only to headers that arrive in pieces.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] == "http" and (size := _header_bytes(scope)) > HEADER_BYTES:
            problem = ProblemDetails(
                kind=HEADERS_TOO_LARGE,
                detail=f"The request has {size} bytes of line and headers; at most {HEADER_BYTES} are taken.",
                asked=f"{size} bytes of headers",
                found=f"a limit of {HEADER_BYTES} bytes",
                remedy="Send less in the address and the headers; what is long belongs into the body.",
            )
            await problem.response()(scope, receive, send)
            return
        await self._app(scope, receive, send)


def _header_bytes(scope: Scope) -> int:
    line = len(scope.get("raw_path") or b"") + len(scope["query_string"])
    return line + sum(len(name) + len(value) for name, value in scope["headers"])


class _AnswerSender:
    """Sends one answer; replaces a refusal in plain text by a problem document."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._scope = scope
        self._receive = receive
        self._send = send
        self._replaced = False

    async def send(self, message: Message) -> None:
        """Send a message; in place of all messages of a refusal in plain text, send the problem document."""
        if message["type"] == "http.response.start" and _is_no_problem(message):
            self._replaced = True
            problem = _problem(self._scope, message)
            await problem.response(instance=self._scope["path"])(self._scope, self._receive, self._send)
        elif not self._replaced:
            await self._send(message)


def _is_no_problem(start: Message) -> bool:
    if start["status"] == TOO_LARGE.status:
        return True
    kind = Headers(raw=start["headers"]).get("content-type", "")
    return start["status"] >= HTTPStatus.BAD_REQUEST and kind.startswith("text/plain")


def _problem(scope: Scope, start: Message) -> ProblemDetails:
    if start["status"] == TOO_LARGE.status:
        return _too_large(scope)
    headers = Headers(raw=start["headers"])
    kept = {name: headers[name] for name in _KEPT_HEADERS if name in headers}
    return problem_of_status(start["status"], path=scope["path"], method=scope["method"], headers=kept)


_KEPT_HEADERS = ("Allow", "Content-Range", "Retry-After", "WWW-Authenticate")


def _too_large(scope: Scope) -> ProblemDetails:
    most_bytes = int(scope.get(MAX_BODY_SIZE_SCOPE_KEY, BODY_BYTES))
    announced = Headers(scope=scope).get("content-length")
    found = f"{int(announced) / MIB:.1f} MiB" if announced else f"more than {most_bytes / MIB:g} MiB"
    most = f"{most_bytes / MIB:g} MiB"
    return ProblemDetails(
        kind=TOO_LARGE,
        detail=f"{scope['path']} takes at most {most}, and the request's body has {found}.",
        asked=f"a body of {found}",
        found=f"a limit of {most}",
        remedy="Send less; the size is that of the whole body.",
    )


class UncollectedStreams:
    """ASGI middleware: tells proxies not to buffer answers without a length.

    These are endless streams (pictures, events), which a buffering proxy would delay more and more, and
    archives made while they are sent.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_marked(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] not in _WITHOUT_BODY:
                headers = MutableHeaders(scope=message)
                if "content-length" not in headers:
                    headers["X-Accel-Buffering"] = "no"
            await send(message)

        await self._app(scope, receive, send_marked)


_WITHOUT_BODY = (204, 304)


class HeadRequests:
    """ASGI middleware: answers HEAD with the headers of GET, and ends the route before its body."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def send_headers(message: Message) -> None:
            await send(message)
            if message["type"] == "http.response.start":
                await send({"type": "http.response.body", "body": b"", "more_body": False})
                raise _HeadersSent

        try:
            await self._app({**scope, "method": "GET"}, receive, send_headers)
        except* _HeadersSent:
            pass  # alone, or in the exception group of a stream


class _HeadersSent(Exception):
    """Raised to end the GET after its headers."""


_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""Known methods; others, which a client may invent, share one label."""


class RequestTimes:
    """ASGI middleware: observes the time until an answer begins, by method, route and status."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began_s = time.perf_counter()

        async def send_timed(message: Message) -> None:
            if message["type"] == "http.response.start":
                route = getattr(scope.get("route"), "path", "other")
                method = scope["method"] if scope["method"] in _METHODS else "other"
                took_s = time.perf_counter() - began_s
                timings.REQUEST.labels(method, route, str(message["status"])).observe(took_s)
            await send(message)

        await self._app(scope, receive, send_timed)
