"""A guarded server without its rig: the access rules before an application that notes what reaches it."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from fastapi.routing import iter_route_contexts
from starlette.types import Message, Receive, Scope, Send

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import Right, UserRole
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


def served_routes() -> list[ServedRoute]:
    """Return every route, file and WebSocket of the server."""
    found = []
    for route in iter_route_contexts(create_app(Settings(viewer=False)).routes):
        path = (route.path or "").replace("{", "").replace("}", "")
        methods = getattr(route, "methods", None)
        if methods is None:
            is_mount = type(route.original_route).__name__ == "Mount"
            found.append(ServedRoute("GET", f"{path}/a.js") if is_mount else ServedRoute("WEBSOCKET", path))
        else:
            found += [ServedRoute(method, path) for method in sorted(methods)]
    return found


@dataclass
class GuardedServer:
    """The access rules with accounts, and what they let through."""

    accounts: Accounts
    rules: AccessRules
    reached: int = 0
    _app: SecurityMiddleware = field(init=False)

    def __post_init__(self) -> None:
        self._app = SecurityMiddleware(self._note, gate=self.rules)

    async def _note(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.reached += 1
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1000})
            return
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    def request(self, route: ServedRoute, headers: dict[str, str], *, address: str = "10.0.0.9") -> int:
        """Send a request; return 200 where it reached the application, else the status of the refusal."""
        before = self.reached
        statuses: list[int] = []

        async def send(message: Message) -> None:
            if message["type"].endswith("response.start"):
                statuses.append(int(message["status"]))

        async def receive() -> Message:
            kind = "websocket.connect" if route.method == "WEBSOCKET" else "http.request"
            return {"type": kind, "body": b"", "more_body": False}

        scope = _scope(route, {"host": HOST, **headers}, address=address)
        asyncio.run(self._app(scope, receive, send))
        return 200 if self.reached > before else statuses[0]

    def cookie_of(self, name: str) -> dict[str, str]:
        """Return the headers of a browser in which a user has signed in now."""
        cookie = self.accounts.begin(self.accounts.users.get(name), address="10.0.0.9", browser="bench")
        return {"cookie": f"{COOKIE}={cookie}"}


@contextmanager
def guarded_server(store: Store) -> Iterator[GuardedServer]:
    """Open a server that others can reach, with a user of each role."""
    accounts = Accounts(store, guarded=True)
    try:
        accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
        accounts.users.add("vera", UserRole.VIEWER, password=PASSWORD)
        rules = AccessRules(token=None, origins=frozenset(), loopback=False, host=HOST, accounts=accounts)
        yield GuardedServer(accounts, rules)
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
