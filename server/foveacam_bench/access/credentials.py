"""Credentials that must not be accepted: foreign, forged, replayed, expired and revoked ones."""

import random
import secrets
from collections.abc import Iterator
from itertools import cycle

from foveacam_bench.access.guarded import PASSWORD, GuardedServer, ServedRoute
from foveacam_bench.figures import Figures
from foveacam_hardware.contract import DeviceFault, FoveaError
from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.accounts.route_rights import declared_access
from foveacam_server.accounts.tables import ServiceTokenRow, SignInRow
from foveacam_server.foundation.store import Store

TRIED = 1200
_LONG_AGO = "2020-01-01T00:00:00.000Z"
_EVIL = {"origin": "http://evil.example"}


def foreign_figures(server: GuardedServer, store: Store, *, tried: int = TRIED) -> Figures:
    """Return how many requests with a bad credential were sent, and how many were let through."""
    routes = [route for route in server.routes if not _is_open(route)]
    unsafe = [route for route in routes if route.method not in ("GET", "HEAD")]
    random.Random(0).shuffle(routes)  # noqa: S311 - an order, no secret
    bad = list(_bad_headers(server, store))
    accepted = []
    for number, route in zip(range(tried), cycle(routes), strict=False):
        name, headers = bad[number % len(bad)]
        if server.request(route, headers, address=f"10.1.{number // 200}.{number % 200}").endpoint:
            accepted.append(f"{name}: {route.method} {route.path}")
    admin = server.cookie_of("ada")
    for route in unsafe:
        if server.request(route, {**admin, **_EVIL}).endpoint:
            accepted.append(f"a foreign page: {route.method} {route.path}")
    replayed = _replayed(server)
    return {
        "foreign_tried": tried + len(unsafe) + len(replayed),
        "foreign_accepted": len(accepted) + sum(replayed),
        "foreign_accepted_which": accepted[:20],
    }


def _is_open(route: ServedRoute) -> bool:
    access = declared_access(route.endpoint)
    return access is not None and access.right is None


def _bad_headers(server: GuardedServer, store: Store) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield name and headers of each kind of invalid credential."""
    accounts = server.accounts
    good = server.cookie_of("otto")["cookie"].removeprefix(f"{COOKIE}=")
    secret, _, signature = good.rpartition(".")
    yield "nothing", {}
    yield "a cookie without its signature", {"cookie": f"{COOKIE}={secret}"}
    yield "a cookie with another's signature", {"cookie": f"{COOKIE}={secrets.token_urlsafe(32)}.{signature}"}
    yield "a cookie cut short", {"cookie": f"{COOKIE}={good[:-2]}"}
    yield "a cookie that signed out", _signed_out(server)
    yield "a cookie that expired", _expired_sign_in(server, store)
    yield "a cookie of a user who was removed", _removed(server)
    yield "a token that does not exist", {"authorization": f"Bearer fcd_{secrets.token_urlsafe(32)}"}
    token, document = accounts.tokens.add("gone", frozenset(Right), days=1, created_by="bench")
    accounts.revoke_token(document.id)
    yield "a token that was revoked", {"x-api-token": token}
    yield "a token that expired", {"authorization": f"Bearer {_expired_token(server, store)}"}
    yield "a token as a cookie", {"cookie": f"{COOKIE}={token}"}
    yield "a password as a token", {"authorization": f"Bearer {PASSWORD}"}
    yield (
        "a name and password for another scheme",
        {"authorization": "Basic YWRhOmNvcnJlY3QgaG9yc2UgYmF0dGVyeQ=="},
    )


def _signed_out(server: GuardedServer) -> dict[str, str]:
    headers = server.cookie_of("otto")
    server.accounts.sign_out(_sign_in_of(server, headers))
    return headers


def _sign_in_of(server: GuardedServer, headers: dict[str, str]) -> str:
    """Return the id of a cookie's sign-in; several may have begun in one millisecond."""
    found = server.accounts.sign_ins.find(headers["cookie"].removeprefix(f"{COOKIE}="))
    if found is None or found.sign_in is None:
        raise DeviceFault("the bench's own cookie is not accepted; the figures would say nothing")
    return found.sign_in


def _removed(server: GuardedServer) -> dict[str, str]:
    server.accounts.users.add("rita", UserRole.ADMIN, password=PASSWORD)
    headers = server.cookie_of("rita")
    server.accounts.remove_user("rita")
    return headers


def _expired_sign_in(server: GuardedServer, store: Store) -> dict[str, str]:
    headers = server.cookie_of("ada")
    with store.session() as session:
        row = session.get(SignInRow, _sign_in_of(server, headers))
        if row is not None:
            row.expires_utc = _LONG_AGO
    server.accounts.sign_ins.load(server.accounts.users.all())
    return headers


def _expired_token(server: GuardedServer, store: Store) -> str:
    token, document = server.accounts.tokens.add("old", frozenset(Right), days=1, created_by="bench")
    with store.session() as session:
        row = session.get(ServiceTokenRow, document.id)
        if row is not None:
            row.expires_utc = _LONG_AGO
    server.accounts.tokens.load()
    return token


def _replayed(server: GuardedServer) -> list[bool]:
    """Reuse one-time links; return whether each further use was accepted."""
    users = server.accounts.users
    found = []
    for number in range(20):
        _, invitation = users.add(f"guest{number}", UserRole.VIEWER)
        if invitation is None:
            continue
        older = users.invite(f"guest{number}")
        newer = users.invite(f"guest{number}")
        server.accounts.join(newer.code, PASSWORD, name=None)
        for code in (invitation.code, older.code, newer.code):
            found.append(_joins(server, code))
    return found


def _joins(server: GuardedServer, code: str) -> bool:
    try:
        server.accounts.join(code, "another password", name=None)
    except FoveaError:
        return False
    return True
