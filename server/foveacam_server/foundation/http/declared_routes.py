"""A router that stores the declarations of its routes, and builds each when it is first needed.

FastAPI makes validators and serializers from an endpoint's signature: milliseconds per route, seconds for
all, of which a session needs a few.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter
from starlette.routing import BaseRoute


@dataclass(frozen=True, slots=True, kw_only=True)
class DeclaredRoute:
    """A route as a router declares it. `path`: with the router's prefix, without the application's."""

    path: str
    summary: str | None
    endpoint: Callable[..., Any]  # Any: a route's own arguments and answer
    options: dict[str, Any]  # Any: those of APIRouter
    websocket: bool = False


class DeclaringRouter(APIRouter):
    """Stores the declarations of its routes; `routes` builds them all, which an application does not need."""

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - those of APIRouter
        self.declared: list[DeclaredRoute] = []
        self._unbuilt: list[DeclaredRoute] = []
        self._routes: list[BaseRoute] = []
        super().__init__(**options)

    @property
    def routes(self) -> list[BaseRoute]:
        """All routes, built."""
        unbuilt, self._unbuilt = self._unbuilt, []
        for route in unbuilt:
            add = super().add_api_websocket_route if route.websocket else super().add_api_route
            add(route.path.removeprefix(self.prefix), route.endpoint, **route.options)
        return self._routes

    @routes.setter
    def routes(self, routes: list[BaseRoute]) -> None:
        self._routes = routes

    def add_api_route(
        self,
        path: str,
        endpoint: Callable[..., Any],  # Any: as in DeclaredRoute
        **options: Any,  # noqa: ANN401 - those of APIRouter
    ) -> None:
        """Declare a route."""
        self._declare(path, endpoint, options)

    def add_api_websocket_route(
        self,
        path: str,
        endpoint: Callable[..., Any],  # Any: as in DeclaredRoute
        name: str | None = None,
        **options: Any,  # noqa: ANN401 - those of APIRouter
    ) -> None:
        """Declare a WebSocket."""
        self._declare(path, endpoint, {"name": name, **options}, websocket=True)

    def _declare(
        self,
        path: str,
        endpoint: Callable[..., Any],  # Any: as in DeclaredRoute
        options: dict[str, Any],  # Any: those of APIRouter
        *,
        websocket: bool = False,
    ) -> None:
        route = DeclaredRoute(
            path=self.prefix + path,
            summary=options.get("summary"),
            endpoint=endpoint,
            options=options,
            websocket=websocket,
        )
        self.declared.append(route)
        self._unbuilt.append(route)
