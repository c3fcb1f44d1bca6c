"""Checks host, origin, sign-in or token, and right of every request and WebSocket."""

import hashlib
import hmac
import re
import socket
from collections.abc import Callable, Collection
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
from foveacam_server.accounts.rights import ANONYMOUS, LOCAL, SHARED, Principal, Right
from foveacam_server.accounts.route_rights import SAFE_METHODS, Access, RouteTable
from foveacam_server.accounts.service_tokens import PREFIX
from foveacam_server.accounts.tables import equal
from foveacam_server.console.refusals import (
    Refusal,
    control_character,
    foreign_host,
    foreign_origin,
    lacking,
    no_credentials,
    too_many_tries,
    unknown_path,
)

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Control characters, and the line breaks that Unicode adds."""
_PAGE_SCHEMES = {"ws": "http", "wss": "https"}


@dataclass(slots=True, kw_only=True)
class AccessRules:
    """The rules of one server; callable from any thread."""

    routes: RouteTable
    """The routes of the guarded application."""
    token: str | None
    """The shared token; None: there is none."""
    origins: frozenset[str]
    """Origins of other sites that may control the rig."""
    loopback: bool
    """Whether only this machine can reach the server."""
    hosts: frozenset[str]
    """Host names that are allowed while no authentication is required (`own_hosts`)."""
    insecure: bool = False
    """Whether the server is open to everybody who reaches it."""
    accounts: Accounts | None = None
    """The accounts, opened with the server; None before."""
    viewers_may_stop: Callable[[], bool] = lambda: False
    """Whether the rig file lets viewers stop the mirrors."""
    openid_name: str | None = None
    """Name of the OpenID provider on its sign-in button; None without one."""
    attempts: WrongAttempts = field(default_factory=WrongAttempts)
    """Counts wrong shared tokens by address."""

    @property
    def mode(self) -> Mode:
        """Authentication that the server requires now."""
        if self.accounts is not None:
            return self.accounts.mode
        return mode_without_users(shared_token=self.token is not None, guarded=self.guarded)

    @property
    def guarded(self) -> bool:
        """Whether authentication is required: others can reach the server, and it is not declared open."""
        return not (self.loopback or self.insecure)

    def check(self, scope: Scope) -> Principal | Refusal:
        """Return the principal of an admitted request or WebSocket, or the refusal."""
        foreign = self.check_site(scope)
        if foreign is not None:
            return foreign
        access = scope["access"] = self.routes.access(scope)
        found = self._identify(scope, Headers(scope=scope), stops=access is not None and access.stops)
        if access is not None and access.right is None:
            return ANONYMOUS if isinstance(found, Refusal) else found
        if isinstance(found, Refusal):
            return found
        return unknown_path(found, scope) if access is None else self._authorise(found, access, scope)

    def _authorise(self, found: Principal, access: Access, scope: Scope) -> Principal | Refusal:
        right = access.right
        viewer_stops = access.stops and found.may(Right.VIEW) and self.viewers_may_stop()
        return found if right is None or found.may(right) or viewer_stops else lacking(found, right, scope)

    def audit(self, found: Principal | Refusal, scope: Scope, *, status: int) -> None:
        """Record a change or attempt in the audit log; the WebSocket of pictures changes nothing."""
        changes = scope["type"] == "http" and scope["method"] not in SAFE_METHODS
        if self.accounts is None or status == 0 or not (changes or self._steers(scope)):
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

    def _steers(self, scope: Scope) -> bool:
        access = self.routes.access(scope) if scope["type"] == "websocket" else None
        return access is not None and access.right is Right.OPERATE

    def admits_token(self, token: str, *, address: str) -> bool:
        """Return whether `token` is the shared one; False after too many wrong ones."""
        if self.token is None or self.attempts.wait_s(address) > 0.0:
            return False
        right = equal(token, self.token)
        if not right:
            self.attempts.add_wrong(address)
        return right

    @property
    def cookie(self) -> str:
        """The cookie of a browser that has shown the shared token, derived from it but not revealing it."""
        return hmac.digest((self.token or "").encode(), b"foveacam browser session", hashlib.sha256).hex()

    def check_site(self, scope: Scope) -> Refusal | None:
        """Refuse an invalid path, a page of another site, and a foreign name of this server."""
        if _CONTROL.search(scope["path"]):
            return control_character(scope["path"])
        headers = Headers(scope=scope)
        if (self.loopback or self.mode is Mode.OPEN) and not self._host_allowed(headers):
            return foreign_host(headers.get("host", ""), self.hosts)
        unsafe = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        origin = headers.get("origin")
        if unsafe and origin is not None and not self._origin_allowed(origin, headers, scope):
            return foreign_origin(origin)
        return None

    def _identify(self, scope: Scope, headers: Headers, *, stops: bool) -> Principal | Refusal:
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
            return self._check_token(given, scope, stops=stops)
        return no_credentials(first_admin=mode is Mode.FIRST_ADMIN)

    def _of_cookie(self, cookie: str) -> Principal | None:
        if not cookie:
            return None
        if self.token is not None and equal(cookie, self.cookie):
            return SHARED
        return None if self.accounts is None else self.accounts.sign_ins.find(cookie)

    def _check_token(self, given: str, scope: Scope, *, stops: bool) -> Principal | Refusal:
        if stops and self.token is not None and equal(given, self.token):
            return SHARED  # despite wrong attempts from its address: the stop is never withheld
        address = address_of(scope)
        wait_s = self.attempts.wait_s(address)
        if wait_s > 0.0:
            return too_many_tries(wait_s)
        return SHARED if self.admits_token(given, address=address) else no_credentials(first_admin=False)

    def _host_allowed(self, headers: Headers) -> bool:
        """Check the host name of the request, against DNS rebinding by another site's name.

        Numeric addresses are allowed, and for a server that only this machine can reach, this machine's own
        names.
        """
        name = _host_name(headers.get("host", ""))
        try:
            address = ip_address(name)
        except ValueError:
            return name in self.hosts
        return address.is_loopback or not self.loopback or name in self.hosts

    def _origin_allowed(self, origin: str, headers: Headers, scope: Scope) -> bool:
        scheme = scope.get("scheme", "http")
        own = f"{_PAGE_SCHEMES.get(scheme, scheme)}://{headers.get('host', '').lower()}"
        return origin in self.origins or origin.lower() == own


def own_hosts(host: str, *, origins: Collection[str]) -> frozenset[str]:
    """Return the host names that are allowed while no authentication is required.

    They are those of this machine, the one it listens on, and those of origins that may control the rig
    anyway.
    """
    machine = socket.gethostname().lower()
    listed = {_host_name(urlsplit(origin).netloc) for origin in origins}
    names = {"localhost", host.lower(), machine, f"{machine.partition('.')[0]}.local", *listed}
    return frozenset(names - {"", "0.0.0.0", "::"})  # noqa: S104 - compared with, not listened on


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
