"""Every route of the server by nobody, each role, and services: which reach it, beside what is declared.

Then by variants of its path, which a careless check takes for another address than the router does.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import unquote

from foveacam_bench.access.guarded import GuardedServer, ServedRoute, scopes_token
from foveacam_bench.figures import Figures
from foveacam_server.accounts.rights import Right, UserRole, rights_of
from foveacam_server.accounts.route_rights import UNDECLARED, declared_access

ROLES = {"vera": UserRole.VIEWER, "otto": UserRole.OPERATOR, "ada": UserRole.ADMIN}
_NOBODY = "nobody"
_ENDINGS = (
    "%0A", "%0D", "%00", "%09", "%7F", "%C2%85", "%E2%80%A8", "%0D%0A",
    "/", "%2F", "//", "%2e", "/%2e", "/%2e%2e", ";x", "%20", "%3F", "%23",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Asker:
    """Who sends requests: name, credentials and rights."""

    name: str
    headers: dict[str, str]
    rights: frozenset[Right]


def matrix_figures(server: GuardedServer) -> Figures:
    """Return how many routes declare no right, and how many answers differ from what is declared."""
    askers = list(askers_of(server))
    tried, violations = try_variants(server, server.routes, askers)
    violations += wrong_answers(server, askers)
    return {
        "routes": len(server.routes),
        "routes_without_role": len(undeclared(server.routes)),
        "role_matrix_cells": len(server.routes) * len(askers),
        "path_variants_tried": tried,
        "role_matrix_violations": len(violations),
        "role_matrix_violations_which": violations[:20],
    }


def wrong_answers(server: GuardedServer, askers: list[Asker]) -> list[str]:
    """Return the routes and askers whose answer is not the declared one, or comes from another route."""
    return [
        f"{route.method} {route.path} by {asker.name}: {answer.status}"
        for asker in askers
        for route in server.routes
        if (answer := server.request(route, asker.headers)).status != _wanted(route, asker)
        or answer.endpoint is not (route.endpoint if answer.status == 200 else None)
    ]


def undeclared(routes: list[ServedRoute]) -> list[ServedRoute]:
    """Return the routes that declare nothing."""
    return [route for route in routes if declared_access(route.endpoint) is None]


def path_variants(path: str) -> list[str]:
    """Return addresses that resemble one, percent-encoded."""
    head, _, last = path.rpartition("/")
    middle = len(last) // 2
    lasts = [f"%0a{last}", f"{last[:middle]}%0A{last[middle:]}", f"%{ord(last[:1] or ' '):02x}{last[1:]}"]
    within = [f"{head}/{other}" for other in (*lasts, f"/{last}", f"%2e/{last}", f"x/%2e%2e/{last}")]
    return [*(path + end for end in _ENDINGS), *within, f"/{path}", path.upper(), f"{head}/{last.upper()}"]


def try_variants(
    server: GuardedServer, routes: list[ServedRoute], askers: list[Asker]
) -> tuple[int, list[str]]:
    """Return how many variants of paths were sent, and those that reached what their asker may not do."""
    tried, found = 0, []
    for route in routes:
        lacking = [asker for asker in askers if not _may(asker, route.endpoint)]
        for variant in path_variants(route.path):
            sent = ServedRoute(route.method, unquote(variant), route.endpoint)
            for asker in lacking:
                tried += 1
                reached = server.request(sent, asker.headers).endpoint
                if reached is not None and (reached is route.endpoint or not _may(asker, reached)):
                    found.append(f"{route.method} {variant} by {asker.name}")
    return tried, found


def askers_of(server: GuardedServer) -> Iterator[Asker]:
    """Yield nobody, a user of each role, and a service of each scope."""
    yield Asker(_NOBODY, {}, frozenset())
    for name, role in ROLES.items():
        yield Asker(name, server.cookie_of(name), rights_of(role))
    for right in Right:
        name = f"service that may {right}"
        yield Asker(f"a {name}", scopes_token(server, right, name=name), frozenset({right}))


def _may(asker: Asker, endpoint: object) -> bool:
    right = (declared_access(endpoint) or UNDECLARED).right
    return right is None or right in asker.rights


def _wanted(route: ServedRoute, asker: Asker) -> int:
    if _may(asker, route.endpoint):
        return 200
    return 401 if asker.name == _NOBODY else 403
