"""A guarded server without its rig: access rules and routes of the application, with idle endpoints."""

import asyncio
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass

from fastapi import FastAPI
from fastapi.routing import APIRoute, RouteContext
from starlette.routing import BaseRoute, Mount
from starlette.types import Message, Receive, Scope, Send

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.app import create_app
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.security import SecurityMiddleware
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store

HOST = "rig.example"
PASSWORD = "correct horse battery"  # noqa: S105 - of users that live as long as the bench


@dataclass(frozen=True, slots=True)
class ServedRoute:
    """A method and path of the server, `WEBSOCKET` for a WebSocket; ids of the path are filled in."""

    method: str
    path: str
    endpoint: object = None
    """The object that handles its requests."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The status of a request, 200 where an endpoint was reached, and that endpoint."""

    status: int
    endpoint: object | None = None


class GuardedServer:
    """The access rules with accounts, in front of routes that only record that they were reached."""

    def __init__(self, accounts: Accounts, runner: asyncio.Runner) -> None:
        app = create_app(Settings(viewer=False))
        self._runner = runner
        self._reached: object | None = None
        self._noting: list[BaseRoute] = []
        self.accounts = accounts
        self.rules = AccessRules(
            routes=RouteTable(app.routes),
            token=None,
            origins=frozenset(),
            loopback=False,
            hosts=frozenset(),
            accounts=accounts,
        )
        self.routes = self._served(app)
        self._app = SecurityMiddleware(app.router, gate=self.rules)

    def request(self, route: ServedRoute, headers: dict[str, str], *, address: str = "10.0.0.9") -> Answer:
        """Send a request; the router of the application finds its endpoint once the rules admit it."""
        self._reached = None
        statuses: list[int] = []

        async def send(message: Message) -> None:
            if message["type"].endswith("response.start"):
                statuses.append(int(message["status"]))

        async def receive() -> Message:
            kind = "websocket.connect" if route.method == "WEBSOCKET" else "http.request"
            return {"type": kind, "body": b"", "more_body": False}

        scope = _scope(route, {"host": HOST, **headers}, address=address)
        self._runner.run(self._app(scope, receive, send))
        return Answer(statuses[0], self._reached) if statuses else Answer(200, self._reached)

    def cookie_of(self, name: str) -> dict[str, str]:
        """Return the headers of a browser in which a user has just signed in."""
        cookie = self.accounts.begin(self.accounts.users.get(name), address="10.0.0.9", browser="bench")
        return {"cookie": f"{COOKIE}={cookie}"}

    def _served(self, app: FastAPI) -> list[ServedRoute]:
        """Return every route, file and WebSocket, each made to record that it was reached."""
        found = []
        for context in self.rules.routes.contexts:
            methods, path = context.methods, (context.path or "").replace("{", "").replace("}", "")
            route = _handling(context)
            self._note_in(route, methods)
            if isinstance(route, Mount):
                found.append(ServedRoute("GET", f"{path}/a.js", route.app))
            elif methods is None:
                found.append(ServedRoute("WEBSOCKET", path, context.endpoint))
            else:
                found += [ServedRoute(method, path, context.endpoint) for method in sorted(methods)]
        return found

    def _note_in(self, route: BaseRoute, methods: set[str] | None) -> None:
        async def note(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] == "websocket":
                self._reached = scope["endpoint"]
                await send({"type": "websocket.close", "code": 1000})
                return
            served = methods is None or scope["method"] in methods
            self._reached = scope["endpoint"] if served else None
            await send({"type": "http.response.start", "status": 200 if served else 405, "headers": []})
            await send({"type": "http.response.body", "body": b""})

        route.handle = note  # type: ignore[method-assign]  # in place of what the endpoint does
        self._noting.append(route)

    def close(self) -> None:
        """Restore the routes, whose routers are shared by all applications of this process."""
        for route in self._noting:
            vars(route).pop("handle", None)


def _handling(context: RouteContext) -> BaseRoute:
    """Return the object whose `handle` the router calls; for WebSockets of a router it is FastAPI's own."""
    if isinstance(context.original_route, APIRoute):
        return context.original_route
    found: BaseRoute = context.handle.__self__
    return found


@contextmanager
def guarded_server(store: Store) -> Iterator[GuardedServer]:
    """Open a server that others can reach, with a user of each role."""
    accounts = Accounts(store, guarded=True)
    try:
        accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
        accounts.users.add("vera", UserRole.VIEWER, password=PASSWORD)
        with asyncio.Runner() as runner, closing(GuardedServer(accounts, runner)) as server:
            yield server
    finally:
        accounts.close()


def scopes_token(server: GuardedServer, *scopes: Right, name: str) -> dict[str, str]:
    """Return the headers of a service with these scopes."""
    secret, _ = server.accounts.tokens.add(name, frozenset(scopes), days=1, created_by="bench")
    return {"authorization": f"Bearer {secret}"}


def _scope(route: ServedRoute, headers: dict[str, str], *, address: str) -> Scope:
    websocket = route.method == "WEBSOCKET"
    scope: Scope = {
        "type": "websocket" if websocket else "http",
        "scheme": "ws" if websocket else "http",
        "path": route.path,
        "query_string": b"",
        "headers": [(name.encode(), value.encode("latin-1")) for name, value in headers.items()],
        "client": (address, 1),
        "extensions": {"websocket.http.response": {}},
    }
    return scope if websocket else {**scope, "method": route.method}
