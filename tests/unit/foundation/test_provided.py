"""Services that routes find by their type."""

from typing import Protocol

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.local_server import serving

from foveacam_hardware.contract import DeviceFault
from foveacam_server.foundation.http import provided
from foveacam_server.foundation.http.provided import Provided, ServiceRegistry


class Counter:
    def __init__(self) -> None:
        self.count = 0


class Counting(Protocol):
    count: int


@pytest.fixture(autouse=True)
def asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the routes of this file ask for stays here."""
    monkeypatch.setattr(provided, "_asked", set())


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
    registry.check()
    app.state.provided = registry
    with serving(app) as port:
        answer = httpx.post(f"http://127.0.0.1:{port}/count", trust_env=False)
    assert answer.json() == [True, True, True]
    assert counter.count == 1


def test_the_start_fails_when_a_route_asks_for_what_was_not_opened() -> None:
    def route(_counter: Provided[Counter], _seen: Provided[Counting]) -> None: ...

    registry = ServiceRegistry({Counting: Counter()})
    with pytest.raises(DeviceFault, match=r"not opened: Counter; open them in"):
        registry.check()
