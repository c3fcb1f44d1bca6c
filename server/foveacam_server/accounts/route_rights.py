"""Access rights declared by each route, and the lookup of a request's route.

A router declares the rights for reading and changing its resource, `needs` and `open_to_anybody` those of one
route. A route without a declaration is for admins only.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

from fastapi.routing import APIRoute, RouteContext, iter_route_contexts
from starlette.routing import BaseRoute, Match
from starlette.types import Scope

from foveacam_server.accounts.rights import Right
from foveacam_server.foundation.http.declared_routes import DeclaringRouter

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
ACCESS = "foveacam_access"
"""Attribute of an endpoint: a function, or an ASGI application that is mounted."""
_KEPT, _KEPT_CHARS = 2048, 200
"""Size of the cache of matches by path, and the longest cached path."""

_Endpoint = TypeVar("_Endpoint")


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Access that a route requires."""

    right: Right | None
    """Right that is needed; None: served to anybody."""
    stops: bool = False
    """Whether it is the stop: always allowed with the right token, and to viewers where the rig file allows
    it."""
    takes_token: bool = False
    """Whether the shared token in the query signs a browser in."""


UNDECLARED = Access(right=Right.ADMINISTER)


def needs(
    right: Right, *, stops: bool = False, takes_token: bool = False
) -> Callable[[_Endpoint], _Endpoint]:
    """Declare the access that an endpoint needs."""
    return _declare(Access(right=right, stops=stops, takes_token=takes_token))


def open_to_anybody(endpoint: _Endpoint) -> _Endpoint:
    """Declare that an endpoint is served to anybody: a probe, or one by which somebody signs in."""
    return _declare(Access(right=None))(endpoint)


def _declare(access: Access) -> Callable[[_Endpoint], _Endpoint]:
    def declared(endpoint: _Endpoint) -> _Endpoint:
        setattr(endpoint, ACCESS, access)
        return endpoint

    return declared


def declared_access(endpoint: object) -> Access | None:
    """Return the access that an endpoint declares; None without a declaration."""
    found: Access | None = getattr(endpoint, ACCESS, None)
    return found


class GuardedRouter(DeclaringRouter):
    """A router that declares the rights of its routes; a WebSocket declares its own."""

    def __init__(
        self,
        prefix: str = "",
        *,
        reading: Right,
        changing: Right,
        opens: Sequence[type[object]] = (),
        tags: Sequence[str] = (),
        include_in_schema: bool = True,
        route_class: type[APIRoute] = APIRoute,
    ) -> None:
        """`reading`: the right for GET; `changing`: that for all other methods.

        `opens`: services that only these routes need; each is constructed from the services open by then.
        """
        self._reading, self._changing = reading, changing
        self.opens = tuple(opens)
        super().__init__(
            prefix=prefix, tags=list(tags), include_in_schema=include_in_schema, route_class=route_class
        )

    def add_api_route(
        self,
        path: str,
        endpoint: Callable[..., Any],  # Any: a route's own arguments and answer
        **options: Any,  # noqa: ANN401 - those of APIRouter
    ) -> None:
        """Declare a route with the router's right, unless the endpoint declares another."""
        if declared_access(endpoint) is None:
            safe = SAFE_METHODS.issuperset(options.get("methods") or ["GET"])
            needs(self._reading if safe else self._changing)(endpoint)
        super().add_api_route(path, endpoint, **options)


class RouteTable:
    """Finds the route that answers a request, by the matching rules of the application's own routes."""

    def __init__(self, routes: Sequence[BaseRoute]) -> None:
        """`routes`: those of the application; none is added after the first request."""
        self.routes = routes
        self._known = lru_cache(maxsize=_KEPT)(self._find)

    @cached_property
    def contexts(self) -> list[RouteContext]:
        """Every route, in the order in which the application tries them."""
        return list(iter_route_contexts(self.routes))

    def load(self) -> None:
        """Build the table now instead of at the first request."""
        _ = self._matchers

    @cached_property
    def _matchers(self) -> list[Callable[[Scope], tuple[Match, Scope]]]:
        return [context.matches for context in self.contexts]

    def access(self, scope: Scope) -> Access | None:
        """Return the access that the route of a request or WebSocket requires; None without a route.

        A request with another method than its path has belongs to the first route of that path, which answers
        405. Callable from any thread.
        """
        path: str = scope["path"]
        find = self._known if len(path) <= _KEPT_CHARS else self._find
        return find(scope["type"], scope.get("method", "GET"), path, scope.get("root_path", ""))

    def _find(self, kind: str, method: str, path: str, root_path: str) -> Access | None:
        scope: Scope = {"type": kind, "method": method, "path": path, "root_path": root_path, "headers": []}
        of_other_method: Access | None = None
        for matches in self._matchers:
            match, found = matches(scope)
            if match is Match.NONE or (match is Match.PARTIAL and of_other_method is not None):
                continue
            access = declared_access(found["endpoint"]) or UNDECLARED
            if match is Match.FULL:
                return access
            of_other_method = access
        return of_other_method
