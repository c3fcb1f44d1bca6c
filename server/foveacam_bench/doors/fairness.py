"""Whether one person can starve another (`bench doors`), for one limited resource after the other.

One person takes all that the server gives, and a second one then asks for it. The server has users and a
simulated rig. The second is starved if refused, or served later than `BOUND_S`.
"""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_client.document import JsonObject
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import UserRole
from foveacam_server.foundation.store import Store
from foveacam_web.viser_page import viser_subprotocol

BOUND_S = 10.0
"""Longest time until the second person is served, on two cores."""
TAKEN_S = 2.0
"""Time after which the first person has all that is available; requests that still wait keep waiting."""
PATIENCE_S = 60.0
QUICK_RESOURCES = ("views", "events", "uploads")
MANY, FEW = 80, 12
"""Requests of the first person for resources that are held, and for those that compute; more than one person
may have."""
CROSSING = 900
"""Bars of a map each way: 9 000 corners, and some 810 000 places where they cross."""
RECORDED_S = 2
BEGIN = '{"type": "begin"}'
PASSWORD = "correct horse battery"  # noqa: S105 - of users that live as long as the bench


@dataclass(frozen=True, slots=True, kw_only=True)
class _Person:
    """A signed-in person."""

    url: str
    cookie: str
    client: httpx.AsyncClient

    @asynccontextmanager
    async def answered(
        self, method: str, path: str, body: object = None, **headers: str
    ) -> AsyncIterator[httpx.Response]:
        """Send a request and yield its answer; raise `httpx.HTTPStatusError` for a refusal."""
        answer = await self.client.request(method, f"/api/v1{path}", json=body, headers=headers)
        yield answer.raise_for_status()

    @asynccontextmanager
    async def stream(self, path: str) -> AsyncIterator[None]:
        """Hold a response that does not end."""
        async with self.client.stream("GET", f"/api/v1{path}") as answer:
            answer.raise_for_status()
            yield

    @asynccontextmanager
    async def socket(
        self, path: str, *, begin: str | None = None, protocol: str | None = None
    ) -> AsyncIterator[None]:
        """Hold a WebSocket that has sent its first message, after `begin` was sent to it."""
        url = f"ws{self.url.removeprefix('http')}{path}"
        async with connect(
            url,
            additional_headers={"Cookie": f"{COOKIE}={self.cookie}"},
            subprotocols=None if protocol is None else [Subprotocol(protocol)],
            compression=None,
            max_size=None,
            proxy=None,
        ) as socket:
            if begin is not None:
                await socket.send(begin)
            await socket.recv()
            yield


@dataclass(frozen=True, slots=True, kw_only=True)
class _Resource:
    """A limited resource. `take` acquires it for a person and holds it; its number differs a request."""

    name: str
    take: Callable[[_Person, int], AbstractAsyncContextManager[object]]
    first: str = "vera"
    """The user who takes all of it."""
    many: int = MANY
    """Number of requests for it."""


def fairness_figures(folder: Path, *, quick: bool = False) -> Figures:
    """Return on how many resources one person starved another, and how long the other waited for each.

    `quick`: of `QUICK_RESOURCES` alone, which come at once.
    """
    cookies = _sign_in_all(folder / "data")
    with ServerProcess(folder, port=free_port()) as server:
        waited_s = asyncio.run(_ask_for_all(server.url, cookies, QUICK_RESOURCES if quick else ()))
    starved = [name for name, wait_s in waited_s.items() if wait_s is None or wait_s > BOUND_S]
    return {
        "one_person_starves_another": len(starved),
        "one_person_starves_another_of": starved,
        "second_person_bound_s": BOUND_S,
        "second_person_waited_s": {name: wait_s and round(wait_s, 2) for name, wait_s in waited_s.items()},
    }


def _sign_in_all(data: Path) -> dict[str, str]:
    """Create the users, and return the cookie of each."""
    with Store(data) as store:
        accounts = Accounts(store)
        try:
            people = {"ada": UserRole.ADMIN, "vera": UserRole.VIEWER, "olga": UserRole.OPERATOR}
            for name, role in {**people, "otto": UserRole.OPERATOR}.items():
                accounts.users.add(name, role, password=PASSWORD)
            return {
                name: accounts.begin(accounts.users.get(name), address="127.0.0.1", browser="bench")
                for name in ("vera", "olga", "otto")
            }
        finally:
            accounts.close()


async def _ask_for_all(url: str, cookies: dict[str, str], names: Sequence[str]) -> dict[str, float | None]:
    """Return the second person's wait for each resource, or for those in `names`; None: it was refused."""
    limits = httpx.Limits(max_connections=None)
    people: dict[str, _Person] = {}
    for name, cookie in cookies.items():
        client = httpx.AsyncClient(
            base_url=url, cookies={COOKIE: cookie}, timeout=PATIENCE_S, trust_env=False, limits=limits
        )
        people[name] = _Person(url=url.rstrip("/"), cookie=cookie, client=client)
    otto = people["otto"]
    try:
        resources = _resources(await _recording_id(otto), await _calibration_id(otto))
        return {
            resource.name: await _second_wait_s(resource, people[resource.first], otto)
            for resource in resources
            if not names or resource.name in names
        }
    finally:
        for person in people.values():
            await person.client.aclose()


