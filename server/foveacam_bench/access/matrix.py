"""Every route of the server by nobody, each role, and services: which reach it, beside what is declared."""

from foveacam_bench.access.guarded import GuardedServer, ServedRoute, scopes_token, served_routes
from foveacam_bench.figures import Figures
from foveacam_server.accounts.rights import Right, UserRole, rights_of
from foveacam_server.accounts.route_rights import OPEN_CALLS, OPEN_PATHS, WEBSOCKETS, declared_right
from foveacam_server.console.access_rules import SIGN_IN_PATHS

ROLES = {"vera": UserRole.VIEWER, "otto": UserRole.OPERATOR, "ada": UserRole.ADMIN}


def right_of(route: ServedRoute) -> Right | None:
    """Return the declared right of a route; None for one that declares none."""
    if route.method == "WEBSOCKET":
        return WEBSOCKETS.get(route.path)
    return declared_right(route.method, route.path)


def is_open(route: ServedRoute) -> bool:
    """Return whether a route is declared to be served to anybody."""
    return route.path in OPEN_PATHS | SIGN_IN_PATHS or (route.method, route.path) in OPEN_CALLS


def matrix_figures(server: GuardedServer) -> Figures:
    """Return how many routes declare no right, and how many answers differ from what is declared."""
    routes = served_routes()
    asking: dict[str, tuple[dict[str, str], frozenset[Right]]] = {"nobody": ({}, frozenset())}
    for name, role in ROLES.items():
        asking[name] = (server.cookie_of(name), rights_of(role))
    for right in Right:
        headers = scopes_token(server, right, name=f"service that may {right}")
        asking[f"a service that may {right}"] = (headers, frozenset({right}))
    violations = [
        f"{route.method} {route.path} by {name}: {status}"
        for route in routes
        for name, (headers, rights) in asking.items()
        if (status := server.request(route, headers)) != _wanted(route, rights, known=name != "nobody")
    ]
    undeclared = [route for route in routes if right_of(route) is None and not is_open(route)]
    return {
        "routes": len(routes),
        "routes_without_role": len(undeclared),
        "role_matrix_cells": len(routes) * len(asking),
        "role_matrix_violations": len(violations),
        "role_matrix_violations_which": violations[:20],
    }


def _wanted(route: ServedRoute, rights: frozenset[Right], *, known: bool) -> int:
    if is_open(route):
        return 200
    if not known:
        return 401
    return 200 if right_of(route) in rights else 403
