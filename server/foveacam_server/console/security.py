"""Applies the access rules to every request and WebSocket, adds the security headers, writes the audit log.

One ASGI middleware around everything, because CORS checks neither WebSockets nor body-less POSTs. It ends a
connection at once when the sign-in or token that opened it is revoked.
"""

import asyncio
from urllib.parse import parse_qsl, urlencode

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.cookies import set_cookie
from foveacam_server.accounts.requests import address_of
from foveacam_server.accounts.rights import Principal
from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.console import openid, sign_in
from foveacam_server.console.access_rules import AccessRules, own_hosts
from foveacam_server.console.listed_origins import ListedOrigins
from foveacam_server.console.page_policy import content_policy
from foveacam_server.console.refusals import Refusal
from foveacam_server.foundation.errors import UNAUTHORIZED
from foveacam_server.foundation.settings import Settings

HSTS_S = 31_536_000
"""HSTS: time for which a browser that came by https uses only https."""
_POLICY_VIOLATION = 1008
_SWITCHING_PROTOCOLS = 101
SIGNED_OUT = 4401
"""Close code of a WebSocket whose sign-in was revoked."""


class SecurityMiddleware:
    """Applies the access rules, and adds the security headers to every answer."""

    def __init__(self, app: ASGIApp, *, gate: AccessRules) -> None:
        self._app = app
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        audited = _AuditedSend(_with_headers(send, scope))
        signed_in = self._sign_in_by_link(scope)
        if signed_in is not None:
            await signed_in(scope, receive, audited)
            return
        scope["audit_note"] = AuditNote()
        found = self._gate.check(scope)
        try:
            if isinstance(found, Refusal):
                await self._refuse(found, scope, receive, audited)
            else:
                scope["principal"] = found
                await self._serve(found, scope, receive, audited)
        finally:
            self._gate.audit(found, scope, status=audited.status)

    async def _serve(self, principal: Principal, scope: Scope, receive: Receive, send: Send) -> None:
        lasting = scope["type"] == "websocket" or scope["method"] == "GET"
        if principal.streams_id is None or not lasting or self._gate.accounts is None:
            await self._app(scope, receive, send)
            return
        connection = OpenConnection(scope, receive, send)
        with self._gate.accounts.streams.opened(principal.streams_id, connection.end):
            if isinstance(self._gate.check(scope), Refusal):  # revoked between the check and here
                connection.end()
            try:
                await self._app(scope, connection.receive, connection.send)
            finally:
                await connection.release()

    async def _refuse(self, refusal: Refusal, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await _refuse_websocket(refusal, scope, receive, send)
            return
        if refusal.ask and "text/html" in Headers(scope=scope).get("accept", ""):
            page = sign_in.page_of(self._gate)
            headers = {"Referrer-Policy": sign_in.REFERRER_POLICY}
            answer: Response = HTMLResponse(page, status_code=UNAUTHORIZED.status, headers=headers)
        else:
            answer = refusal.problem.response(instance=scope["path"])
        await answer(scope, receive, send)

    def _sign_in_by_link(self, scope: Scope) -> Response | None:
        """Return the answer to `/?token=…`: the cookie and a redirect to the URL without the token."""
        if scope["type"] != "http" or scope["method"] != "GET" or b"token=" not in scope["query_string"]:
            return None
        access = self._gate.routes.access(scope)
        if access is None or not access.takes_token or self._gate.check_site(scope) is not None:
            return None
        query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        token = next((value for name, value in query if name == "token"), "")
        if not self._gate.admits_token(token, address=address_of(scope)):
            return None
        rest = urlencode([(name, value) for name, value in query if name != "token"])
        answer = RedirectResponse("/?" + rest if rest else "/", status_code=303)
        set_cookie(answer, self._gate.cookie, secure=scope.get("scheme") == "https")
        return answer


class _AuditedSend:
    """Sends the messages of an answer, and keeps its status; 0 before it begins."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self.status = 0

    async def __call__(self, message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            self.status = int(message["status"])
        elif message["type"] == "websocket.accept":
            self.status = _SWITCHING_PROTOCOLS
        await self._send(message)


def install(app: FastAPI, settings: Settings) -> AccessRules:
    """Guard `app`, serve the sign-in pages, and return the rules."""
    token = settings.token.get_secret_value() if settings.token is not None else None
    gate = AccessRules(
        routes=RouteTable(app.routes),
        token=token or None,
        origins=frozenset(settings.allowed_origins),
        loopback=settings.loopback,
        hosts=own_hosts(settings.host, origins=settings.allowed_origins),
        insecure=settings.insecure,
    )
    app.add_middleware(SecurityMiddleware, gate=gate)
    if gate.origins:
        app.add_middleware(ListedOrigins, origins=gate.origins)
    app.include_router(sign_in.router(gate))
    openid.install(app, settings, gate)
    return gate


def _with_headers(send: Send, scope: Scope) -> Send:
    encrypted = scope.get("scheme") in ("https", "wss")

    async def guarded(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            put_security_headers(headers)
            if encrypted:
                headers["Strict-Transport-Security"] = f"max-age={HSTS_S}"
        await send(message)

    return guarded


def put_security_headers(headers: MutableHeaders) -> None:
    """Add the security headers to an answer."""
    headers.setdefault("X-Content-Type-Options", "nosniff")
    headers.setdefault("Referrer-Policy", "no-referrer")
    headers.setdefault("Cross-Origin-Opener-Policy", "same-origin")
    headers.setdefault("Cross-Origin-Resource-Policy", "same-origin")
    headers.setdefault("X-Frame-Options", "SAMEORIGIN")
    headers.setdefault("Content-Security-Policy", content_policy())


async def _refuse_websocket(refusal: Refusal, scope: Scope, receive: Receive, send: Send) -> None:
    await receive()  # websocket.connect
    if "websocket.http.response" not in scope.get("extensions", {}):
        reason = refusal.problem.detail[:120]
        await send({"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": reason})
        return
    answer = refusal.problem.response(instance=scope["path"])
    await send(
        {
            "type": "websocket.http.response.start",
            "status": answer.status_code,
            "headers": answer.raw_headers,
        }
    )
    await send({"type": "websocket.http.response.body", "body": answer.body})


class OpenConnection:
    """Wraps the messages between the server and the application for one WebSocket or GET."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._websocket = scope["type"] == "websocket"
        self._receive, self._send = receive, send
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._waiting: asyncio.Task[Message] | None = None
        self._closed = False
        self._unfinished = False
        """Whether an answer has begun and not ended."""

    def end(self) -> None:
        """End the connection; callable from any thread."""
        self._loop.call_soon_threadsafe(self._ended.set)

    async def receive(self) -> Message:
        """Return the next message of the peer; a disconnect once the connection was ended."""
        if self._waiting is None:
            self._waiting = asyncio.create_task(_awaited(self._receive))
        ended = asyncio.create_task(self._ended.wait())
        try:
            await asyncio.wait({self._waiting, ended}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            ended.cancel()
        if self._ended.is_set():
            return await self._leave()
        message, self._waiting = self._waiting.result(), None
        return message

    async def send(self, message: Message) -> None:
        """Send a message; raise `OSError`, as for a disconnected peer, once the connection was ended."""
        if self._ended.is_set():
            await self._leave()
            raise OSError("the sign-in of this connection was revoked")
        await self._send(message)
        if not self._websocket:
            self._unfinished = message["type"] == "http.response.start" or message.get("more_body", False)

    async def release(self) -> None:
        """Stop waiting for the peer, and complete the answer if the application was interrupted in it."""
        if self._waiting is not None:
            self._waiting.cancel()
        if self._unfinished and self._ended.is_set():
            await self._send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _leave(self) -> Message:
        if not self._websocket:
            return {"type": "http.disconnect"}
        if not self._closed:
            self._closed = True
            await self._send({"type": "websocket.close", "code": SIGNED_OUT, "reason": "signed out"})
        return {"type": "websocket.disconnect", "code": SIGNED_OUT, "reason": "signed out"}


async def _awaited(receive: Receive) -> Message:
    return await receive()
