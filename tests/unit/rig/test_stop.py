import asyncio
import gc
import json
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from queue import Queue

import pytest
from fastapi import FastAPI
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.stop_answer import StopAtDoor
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.process_limits import keep_start_objects
from foveacam_server.doors.server import WatchedServer, server_config
from foveacam_server.doors.stop_door import StopDoor
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.stop import routes as stop_routes
from foveacam_server.rig.stop import StopSwitch

STOP = b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\n"
WAIT_S = 20.0


@dataclass
class Halted:
    """Mirrors that confirm, and how often they were asked."""

    confirm: bool = True
    halts: int = 0

    def halt(self) -> bool:
        self.halts += 1
        return self.confirm

    def resume(self) -> None:
        raise AssertionError("nobody releases the stop here")


@dataclass
class Way:
    """A door, the connections that it handed on, and the mirrors behind it."""

    port: int
    mirrors: Halted
    adopted: "Queue[socket.socket]" = field(default_factory=Queue)

    def send(self, request: bytes) -> socket.socket:
        peer = socket.create_connection(("127.0.0.1", self.port), timeout=WAIT_S)
        peer.sendall(request)
        return peer

    def answer(self, request: bytes) -> tuple[int, dict[str, object]]:
        """Return status and document of what the door itself answers."""
        with self.send(request) as peer:
            said = b"".join(iter(lambda: peer.recv(65_536), b""))
        head, _, body = said.partition(b"\r\n\r\n")
        return int(head.split(b" ")[1]), json.loads(body)


@pytest.fixture
def mirrors() -> Halted:
    return Halted()


@pytest.fixture
def at_door(mirrors: Halted, tmp_path: Path) -> Iterator[StopAtDoor]:
    store = Store(tmp_path)
    events = EventLog(store)
    app = FastAPI()
    app.include_router(stop_routes.router, prefix="/api/v1")
    gate = AccessRules(
        routes=RouteTable(app.routes), token=None, origins=frozenset(), loopback=True, hosts=frozenset()
    )
    switch = StopSwitch(mirrors, cancel_jobs=lambda reason: None, events=events)
    yield StopAtDoor(switch, gate=gate)
    events.close()
    store.close()


@pytest.fixture
def way(mirrors: Halted, at_door: StopAtDoor) -> Iterator[Way]:
    with listen("127.0.0.1", 0) as listener, ThreadPoolExecutor(1) as workers:
        way = Way(port=listener.getsockname()[1], mirrors=mirrors)
        door = StopDoor(listener, adopt=way.adopted.put, answer=at_door, workers=workers)
        door.open()
        try:
            yield way
        finally:
            door.close()
            while not way.adopted.empty():
                way.adopted.get().close()


@pytest.mark.parametrize("request_", [STOP + b"\r\n", STOP + b"Content-Length: 2\r\n\r\n{}"])
def test_a_whole_stop_is_answered_at_the_door(way: Way, request_: bytes) -> None:
    status, document = way.answer(request_)

    assert status == 200
    assert document["engaged"] is True and document["parked"] is True
    assert way.mirrors.halts == 1 and way.adopted.empty()


def test_a_stop_at_the_door_has_its_request_id(at_door: StopAtDoor) -> None:
    named = at_door(STOP + b"X-Request-ID: panel-3\r\n\r\n", "127.0.0.1")
    assert b"x-request-id: panel-3\r\n" in named.lower()
    unreadable = at_door(b"POST /api/v1/stop HTTP/1.1\r\n: no name\r\n\r\n", "127.0.0.1")
    assert b"x-request-id: req-" in unreadable.lower()


def test_a_stop_that_the_controller_does_not_confirm_says_so(way: Way) -> None:
    way.mirrors.confirm = False
    assert way.answer(STOP + b"\r\n")[1]["parked"] is False


def test_a_foreign_page_stops_nothing_at_the_door_either(way: Way) -> None:
    status, document = way.answer(STOP + b"Origin: http://evil.example\r\n\r\n")

    assert (status, document["type"]) == (403, "/problems/forbidden-origin")
    assert way.mirrors.halts == 0


@pytest.mark.parametrize(
    "request_",
    [
        b"GET /api/v1/rig HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"POST /api/v1/stopped HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        STOP,
        STOP + b"Content-Length: 1000\r\n\r\n{",
        STOP + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        STOP + b"X-Forwarded-For: 10.0.0.1\r\n\r\n",
        b"P",
    ],
)
def test_everything_else_is_handed_on_unread(way: Way, request_: bytes) -> None:
    with way.send(request_):
        adopted = way.adopted.get(timeout=WAIT_S)
        with adopted:
            adopted.settimeout(WAIT_S)
            assert adopted.recv(65_536) == request_
    assert way.mirrors.halts == 0


def test_a_door_of_https_leaves_a_stop_in_plain_text_to_the_server(
    mirrors: Halted, at_door: StopAtDoor
) -> None:
    adopted: Queue[socket.socket] = Queue()
    with listen("127.0.0.1", 0) as listener, ThreadPoolExecutor(1) as workers:
        door = StopDoor(listener, adopt=adopted.put, answer=at_door, workers=workers, encrypted=True)
        door.open()
        try:
            with Way(port=listener.getsockname()[1], mirrors=mirrors).send(STOP + b"\r\n"):
                adopted.get(timeout=WAIT_S).close()
        finally:
            door.close()
    assert mirrors.halts == 0


def test_who_says_nothing_holds_up_nobody(way: Way) -> None:
    silent = [way.send(b"") for _ in range(50)]
    assert way.answer(STOP + b"\r\n")[0] == 200
    for peer in silent:
        peer.close()


def test_a_stop_is_answered_while_the_event_loop_is_held_up(at_door: StopAtDoor, mirrors: Halted) -> None:
    held, release = threading.Event(), threading.Event()

    async def hold(request: Request) -> Response:
        held.set()
        await asyncio.sleep(0)
        release.wait(WAIT_S)  # on the loop itself: nothing else runs
        return PlainTextResponse("held")

    server = WatchedServer(server_config(Starlette(routes=[Route("/hold", hold)])))
    with listen("127.0.0.1", 0) as listener, ThreadPoolExecutor(1) as workers:
        door = StopDoor(listener, adopt=server.adopt, answer=at_door, workers=workers)
        way = Way(port=listener.getsockname()[1], mirrors=mirrors)
        thread = threading.Thread(target=lambda: asyncio.run(_serve(server, door)))
        thread.start()
        with way.send(b"GET /hold HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n") as other:
            assert held.wait(WAIT_S)
            assert way.answer(STOP + b"\r\n")[1]["parked"] is True
            release.set()
            assert b"held" in b"".join(iter(lambda: other.recv(65_536), b""))
        server.should_exit = True
        thread.join()


async def _serve(server: WatchedServer, door: StopDoor) -> None:
    serving = asyncio.create_task(server.serve(sockets=[]))
    while not server.started:  # noqa: ASYNC110 - uvicorn tells nobody
        await asyncio.sleep(0)
    door.open()
    await serving
    await asyncio.to_thread(door.close)


def test_what_exists_at_the_start_is_collected_no_more() -> None:
    before = gc.get_freeze_count()
    try:
        keep_start_objects()
        assert gc.get_freeze_count() > before + 1000
    finally:
        gc.unfreeze()
