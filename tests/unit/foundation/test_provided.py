"""Services that routes find by their type."""

from typing import Protocol

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.local_server import serving

from foveacam_hardware.contract import DeviceFault
from foveacam_server.foundation.http.provided import Provided, ServiceRegistry


class Counter:
    def __init__(self) -> None:
        self.count = 0


class Counting(Protocol):
    count: int


def test_a_route_gets_the_service_of_its_class_and_of_a_protocol() -> None:
    app, counter, other = FastAPI(), Counter(), Counter()

    @app.post("/count")
    def count(
        mine: Provided[Counter], seen: Provided[Counting], none: Provided[Counter | None]
    ) -> list[bool]:
        mine.count += 1
        return [mine is counter, seen is other, none is None]

    registry = ServiceRegistry({Counter | None: None})
    registry.add(Counter, counter)
    registry.add(Counting, other)
    app.state.provided = registry
    with serving(app) as port:
        answer = httpx.post(f"http://127.0.0.1:{port}/count", trust_env=False)
    assert answer.json() == [True, True, True]
    assert counter.count == 1


def test_a_route_that_asks_for_what_was_not_opened_is_named() -> None:
    def route(_counter: Provided[Counter], _seen: Provided[Counting]) -> None: ...

    registry = ServiceRegistry({Counting: Counter()})
    with pytest.raises(DeviceFault, match=r"test_provided\..*route asks for .* not opened: Counter; open"):
        registry.check(route)
    registry.add(Counter, Counter())
    registry.check(route)


def test_a_service_is_opened_of_what_its_constructor_asks_for() -> None:
    class Clerk:
        def __init__(self, counter: Counter, *, pace: float = 2.0) -> None:
            self.counter, self.pace = counter, pace

    counter = Counter()
    registry = ServiceRegistry({Counter: counter})
    registry.open(Clerk)
    clerk = registry.get(Clerk)
    assert (clerk.counter, clerk.pace) == (counter, 2.0)
