"""Requests by persons: how many each has open, how many threads each has, and who is one person."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import StreamingResponse
from tests.support.servers.local_server import serving
from tests.support.servers.persons import PERSON_HEADER, install_persons

from foveacam_server.accounts.requests import person_of
from foveacam_server.accounts.rights import ANONYMOUS, LOCAL, Principal, PrincipalKind, Right
from foveacam_server.accounts.route_rights import needs
from foveacam_server.doors import error_handlers
from foveacam_server.doors.process_limits import REQUEST_THREADS_EACH, bound_threads
from foveacam_server.foundation.http.answers import LONG_READ

T = TypeVar("T")
PATIENCE_S = 30.0


@dataclass(slots=True)
class Bench:
    """An application whose routes wait until they are let go on."""

    url: str = ""
    go: threading.Event = field(default_factory=threading.Event)
    begun: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    threads: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(16))
    """Beside those of the application and of the event loops."""

    def wait(self) -> None:
        self.begun.release()
        assert self.go.wait(PATIENCE_S)

    async def on_thread(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self.threads, work)

    async def get(self, path: str, person: str) -> httpx.Response:
        async with httpx.AsyncClient(timeout=PATIENCE_S, trust_env=False) as client:
            return await client.get(f"{self.url}{path}", headers={PERSON_HEADER: person})

    async def begin(self, path: str, person: str, *, count: int = 1) -> "list[asyncio.Task[httpx.Response]]":
        """Send requests, and return once all have begun."""
        tasks = [asyncio.create_task(self.get(path, person)) for _ in range(count)]
        for _ in range(count):
            assert await self.on_thread(partial(self.begun.acquire, timeout=PATIENCE_S))
        return tasks


@pytest.fixture
def bench() -> Iterator[Bench]:
    found = Bench()

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        bound_threads()
        yield

    app = FastAPI(lifespan=lifespan)
    error_handlers.install(app)
    app.get("/works")(found.wait)
    app.get("/stop")(needs(Right.OPERATE, stops=True)(lambda: "stopped"))

    @app.get("/waits")
    async def waits() -> None:
        await found.on_thread(found.wait)

    @app.get("/reads", dependencies=[LONG_READ])
    async def reads() -> StreamingResponse:
        async def parts() -> AsyncIterator[bytes]:
            await found.on_thread(found.wait)
            yield b"whole"

        return StreamingResponse(parts())

    places = install_persons(app)
    places.requests.most_each, places.long_reads.most_each = 8, 3
    with serving(app) as port:
        found.url = f"http://127.0.0.1:{port}"
        yield found
        found.go.set()
    found.threads.shutdown()


@pytest.mark.parametrize(("path", "most"), [("/waits", 8), ("/reads", 3)])
def test_a_person_with_too_many_open_is_refused_and_another_is_served(
    bench: Bench, path: str, most: int
) -> None:
    async def scenario() -> None:
        open_ones = await bench.begin(path, "mia", count=most)
        refused = await bench.get(path, "mia")
        assert refused.status_code == 429
        assert refused.headers["Retry-After"] == "5"
        assert refused.json()["type"] == "/problems/person-limit"
        assert (await bench.get("/stop", "mia")).status_code == 200
        open_ones += await bench.begin(path, "ben")
        bench.go.set()
        assert [(await one).status_code for one in open_ones] == [200] * (most + 1)
        assert (await bench.get(path, "mia")).status_code == 200

    asyncio.run(scenario())


def test_one_person_leaves_threads_to_others(bench: Bench) -> None:
    async def scenario() -> None:
        many = await bench.begin("/works", "mia", count=REQUEST_THREADS_EACH)
        more = asyncio.create_task(bench.get("/works", "mia"))
        other = await bench.begin("/works", "ben")
        assert not bench.begun.acquire(blocking=False)
        bench.go.set()
        assert [(await one).status_code for one in (*many, more, *other)] == [200] * (len(many) + 2)

    asyncio.run(scenario())


USER = Principal(kind=PrincipalKind.USER, name="mia", rights=frozenset(), sign_in="s1")
SERVICE = Principal(kind=PrincipalKind.SERVICE, name="bot", rights=frozenset(), sign_in="t1")


@pytest.mark.parametrize(
    ("principal", "address", "person"),
    [
        (USER, "10.0.0.1", "user mia"),
        (SERVICE, "10.0.0.1", "service t1"),
        (LOCAL, "10.0.0.1", "address 10.0.0.1"),
        (ANONYMOUS, "2001:db8::1:2:3:4", "address 2001:db8::/64"),
        (ANONYMOUS, "::ffff:10.0.0.1", "address 10.0.0.1"),
        (ANONYMOUS, "fe80::1%eth0", "address fe80::/64"),
        (ANONYMOUS, "testclient", "address testclient"),
    ],
)
def test_who_is_one_person(principal: Principal, address: str, person: str) -> None:
    assert person_of({"principal": principal, "client": (address, 1)}) == person
