"""What remains of a user's sign-ins after a link was used, a password changed, the user removed or disabled.

Each time a browser of that user has an event stream, an MJPEG stream and both WebSockets open, then tries its
cookie again. Everything goes through REST, to a server with a rig.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from foveacam_bench.access.guarded import PASSWORD
from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_hardware.contract import DeviceFault

API = "/api/v1"
STREAMS = (f"{API}/events", f"{API}/views/wide/stream.mjpeg")
WEBSOCKETS = (f"{API}/views/ws", f"{API}/mirrors/steering")
REQUESTS = (("GET", f"{API}/rig"), ("POST", f"{API}/stop"))
LONGEST_S = 2.0
"""A connection that lasts this long after the change counts as alive."""
_ANOTHER = "another horse battery"
_PATIENCE_S = 30.0
_POLL_S = 0.5


@dataclass
class _OpenConnection:
    """A stream or WebSocket that a thread reads until it ends."""

    path: str
    opened: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)
    given_up: threading.Event = field(default_factory=threading.Event)
    ended_s: float = 0.0

    def read(self, url: str, cookies: dict[str, str]) -> None:
        """Read to the end, whatever causes it."""
        with suppress(httpx.HTTPError, WebSocketException, OSError):
            if self.path in WEBSOCKETS:
                self._listen(url, cookies)
            else:
                self._stream(url, cookies)
        self.ended_s = time.monotonic()
        self.ended.set()

    def _stream(self, url: str, cookies: dict[str, str]) -> None:
        with (
            httpx.Client(base_url=url, cookies=cookies, timeout=_PATIENCE_S, trust_env=False) as http,
            http.stream("GET", self.path, headers={"Last-Event-ID": "0"}) as answer,
        ):
            answer.raise_for_status()
            for _ in answer.iter_raw():
                self.opened.set()
                if self.given_up.is_set():
                    return

    def _listen(self, url: str, cookies: dict[str, str]) -> None:
        headers = {"Cookie": "; ".join(f"{name}={value}" for name, value in cookies.items())}
        with connect(f"ws://{urlsplit(url).netloc}{self.path}", additional_headers=headers) as socket:
            self.opened.set()
            while not self.given_up.is_set():
                with suppress(TimeoutError):
                    socket.recv(timeout=_POLL_S)


def ended_figures(url: str, admin: httpx.Client) -> Figures:
    """Return what was alive after each change; `url`: of the server, `admin`: a client signed in as admin."""
    alive: list[str] = []
    longest_s = 0.0
    for change, work in _CHANGES.items():
        name = f"old.{change.replace(' ', '.')}"
        _send(admin, "POST", "/users", {"name": name, "role": "operator", "password": PASSWORD})
        with _browser(url) as old, _open_connections(url, old, name) as connections:
            work(url, admin, name)
            changed_s = time.monotonic()
            late = [each.path for each in connections if not _ends(each, changed_s + LONGEST_S)]
            late += [f"{method} {path}" for method, path in REQUESTS if _is_admitted(old, method, path)]
            longest_s = max([longest_s, *(each.ended_s - changed_s for each in connections)])
        alive += [f"{change}: {what}" for what in late]
        admin.delete(f"{API}/stop")
        admin.delete(f"{API}/users/{name}")  # unless that was the change
    return {
        "sessions_tried_after_reset": len(_CHANGES) * len((*STREAMS, *WEBSOCKETS, *REQUESTS)),
        "sessions_alive_after_reset": len(alive),
        "sessions_alive_after_reset_which": alive,
        "session_end_max_ms": 1e3 * longest_s,
    }


def served_ended_figures() -> Figures:
    """Return `ended_figures` of a new server, whose first admin it creates."""
    with (
        TemporaryDirectory() as folder,
        ServerProcess(Path(folder), port=free_port()) as server,
        _browser(server.url) as admin,
    ):
        _send(admin, "POST", "/users", {"name": "ada", "role": "admin", "password": PASSWORD})
        return ended_figures(server.url, admin)


def _use_link(url: str, admin: httpx.Client, name: str) -> None:
    code = _send(admin, "POST", f"/users/{name}/invitation").json()["path"].partition("code=")[2]
    with _browser(url) as new:
        _send(new, "POST", "/session/invitation", {"code": code, "password": _ANOTHER})


def _change_password(url: str, _admin: httpx.Client, name: str) -> None:
    with _browser(url) as other:
        _send(other, "POST", "/session", {"name": name, "password": PASSWORD})
        _send(other, "PUT", "/session/password", {"password": PASSWORD, "new_password": _ANOTHER})


def _remove(_url: str, admin: httpx.Client, name: str) -> None:
    _send(admin, "DELETE", f"/users/{name}")


def _disable(_url: str, admin: httpx.Client, name: str) -> None:
    _send(admin, "PATCH", f"/users/{name}", {"disabled": True})


_CHANGES: dict[str, Callable[[str, httpx.Client, str], None]] = {
    "a used link": _use_link,
    "a changed password": _change_password,
    "a removal": _remove,
    "a disabling": _disable,
}


@contextmanager
def _open_connections(url: str, http: httpx.Client, name: str) -> Iterator[list[_OpenConnection]]:
    """Sign a user in and open all long-lived connections; close what is left."""
    _send(http, "POST", "/session", {"name": name, "password": PASSWORD})
    connections = [_OpenConnection(path) for path in (*STREAMS, *WEBSOCKETS)]
    with ExitStack() as stack:
        for connection in connections:
            thread = threading.Thread(target=connection.read, args=(url, dict(http.cookies)))
            thread.start()
            stack.callback(thread.join)
        for connection in connections:
            stack.callback(connection.given_up.set)
        for connection in connections:
            if not connection.opened.wait(_PATIENCE_S) or connection.ended.is_set():
                raise DeviceFault(f"{connection.path} of the bench's server did not stay open")
        yield connections


def _ends(connection: _OpenConnection, deadline_s: float) -> bool:
    return connection.ended.wait(max(0.0, deadline_s - time.monotonic()))


def _is_admitted(old: httpx.Client, method: str, path: str) -> bool:
    return old.request(method, path).status_code != httpx.codes.UNAUTHORIZED


def _browser(url: str) -> httpx.Client:
    return httpx.Client(base_url=url, timeout=_PATIENCE_S, trust_env=False)


def _send(http: httpx.Client, method: str, path: str, body: object = None) -> httpx.Response:
    return http.request(method, API + path, json=body).raise_for_status()
