"""Lets a test's own application serve several persons: a request is from whom its header X-Person names."""

from fastapi import FastAPI
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from foveacam_server.accounts.rights import Principal, PrincipalKind, Right
from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.console.person_requests import PersonRequests
from foveacam_server.foundation.persons.person_quota import ServerPlaces

PERSON_HEADER = "X-Person"


def install_persons(app: FastAPI) -> ServerPlaces:
    """Let an application know whom each request is from; return its places."""
    places = app.state.places = ServerPlaces()
    app.add_middleware(PersonRequests, places=places.requests)
    app.add_middleware(_NamedPrincipals, routes=RouteTable(app.routes))
    return places


class _NamedPrincipals:
    def __init__(self, app: ASGIApp, *, routes: RouteTable) -> None:
        self._app, self._routes = app, routes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] in ("http", "websocket"):
            name = Headers(scope=scope).get(PERSON_HEADER, "mia")
            scope["principal"] = Principal(kind=PrincipalKind.USER, name=name, rights=frozenset(Right))
            scope["access"] = self._routes.access(scope)
        await self._app(scope, receive, send)