async def _second_wait_s(resource: _Resource, first: _Person, second: _Person) -> float | None:
    greed = [asyncio.create_task(_hold(resource.take(first, number))) for number in range(resource.many)]
    await asyncio.sleep(TAKEN_S)
    began_s = time.monotonic()
    try:
        async with asyncio.timeout(2.0 * BOUND_S), resource.take(second, MANY):
            return time.monotonic() - began_s
    except (httpx.HTTPError, OSError, WebSocketException, TimeoutError):
        return None
    finally:
        for task in greed:
            task.cancel()
        await asyncio.gather(*greed, return_exceptions=True)
        await _cancel_jobs(second)
        await _drain(resource, first)


async def _drain(resource: _Resource, first: _Person) -> None:
    """Wait until all requests of the first person have ended, before the next resource is tried."""
    with contextlib.suppress(httpx.HTTPError, OSError, WebSocketException, TimeoutError):
        async with asyncio.timeout(PATIENCE_S), resource.take(first, MANY):
            pass


async def _hold(taken: AbstractAsyncContextManager[object]) -> None:
    async with taken:
        await asyncio.Event().wait()


async def _cancel_jobs(person: _Person) -> None:
    async with person.answered("GET", "/jobs?limit=100") as answer:
        jobs = [job["id"] for job in answer.json() if job["ended_utc"] is None]
    for job_id in jobs:
        async with person.answered("POST", f"/jobs/{job_id}/cancel"):
            pass


async def _calibration_id(person: _Person) -> str:
    """Return the id of the calibration in force."""
    async with person.answered("GET", "/calibrations/current") as answer:
        return str(answer.json()["id"])


async def _recording_id(person: _Person) -> str:
    """Make a recording and return its id."""
    request = {"name": "two seconds", "roles": ["wide"], "duration_s": RECORDED_S}
    async with person.answered("POST", "/recordings", request, Prefer="wait=30") as answer:
        return str(answer.json()["id"])


def _resources(recording_id: str, calibration_id: str) -> list[_Resource]:
    """Return the limited resources: those that answer at once before those that compute."""
    crossing = {"kind": "geojson", "document": _crossing_bars()}
    films, compared = f"/recordings/{recording_id}/films", f"a={calibration_id}&b={calibration_id}"
    pixel = {"pixel": {"x_px": 700.0, "y_px": 540.0}}

    def upload(person: _Person, number: int) -> AbstractAsyncContextManager[object]:
        return person.answered("POST", "/recordings/uploads", {"name": f"u{number}", "size_bytes": 1000})

    def planned_map(person: _Person, number: int) -> AbstractAsyncContextManager[object]:
        return person.answered("POST", "/planner/map", crossing if number < MANY else {"kind": "random"})

    def fixation(person: _Person, number: int) -> AbstractAsyncContextManager[object]:
        headers = {"Prefer": "wait=30"} if number == MANY else {}
        return person.answered("POST", "/fixations", pixel, **headers)

    def film(person: _Person, number: int) -> AbstractAsyncContextManager[object]:
        headers = {"Prefer": "wait=30"} if number == MANY else {}
        return person.answered("POST", films, {"fps": 5.0 + number}, **headers)

    return [
        _Resource(name="views", take=lambda person, _: person.socket("/api/v1/views/ws")),
        _Resource(
            name="3D panes", take=lambda person, _: person.socket("/viser/", protocol=viser_subprotocol())
        ),
        _Resource(name="events", take=lambda person, _: person.stream("/events")),
        _Resource(name="MJPEG", take=lambda person, _: person.stream("/views/wide/stream.mjpeg")),
        _Resource(
            name="figures",
            many=FEW,
            take=lambda person, _: person.answered("GET", f"/calibrations/compare.png?{compared}"),
        ),
        _Resource(name="maps", take=planned_map, many=FEW),
        _Resource(
            name="steering",
            take=lambda person, _: person.socket("/api/v1/mirrors/steering", begin=BEGIN),
            first="olga",
        ),
        _Resource(name="uploads", take=upload, first="olga"),
        _Resource(name="fixations", take=fixation, first="olga", many=FEW),
        _Resource(name="films", take=film, first="olga", many=FEW),
    ]


def _crossing_bars() -> JsonObject:
    lying = [_bar(0.0, at, CROSSING, at + 0.3) for at in range(CROSSING)]
    standing = [_bar(at, 0.0, at + 0.3, CROSSING) for at in range(CROSSING)]
    return {"type": "FeatureCollection", "features": lying + standing}


def _bar(x0: float, y0: float, x1: float, y1: float) -> JsonObject:
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    return {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
