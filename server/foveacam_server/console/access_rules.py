"""Checks host, origin, sign-in or token, and right of every request and WebSocket."""

import hashlib
import hmac
from collections.abc import Callable
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import Scope

from foveacam_server.accounts.accounts import Accounts, Mode, mode_without_users
from foveacam_server.accounts.attempts import WrongAttempts
from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.requests import address_of
from foveacam_server.accounts.rights import LOCAL, NOBODY, SHARED, Principal, Right
from foveacam_server.accounts.route_rights import OPEN_CALLS, OPEN_PATHS, WEBSOCKETS, needed_right
from foveacam_server.accounts.service_tokens import PREFIX
from foveacam_server.accounts.tables import equal
from foveacam_server.console.refusals import (
    Refusal,
    foreign_host,
    foreign_origin,
    lacking,
    no_credentials,
    too_many_tries,
)

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
STOP_PATH = "/api/v1/stop"
OPENID_PATH = "/sign_in/openid"
OPENID_CALLBACK = "/sign_in/openid/callback"
SIGN_IN_PATHS = frozenset({"/sign_in", "/join", OPENID_PATH, OPENID_CALLBACK})
"""Pages and forms by which one signs in."""
_PAGE_SCHEMES = {"ws": "http", "wss": "https"}


@dataclass(slots=True, kw_only=True)
class AccessRules:
    """The rules of one server; callable from any thread."""

    token: str | None
    """The one token that all may share; None: there is none."""
    origins: frozenset[str]
    """Origins of other sites that may control the rig."""
    loopback: bool
    """Whether only this machine can reach the server."""
    host: str
    insecure: bool = False
    """Whether the server is open to whoever reaches it."""
    accounts: Accounts | None = None
    """Opened with the server; None before."""
    viewers_may_stop: Callable[[], bool] = lambda: False
    """Whether the rig's file lets those who may only look stop the mirrors."""
    openid_name: str | None = None
    """What the button for signing in by a provider says; None: there is none."""
    attempts: WrongAttempts = field(default_factory=WrongAttempts)
    """Wrong shared tokens by address."""

    @property
    def mode(self) -> Mode:
        """What the server asks of whoever comes."""
        if self.accounts is not None:
            return self.accounts.mode
        return mode_without_users(shared_token=self.token is not None, guarded=self.guarded)

    @property
    def guarded(self) -> bool:
        """Whether the server must know who comes: others can reach it, and it is not declared open."""
        return not (self.loopback or self.insecure)

    def check(self, scope: Scope) -> Principal | Refusal:
        """Return who an admitted request or WebSocket comes from, or why it is refused."""
        headers = Headers(scope=scope)
        foreign = self._check_site(scope, headers)
        if foreign is not None:
            return foreign
        found = self._identify(scope, headers)
        if is_open_call(scope):
            return NOBODY if isinstance(found, Refusal) else found
        if isinstance(found, Refusal):
            return found
        right = needed_right(scope["type"], scope.get("method", "GET"), scope["path"])
        if found.may(right) or (_stops(scope) and found.may(Right.VIEW) and self.viewers_may_stop()):
            return found
        return lacking(found, right, scope)

    def audit(self, found: Principal | Refusal, scope: Scope, *, status: int) -> None:
        """Write a change that was made or tried into the audit log; pictures by WebSocket change nothing."""
        changes = scope["type"] == "http" and scope["method"] not in SAFE_METHODS
        steers = scope["type"] == "websocket" and WEBSOCKETS.get(scope["path"]) is Right.OPERATE
        if self.accounts is None or status == 0 or not (changes or steers):
            return
        note = scope.get("audit_note") or AuditNote()
        self.accounts.audit.add(
            note.who or (found.principal if isinstance(found, Refusal) else found),
            method=scope.get("method", "WebSocket"),
            path=scope["path"],
            address=address_of(scope),
            status=status,
            what=getattr(scope.get("route"), "summary", None) or "",
            detail=note.detail,
        )

    def admits_token(self, token: str, *, address: str) -> bool:
        """Return whether `token` is the shared one; after too many wrong ones none is admitted."""
        if self.token is None or self.attempts.wait_s(address) > 0.0:
            return False
        right = equal(token, self.token)
        if not right:
            self.attempts.add_wrong(address)
        return right

    @property
    def cookie(self) -> str:
        """The cookie of who knows the shared token, which it is derived from and does not reveal."""
        return hmac.digest((self.token or "").encode(), b"foveacam browser session", hashlib.sha256).hex()

    def _check_site(self, scope: Scope, headers: Headers) -> Refusal | None:
        """Refuse a page of another site, and another site's name that leads here."""
        if self.loopback and not self._host_allowed(headers):
            return foreign_host(headers.get("host", ""), self.host)
        unsafe = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        origin = headers.get("origin")
        if unsafe and origin is not None and not self._origin_allowed(origin, headers, scope):
            return foreign_origin(origin)
        return None

    def _identify(self, scope: Scope, headers: Headers) -> Principal | Refusal:
        mode = self.mode
        signed_in = self._of_cookie(cookie_of(headers))
        if signed_in is not None:
            return signed_in
        given = token_of(headers)
        if (
            given is not None
            and given != self.token
            and given.startswith(PREFIX)
            and self.accounts is not None
        ):
            return self.accounts.tokens.find(given) or no_credentials(first_admin=False)
        if mode is Mode.OPEN:
            return LOCAL
        if given is not None and self.token is not None:
            return self._check_token(given, scope)
        return no_credentials(first_admin=mode is Mode.FIRST_ADMIN)

    def _of_cookie(self, cookie: str) -> Principal | None:
        if not cookie:
            return None
        if self.token is not None and equal(cookie, self.cookie):
            return SHARED
        return None if self.accounts is None else self.accounts.sign_ins.find(cookie)

    def _check_token(self, given: str, scope: Scope) -> Principal | Refusal:
        if _stops(scope) and self.token is not None and equal(given, self.token):
            return SHARED  # whatever others at its address have tried: the stop is never withheld
        address = address_of(scope)
        wait_s = self.attempts.wait_s(address)
        if wait_s > 0.0:
            return too_many_tries(wait_s)
        return SHARED if self.admits_token(given, address=address) else no_credentials(first_admin=False)

    def _host_allowed(self, headers: Headers) -> bool:
        """Check the host name of the request: another site may let its own name resolve to this server."""
        name = _host_name(headers.get("host", ""))
        return name in ("localhost", self.host) or _loopback_address(name)

    def _origin_allowed(self, origin: str, headers: Headers, scope: Scope) -> bool:
        scheme = scope.get("scheme", "http")
        own = f"{_PAGE_SCHEMES.get(scheme, scheme)}://{headers.get('host', '').lower()}"
        return origin in self.origins or origin.lower() == own


def _stops(scope: Scope) -> bool:
    return scope["path"] == STOP_PATH and scope.get("method") == "POST"


def is_open_call(scope: Scope) -> bool:
    """Return whether a request is served to anybody: a probe, or one by which somebody signs in."""
    if scope["type"] != "http":
        return False
    path = scope["path"]
    return path in OPEN_PATHS or path in SIGN_IN_PATHS or (scope["method"], path) in OPEN_CALLS


def token_of(headers: Headers) -> str | None:
    """Return the token of a request; None without one."""
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    return credentials.strip() if scheme.lower() == "bearer" else headers.get("x-api-token")


def cookie_of(headers: Headers) -> str:
    """Return the cookie of a browser that has signed in; empty without one."""
    try:
        jar = SimpleCookie(headers.get("cookie", ""))
    except CookieError:
        return ""
    return jar[COOKIE].value if COOKIE in jar else ""


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
