"""Access to every route of the server by nobody, each role, and services, compared with the declared rights.

Then with variants of its path, which a careless check takes for another address than the router does.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import unquote

from foveacam_bench.access.guarded import GuardedServer, ServedRoute, scopes_token
from foveacam_bench.figures import Figures
from foveacam_server.accounts.rights import Right, UserRole, rights_of
from foveacam_server.accounts.route_rights import UNDECLARED, declared_access

ROLES = {"vera": UserRole.VIEWER, "otto": UserRole.OPERATOR, "ada": UserRole.ADMIN}
_ANONYMOUS = "nobody"
_ENDINGS = (
    "%0A", "%0D", "%00", "%09", "%7F", "%C2%85", "%E2%80%A8", "%0D%0A",
    "/", "%2F", "//", "%2e", "/%2e", "/%2e%2e", ";x", "%20", "%3F", "%23",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Requester:
    """A sender of requests: name, credentials and rights."""

    name: str
    headers: dict[str, str]
    rights: frozenset[Right]


def matrix_figures(server: GuardedServer, *, every: int) -> Figures:
    """Return how many routes declare no right, and how many answers differ from what is declared.

    `every`: variants of the path are sent of one route in this many.
    """
    requesters = list(requesters_of(server))
    tried, violations = try_variants(server, server.routes[::every], requesters)
    violations += wrong_answers(server, requesters)
    return {
        "routes": len(server.routes),
        "routes_without_role": len(undeclared(server.routes)),
        "role_matrix_cells": len(server.routes) * len(requesters),
        "path_variants_tried": tried,
        "role_matrix_violations": len(violations),
        "role_matrix_violations_which": violations[:20],
    }


def wrong_answers(server: GuardedServer, requesters: list[Requester]) -> list[str]:
    """Return the routes and askers whose answer is not as declared, or comes from another route."""
    return [
        f"{route.method} {route.path} by {requester.name}: {answer.status}"
        for requester in requesters
        for route in server.routes
        if (answer := server.request(route, requester.headers)).status != _wanted(route, requester)
        or answer.endpoint is not (route.endpoint if answer.status == 200 else None)
    ]


def undeclared(routes: list[ServedRoute]) -> list[ServedRoute]:
    """Return the routes that declare no right."""
    return [route for route in routes if declared_access(route.endpoint) is None]


def path_variants(path: str) -> list[str]:
    """Return percent-encoded addresses that resemble one."""
    head, _, last = path.rpartition("/")
    middle = len(last) // 2
    lasts = [f"%0a{last}", f"{last[:middle]}%0A{last[middle:]}", f"%{ord(last[:1] or ' '):02x}{last[1:]}"]
    within = [f"{head}/{other}" for other in (*lasts, f"/{last}", f"%2e/{last}", f"x/%2e%2e/{last}")]
    return [*(path + end for end in _ENDINGS), *within, f"/{path}", path.upper(), f"{head}/{last.upper()}"]


def try_variants(
    server: GuardedServer, routes: list[ServedRoute], requesters: list[Requester]
) -> tuple[int, list[str]]:
    """Return how many variants of paths were sent, and those that reached a route without the right to it."""
    tried, found = 0, []
    for route in routes:
        lacking = [requester for requester in requesters if not _may(requester, route.endpoint)]
        for variant in path_variants(route.path):
            sent = ServedRoute(route.method, unquote(variant), route.endpoint)
            for requester in lacking:
                tried += 1
                reached = server.request(sent, requester.headers).endpoint
                if reached is not None and (reached is route.endpoint or not _may(requester, reached)):
                    found.append(f"{route.method} {variant} by {requester.name}")
    return tried, found


def requesters_of(server: GuardedServer) -> Iterator[Requester]:
    """Yield nobody, a user of each role, and a service of each scope."""
    yield Requester(_ANONYMOUS, {}, frozenset())
    for name, role in ROLES.items():
        yield Requester(name, server.cookie_of(name), rights_of(role))
    for right in Right:
        name = f"service that may {right}"
        yield Requester(f"a {name}", scopes_token(server, right, name=name), frozenset({right}))


def _may(requester: Requester, endpoint: object) -> bool:
    right = (declared_access(endpoint) or UNDECLARED).right
    return right is None or right in requester.rights


def _wanted(route: ServedRoute, requester: Requester) -> int:
    if _may(requester, route.endpoint):
        return 200
    return 401 if requester.name == _ANONYMOUS else 403
