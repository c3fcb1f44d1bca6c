import asyncio
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.support.full_database import ANY_SIZE, limit_database_pages

from foveacam_server.foundation import events as events_module
from foveacam_server.foundation.events import Event, EventLevel, EventLog
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.foundation.store import Store
from foveacam_server.rig.schema import StopChange, StopDocument

PATIENCE_S = 10.0


@pytest.fixture
def log(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path) as store:
        found = EventLog(store)
        yield found
        found.close()


async def take(log: EventLog, count: int, last_id: int | None = None) -> list[Event]:
    """Return the next `count` events; emit two of them once the listener listens."""
    stream = log.listen(last_id)
    found: list[Event] = []
    asyncio.get_running_loop().call_later(0.0, lambda: [log.emit("k", "live 1"), log.emit("k", "live 2")])
    async with asyncio.timeout(PATIENCE_S):
        async for event in stream:
            found.append(event)
            if len(found) == count:
                break
    return found


class DeviceFaultEvent(ResponseModel):
    device: str


def test_event_carries_kind_level_and_data(log: EventLog) -> None:
    event = log.emit(
        "device.fault", "wide: gone", level=EventLevel.ERROR, data=DeviceFaultEvent(device="wide")
    )
    document = event.describe().as_json()
    assert (document["kind"], document["level"], document["data"]) == (
        "device.fault",
        "error",
        {"device": "wide"},
    )


def test_data_of_a_schema_is_its_json_without_what_was_not_set(tmp_path: Path) -> None:
    stop = StopDocument(engaged=False, since_utc=None, by=None)
    with Store(tmp_path) as store:
        first = EventLog(store)
        first.emit("stop.released", "released", data=StopChange(by="me", stop=stop))
        first.close()
        again = EventLog(store)
        (found,) = again.recent(1)
        again.close()
    assert found.data == {"by": "me", "stop": {"engaged": False, "since_utc": None, "by": None}}


def test_listener_hears_what_comes_and_nothing_older(log: EventLog) -> None:
    log.emit("k", "old")
    assert [event.message for event in asyncio.run(take(log, 2))] == ["live 1", "live 2"]


def test_listener_continues_where_it_left_off(log: EventLog) -> None:
    seen = log.emit("k", "seen")
    log.emit("k", "missed")
    found = asyncio.run(take(log, 3, last_id=seen.id))
    assert [event.message for event in found] == ["missed", "live 1", "live 2"]


def test_replay_reaches_back_past_the_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Store(tmp_path) as store:
        first = EventLog(store)
        for n in range(50):
            first.emit("k", str(n))
        first.close()
        monkeypatch.setattr(events_module, "RING", 5)
        again = EventLog(store)
        replayed = again.after(10)
        again.close()
    assert [event.id for event in replayed] == list(range(11, 51))


def test_ids_go_on_after_a_restart(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        first = EventLog(store)
        last = first.emit("k", "before")
        first.close()
        again = EventLog(store)
        following = again.emit("k", "after")
        again.close()
    assert following.id == last.id + 1


def test_listener_that_is_too_slow_is_cut_off_and_nobody_waits_for_it(
    log: EventLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events_module, "BACKLOG", 3)

    async def listen() -> int:
        stream = log.listen(0)
        log.emit("k", "first")
        first = await anext(stream)
        for n in range(10):
            log.emit("k", str(n))
        await asyncio.sleep(0)  # the loop hands all ten over at once
        heard = 0
        async with asyncio.timeout(PATIENCE_S):
            async for _ in stream:
                heard += 1
        assert first.message == "first"
        return heard

    assert asyncio.run(listen()) < 10


def test_hanging_up_ends_every_listener(log: EventLog) -> None:
    async def listen() -> list[Event]:
        stream = log.listen()
        asyncio.get_running_loop().call_later(0.0, log.end_listeners)
        async with asyncio.timeout(PATIENCE_S):
            return [event async for event in stream]

    assert asyncio.run(listen()) == []


def test_a_full_disk_is_told_and_what_it_did_not_take_is_written_once_there_is_room(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        log = EventLog(store)
        limit_database_pages(store, 1)
        told = [log.emit("k", "x" * 5000) for _ in range(30)]
        until(lambda: "storage.fault" in kinds(log))
        assert any("the disk is full" in event.data.get("detail", "") for event in log.recent(200))
        limit_database_pages(store, ANY_SIZE)
        until(lambda: "storage.recovered" in kinds(log))
        log.close()
        again = EventLog(store)
        kept = [event.id for event in again.after(0)]
        again.close()
    assert kept == list(range(1, len(told) + 3))
    assert (log.fault, log.unwritten) == (None, 0)


def kinds(log: EventLog) -> list[str]:
    """Return the kinds of the events."""
    return [event.kind for event in log.recent(200)]


def until(reached: Callable[[], bool]) -> None:
    """Wait until something is so."""
    for _ in range(round(PATIENCE_S / 0.01)):
        if reached():
            return
        threading.Event().wait(0.01)
    raise AssertionError("it did not become so")


def test_a_long_replay_lets_others_have_their_turn(log: EventLog) -> None:
    for number in range(100):
        log.emit("kind", str(number))

    async def listen() -> int:
        turns = 0

        async def count() -> None:
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        counting = asyncio.create_task(count())
        stream = log.listen(0)
        await anext(stream)
        before = turns
        for _ in range(50):
            await anext(stream)
        counting.cancel()
        return turns - before

    assert asyncio.run(listen()) >= 50
