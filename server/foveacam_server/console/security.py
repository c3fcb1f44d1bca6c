"""Checks origin, host and token of every request and WebSocket, and adds the security headers.

One ASGI middleware around everything, because CORS checks neither WebSockets nor body-less POSTs.
What an admitted request may do is left to the routes.
"""

import hashlib
import hmac
import math
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qsl, urlencode, urlsplit

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_hardware.contract import InvalidInput
from foveacam_server.console.page_policy import content_policy
from foveacam_server.console.sign_in import REFERRER_POLICY, read_form_token, sign_in_page
from foveacam_server.doors.token_attempts import TokenAttempts
from foveacam_server.foundation.errors import FORBIDDEN_ORIGIN, TOO_MANY_TRIES, UNAUTHORIZED, ProblemDetails
from foveacam_server.foundation.settings import Settings

COOKIE = "foveacam_session"
_COOKIE_DAYS = 30
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
STOP_PATH = "/api/v1/stop"
OPEN_PATHS = frozenset({"/healthz"})
_POLICY_VIOLATION = 1008
_PAGE_SCHEMES = {"ws": "http", "wss": "https"}


@dataclass(frozen=True, slots=True)
class _Refusal:
    """A refused request; `ask`: whether a token would admit it."""

    problem: ProblemDetails
    ask: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessRules:
    """The rules of one server: its token, the allowed foreign origins, whether it serves loopback only."""

    token: str | None
    origins: frozenset[str]
    loopback: bool
    host: str
    attempts: TokenAttempts = field(default_factory=TokenAttempts)

    def check(self, scope: Scope) -> _Refusal | None:
        """Return why a request or WebSocket is refused; None when it is admitted."""
        headers = Headers(scope=scope)
        unsafe = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        if self.loopback and not self._host_allowed(headers):
            return _Refusal(_foreign_host(headers.get("host", ""), self.host))
        origin = headers.get("origin")
        scheme = scope.get("scheme", "http")
        if unsafe and origin is not None and not self._origin_allowed(origin, headers, scheme):
            return _Refusal(_foreign_origin(origin))
        if self.token is None or scope["path"] in OPEN_PATHS or _equal(_cookie(headers), self.cookie):
            return None
        given = _token(headers)
        stops = scope["path"] == STOP_PATH and scope.get("method") == "POST"
        if stops and given is not None and _equal(given, self.token):
            return None  # whatever others at its address have tried: the stop is never withheld
        return self._check_token(given, address=_address(scope))

    def _check_token(self, given: str | None, *, address: str) -> _Refusal | None:
        wait_s = self.attempts.wait_s(address)
        if given is not None and wait_s > 0.0:
            return _Refusal(_too_many_tries(wait_s))
        if given is not None and self.admits(given, address=address):
            return None
        return _Refusal(_no_token(), ask=True)

    def admits(self, token: str, *, address: str) -> bool:
        """Return whether `token` is the server's; after too many wrong ones none is admitted."""
        if self.token is None or self.attempts.wait_s(address) > 0.0:
            return False
        right = _equal(token, self.token)
        if not right:
            self.attempts.add_wrong(address)
        return right

    @property
    def cookie(self) -> str:
        """The cookie's value: derived from the token, which cannot be derived from it."""
        return hmac.digest((self.token or "").encode(), b"foveacam browser session", hashlib.sha256).hex()

    def _host_allowed(self, headers: Headers) -> bool:
        """Check the host name of the request: another site may let its own name resolve to this server."""
        name = _host_name(headers.get("host", ""))
        return name in ("localhost", self.host) or _loopback_address(name)

    def _origin_allowed(self, origin: str, headers: Headers, scheme: str) -> bool:
        own = f"{_PAGE_SCHEMES.get(scheme, scheme)}://{headers.get('host', '').lower()}"
        return origin in self.origins or origin.lower() == own


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
        guarded = _with_headers(send, path=scope["path"])
        signed_in = self._sign_in(scope)
        if signed_in is not None:
            await signed_in(scope, receive, guarded)
            return
        refusal = self._gate.check(scope)
        if refusal is None:
            await self._app(scope, receive, guarded)
        elif refusal.ask and (token := await read_form_token(scope, receive)) is not None:
            await self._answer_form(scope, token)(scope, receive, guarded)
        elif scope["type"] == "websocket":
            await _refuse_websocket(refusal, scope, receive, guarded)
        else:
            await _answer(refusal, scope)(scope, receive, guarded)

    def _sign_in(self, scope: Scope) -> Response | None:
        """Return the answer to `/?token=…`: the cookie and a redirect to the URL without the token."""
        if scope["type"] != "http" or scope["method"] != "GET" or b"token=" not in scope["query_string"]:
            return None
        query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        token = next((value for name, value in query if name == "token"), "")
        if scope["path"] != "/" or not self._gate.admits(token, address=_address(scope)):
            return None
        rest = urlencode([(name, value) for name, value in query if name != "token"])
        return self._with_cookie(scope, "/?" + rest if rest else "/")

    def _answer_form(self, scope: Scope, token: str) -> Response:
        """Return the answer to the sign-in form: the console with the cookie, or the form with the reason."""
        address = _address(scope)
        if self._gate.admits(token, address=address):
            return self._with_cookie(scope, "/")
        wait_s = self._gate.attempts.wait_s(address)
        if wait_s > 0.0:
            problem = _too_many_tries(wait_s)
            return _ask_for_token(problem.detail, status=problem.kind.status)
        return _ask_for_token("This is not the token of this server.")

    def _with_cookie(self, scope: Scope, location: str) -> Response:
        answer = RedirectResponse(location, status_code=303)
        answer.set_cookie(
            COOKIE,
            self._gate.cookie,
            max_age=_COOKIE_DAYS * 86_400,
            httponly=True,
            samesite="lax",
            secure=scope.get("scheme") == "https",
        )
        return answer


