"""Problem documents of requests that the access rules refuse."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from starlette.types import Scope

from foveacam_server.accounts.errors import forbidden
from foveacam_server.accounts.rights import ANONYMOUS, Principal, Right
from foveacam_server.doors.error_handlers import nothing_served
from foveacam_server.foundation.errors import (
    FORBIDDEN_ORIGIN,
    TOO_MANY_TRIES,
    UNAUTHORIZED,
    UNREADABLE_PATH,
    ProblemDetails,
    problem_of,
)


@dataclass(frozen=True, slots=True)
class Refusal:
    """A refused request; `ask`: whether to offer a sign-in, which would admit it."""

    problem: ProblemDetails
    ask: bool = False
    principal: Principal = ANONYMOUS
    """The refused principal, if known."""


def control_character(path: str) -> Refusal:
    """Refuse a path with a line break, a NUL or another control character, which no route has."""
    return Refusal(
        ProblemDetails(
            kind=UNREADABLE_PATH,
            detail="The path has a control character (such as a line break), and no address here has one.",
            asked=repr(path),
            remedy="Send the path without it; a link that was copied may end with %0A or %0D.",
        )
    )


def unknown_path(principal: Principal, scope: Scope) -> Refusal:
    """Refuse a path without a route."""
    problem = nothing_served(path=scope["path"], method=scope.get("method", "WebSocket"))
    return Refusal(problem, principal=principal)


def foreign_origin(origin: str) -> Refusal:
    """Refuse a page of another site."""
    return Refusal(
        ProblemDetails(
            kind=FORBIDDEN_ORIGIN,
            detail=f"The page {origin} is not this server's own and may not control the rig.",
            asked=f"a request from {origin}",
            remedy="Open the console at the server's own address, add the origin to "
            "FOVEACAM_ALLOWED_ORIGINS, or name the proxy that speaks https in FOVEACAM_TRUSTED_PROXIES.",
        )
    )


def foreign_host(host: str, own: Collection[str]) -> Refusal:
    """Refuse a request with a host name that is not this machine's."""
    return Refusal(
        ProblemDetails(
            kind=FORBIDDEN_ORIGIN,
            detail=f"This server answers to {', '.join(sorted(own))} and to its addresses in digits alone, "
            f"and was called {host!r}.",
            asked=f"host {host!r}",
            remedy="Open it by one of these names or by its address; to be reached by another name, add that "
            "origin, such as https://rig.example, to FOVEACAM_ALLOWED_ORIGINS.",
        )
    )


def no_credentials(*, first_admin: bool) -> Refusal:
    """Refuse a request without authentication."""
    if first_admin:
        detail = "This server has no user yet; nothing is served before the first admin exists."
        remedy = "Open the link in the file that the server named on its terminal."
    else:
        detail = (
            "This server asks who you are, and no sign-in or token (or a wrong one) came with the request."
        )
        remedy = "Send 'Authorization: Bearer TOKEN' or 'X-Api-Token: TOKEN', or sign in at / in a browser."
    headers = {"WWW-Authenticate": 'Bearer realm="foveacam"'}
    return Refusal(ProblemDetails(kind=UNAUTHORIZED, detail=detail, remedy=remedy, headers=headers), ask=True)


def too_many_tries(wait_s: float) -> Refusal:
    """Refuse an address that sent too many wrong tokens."""
    return Refusal(
        ProblemDetails(
            kind=TOO_MANY_TRIES,
            detail=f"Too many wrong tokens came from this address; none is looked at for {wait_s:.0f} s.",
            remedy="Wait, then show the right one; a page that is signed in goes on.",
            headers={"Retry-After": str(math.ceil(wait_s))},
        )
    )


def lacking(principal: Principal, right: Right, scope: Scope) -> Refusal:
    """Refuse a request for which the principal lacks the right."""
    method = scope.get("method", "WebSocket")
    problem = problem_of(forbidden(principal, right, asked=f"{method} {scope['path']}"))
    return Refusal(problem, principal=principal)
