"""Limits of one person and of all, and whose turn is next."""

import asyncio

import pytest

from foveacam_server.foundation.errors import AllTaken, PersonLimit, problem_of
from foveacam_server.foundation.persons.person_quota import FairQueue, Places, close_of
from foveacam_server.foundation.persons.person_turns import Turns


@pytest.fixture
def places() -> Places:
    return Places("pages", most=3, most_each=2, remedy="close a page")


def test_one_person_takes_no_more_than_the_own_share_and_gives_it_back(places: Places) -> None:
    with places.hold("mia"), places.hold("mia"):
        with pytest.raises(PersonLimit, match="you hold 2 pages, as many as one person may; close a page"):
            places.take("mia")
        with places.hold("ben"):
            assert places.taken == 3
    with places.hold("mia"):
        assert places.taken == 1
    assert places.taken == 0


def test_all_together_take_no_more_than_there_are(places: Places) -> None:
    with places.hold("mia"), places.hold("ben"), places.hold("eva"):
        with pytest.raises(AllTaken, match="all 3 places for pages are taken"):
            places.take("tom")
        with pytest.raises(AllTaken):
            places.take(None)
    with places.hold(None), places.hold(None), places.hold(None):
        assert places.taken == 3


def test_a_refusal_says_whose_limit_it_is_and_when_to_ask_again(places: Places) -> None:
    own = problem_of(PersonLimit("yours"))
    everybody = problem_of(AllTaken("all"))
    assert (own.kind.status, own.kind.slug) == (429, "person-limit")
    assert (everybody.kind.status, everybody.kind.slug) == (503, "all-taken")
    assert own.headers == everybody.headers == {"Retry-After": "5"}
    assert close_of(PersonLimit("yours")) == (4429, "yours")
    code, reason = close_of(AllTaken("木" * 200))
    assert code == 1013
    assert reason == "木" * 41  # 123 bytes


def test_a_queue_serves_each_person_in_turn() -> None:
    queue: FairQueue[str] = FairQueue()
    for person, item in (("mia", "a"), ("mia", "b"), ("mia", "c"), (None, "own"), ("ben", "x")):
        queue.put(person, item)
    assert queue.remove("b")
    assert not queue.remove("b")
    assert queue.take(not_of={"mia", None}) == ("ben", "x")
    assert [queue.take() for _ in range(3)] == [("mia", "a"), (None, "own"), ("mia", "c")]
    assert queue.take() is None
    assert len(queue) == 0


def test_turns_are_limited_in_all_and_for_each_person() -> None:
    order: list[str] = []

    async def work(turns: Turns, person: str, name: str, go: asyncio.Event) -> None:
        await turns.begin(person)
        order.append(name)
        await go.wait()
        turns.end(person)

    async def scenario() -> None:
        turns, go = Turns(2, each=1), asyncio.Event()
        tasks = [
            asyncio.create_task(work(turns, person, name, go))
            for person, name in (("mia", "mia 1"), ("mia", "mia 2"), ("ben", "ben 1"), ("eva", "eva 1"))
        ]
        await asyncio.sleep(0)
        assert order == ["mia 1"] or order == ["mia 1", "ben 1"]
        await asyncio.sleep(0)
        assert order == ["mia 1", "ben 1"]
        assert turns.running == 2
        tasks[3].cancel()
        go.set()
        await asyncio.gather(*tasks, return_exceptions=True)
        assert order == ["mia 1", "ben 1", "mia 2"]
        assert turns.running == 0

    asyncio.run(scenario())


def test_a_turn_that_comes_as_its_person_gives_up_is_free_for_the_next() -> None:
    async def scenario() -> None:
        turns = Turns(1, each=1)
        await turns.begin("mia")
        late = asyncio.create_task(turns.begin("ben"))
        await asyncio.sleep(0)
        turns.end("mia")  # it is ben's, who has not been told yet
        late.cancel()
        await asyncio.gather(late, return_exceptions=True)
        assert turns.running == 0
        await asyncio.wait_for(turns.begin("eva"), 10.0)

    asyncio.run(scenario())
