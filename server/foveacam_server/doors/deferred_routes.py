"""Routes of the application that are built at their first request, on a thread instead of the event loop."""

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute, Match, Route
from starlette.types import Receive, Scope, Send

from foveacam_server.doors.closing import run_beside
from foveacam_server.foundation.http.declared_routes import DeclaredRoute, DeclaringRouter

_building = threading.Lock()
"""Serializes the building of routes: FastAPI and pydantic change and restore the warning filters of the whole
process, whichever thread has changed them since."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inclusion:
    """Prefix, responses and limit of bodies with which the application includes its routers."""

    prefix: str
    responses: Mapping[int | str, dict[str, Any]]  # Any: FastAPI's own
    max_body_size: int

    def add(self, app: FastAPI, router: DeclaringRouter) -> None:
        """Add the routes of a router to an application; WebSockets are built now."""
        for declared in router.declared:
            if declared.websocket:
                path = self.prefix + declared.path
                app.add_api_websocket_route(path, declared.endpoint, **declared.options)
            else:
                app.routes.append(DeferredRoute(declared, router=router, inclusion=self))


class DeferredRoute(Route):
    """A route that matches by its path and its methods, and is built by FastAPI when it first answers."""

    def __init__(self, declared: DeclaredRoute, *, router: DeclaringRouter, inclusion: Inclusion) -> None:
        methods = {method.upper() for method in declared.options.get("methods") or ("GET",)}
        super().__init__(inclusion.prefix + declared.path, declared.endpoint, methods=methods)
        self.methods = methods  # Starlette adds HEAD, which a middleware answers by GET
        self.app = self._serve
        self._declared, self._router, self._inclusion = declared, router, inclusion
        self._built: APIRoute | None = None

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Compare a request's path and method; `route` of its scope becomes the declared one."""
        match, child_scope = super().matches(scope)
        if match is not Match.NONE:
            child_scope["route"] = self._declared
        return match, child_scope

    def build(self) -> APIRoute:
        """Return FastAPI's route, built at the first call; callable from any thread."""
        with _building:
            if self._built is None:
                self._built = self._made()
            return self._built

    def _made(self) -> APIRoute:
        declared, inclusion = self._declared, self._inclusion
        router = APIRouter(
            prefix=inclusion.prefix,
            tags=self._router.tags,
            include_in_schema=self._router.include_in_schema,
            route_class=self._router.route_class,
            responses=dict(inclusion.responses),
            max_body_size=inclusion.max_body_size,
        )
        router.add_api_route(declared.path, declared.endpoint, **declared.options)
        made = router.routes[0]
        if not isinstance(made, APIRoute):
            raise TypeError(f"{declared.path}: FastAPI made a {type(made).__name__}")
        return made

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        route = self._built
        if route is None:
            route = await run_beside(self.build)
        await route.app(scope, receive, send)


def built_routes(routes: Sequence[BaseRoute]) -> Iterator[BaseRoute]:
    """Yield routes, deferred ones as FastAPI builds them."""
    for route in routes:
        yield route.build() if isinstance(route, DeferredRoute) else route