def install(app: FastAPI, settings: Settings) -> AccessRules:
    """Guard `app`, return the rules; raise `InvalidInput` if it were open to the network without a token."""
    token = settings.token.get_secret_value() if settings.token is not None else None
    if not settings.loopback and not token:
        raise InvalidInput(
            f"host {settings.host} can be reached from other machines, and no token is set; "
            "set FOVEACAM_TOKEN (or --token) to a secret of your choice, or use --host 127.0.0.1",
            asked=f"host {settings.host}",
            found="no token",
            remedy="set FOVEACAM_TOKEN, or use --host 127.0.0.1",
        )
    gate = AccessRules(
        token=token or None,
        origins=frozenset(origin.rstrip("/") for origin in settings.allowed_origins),
        loopback=settings.loopback,
        host=settings.host,
    )
    app.add_middleware(SecurityMiddleware, gate=gate)
    return gate


def _with_headers(send: Send, *, path: str) -> Send:
    async def guarded(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            put_security_headers(MutableHeaders(scope=message), path=path)
        await send(message)

    return guarded


def put_security_headers(headers: MutableHeaders, *, path: str) -> None:
    """Add the security headers to an answer."""
    headers.setdefault("X-Content-Type-Options", "nosniff")
    headers.setdefault("Referrer-Policy", "no-referrer")
    headers.setdefault("Cross-Origin-Opener-Policy", "same-origin")
    headers.setdefault("Cross-Origin-Resource-Policy", "same-origin")
    headers.setdefault("X-Frame-Options", "SAMEORIGIN")
    headers.setdefault("Content-Security-Policy", content_policy(path))


def _answer(refusal: _Refusal, scope: Scope) -> Response:
    if refusal.ask and "text/html" in Headers(scope=scope).get("accept", ""):
        return _ask_for_token()
    return refusal.problem.response(instance=scope["path"])


def _ask_for_token(problem: str = "", *, status: int = UNAUTHORIZED.status) -> Response:
    headers = {"Referrer-Policy": REFERRER_POLICY}
    return HTMLResponse(sign_in_page(problem), status_code=status, headers=headers)


async def _refuse_websocket(refusal: _Refusal, scope: Scope, receive: Receive, send: Send) -> None:
    await receive()  # websocket.connect
    if "websocket.http.response" not in scope.get("extensions", {}):
        await send(
            {"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": refusal.problem.detail[:120]}
        )
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


def _foreign_origin(origin: str) -> ProblemDetails:
    return ProblemDetails(
        kind=FORBIDDEN_ORIGIN,
        detail=f"The page {origin} is not this server's own and may not control the rig.",
        asked=f"a request from {origin}",
        remedy="Open the console at the server's own address, add the origin to FOVEACAM_ALLOWED_ORIGINS, "
        "or name the proxy that speaks https in FOVEACAM_TRUSTED_PROXIES.",
    )


def _foreign_host(host: str, own: str) -> ProblemDetails:
    return ProblemDetails(
        kind=FORBIDDEN_ORIGIN,
        detail=f"This server answers to localhost and {own} only, and was called {host!r}.",
        asked=f"host {host!r}",
        remedy="Use http://127.0.0.1 with the port, or serve with --host and a token to be reached by name.",
    )


def _no_token() -> ProblemDetails:
    return ProblemDetails(
        kind=UNAUTHORIZED,
        detail="This server asks for a token, and none (or a wrong one) came with the request.",
        remedy="Send 'Authorization: Bearer TOKEN' or 'X-Api-Token: TOKEN', or sign in at / in a browser.",
        headers={"WWW-Authenticate": 'Bearer realm="foveacam"'},
    )


def _too_many_tries(wait_s: float) -> ProblemDetails:
    return ProblemDetails(
        kind=TOO_MANY_TRIES,
        detail=f"Too many wrong tokens came from this address; none is looked at for {wait_s:.0f} s.",
        remedy="Wait, then show the right one; a page that is signed in goes on.",
        headers={"Retry-After": str(math.ceil(wait_s))},
    )


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else "unknown"


def _token(headers: Headers) -> str | None:
    """Return the token of a request; None without one."""
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    return credentials.strip() if scheme.lower() == "bearer" else headers.get("x-api-token")


def _host_name(host: str) -> str:
    """Return the name in a Host header, without port and brackets, lower case."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
    except ValueError:  # a malformed IPv6 address is no valid host name
        return ""


def _loopback_address(name: str) -> bool:
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return False


def _cookie(headers: Headers) -> str:
    try:
        jar = SimpleCookie(headers.get("cookie", ""))
    except CookieError:
        return ""
    return jar[COOKIE].value if COOKIE in jar else ""


def _equal(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(), wanted.encode())
