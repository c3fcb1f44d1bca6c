import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import Busy, InvalidInput, VirtualClock
from foveacam_server.foundation.errors import Forbidden
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.lease import IDLE_S, LIFETIME_S, OFFER_S, Lease, LeaseClaim
from foveacam_server.foundation.store import Store


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path) as store:
        log = EventLog(store)
        yield log
        log.close()


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def lease(events: EventLog, clock: VirtualClock) -> Lease:
    return Lease(clock=clock, events=events)


def after(clock: VirtualClock, seconds: float) -> None:
    clock.sleep_until_ns(clock.now_ns() + round(seconds * 1e9))


def test_without_a_holder_anybody_may_move(lease: Lease) -> None:
    lease.check(None)


def test_holder_may_move_and_others_are_told_who_it_is(lease: Lease) -> None:
    granted = lease.take(LeaseClaim(holder="Ada"))
    lease.check(granted.token)
    for token in (None, "guess"):
        with pytest.raises(Busy, match="Ada holds the control lease"):
            lease.check(token)


def test_lease_ends_when_its_holder_is_not_heard_of(lease: Lease, clock: VirtualClock) -> None:
    lease.take(LeaseClaim(holder="Ada"))
    after(clock, LIFETIME_S)
    lease.check(None)
    assert lease.describe().holder is None


def test_a_lease_lasts_longer_by_the_time_in_which_the_server_read_no_renewal(
    events: EventLog, clock: VirtualClock
) -> None:
    blocked_ns = [0]
    lease = Lease(clock=clock, events=events, blocked_ns=lambda: blocked_ns[0])
    granted = lease.take(LeaseClaim(holder="Ada"))
    after(clock, LIFETIME_S + 4.0)
    blocked_ns[0] = 5_000_000_000
    assert lease.renew(granted.token).expires_in_s == pytest.approx(LIFETIME_S)
    after(clock, LIFETIME_S)
    assert lease.describe().holder is None  # the block before the renewal counts no more


def test_heartbeat_keeps_the_lease(lease: Lease, clock: VirtualClock) -> None:
    granted = lease.take(LeaseClaim(holder="Ada"))
    for _ in range(5):
        after(clock, 0.9 * LIFETIME_S)
        assert lease.renew(granted.token).expires_in_s == pytest.approx(LIFETIME_S)
    assert lease.describe().holder == "Ada"


def test_expired_lease_cannot_be_kept(lease: Lease, clock: VirtualClock) -> None:
    granted = lease.take(LeaseClaim(holder="Ada"))
    after(clock, LIFETIME_S)
    with pytest.raises(Busy, match="the lease is free"):
        lease.renew(granted.token)


def test_take_over_must_be_asked_for_and_is_a_warning_in_the_log(lease: Lease, events: EventLog) -> None:
    first = lease.take(LeaseClaim(holder="Ada"))
    with pytest.raises(Busy, match="take over"):
        lease.take(LeaseClaim(holder="Bob"))
    second = lease.take(LeaseClaim(holder="Bob", take_over=True))
    with pytest.raises(Busy):
        lease.check(first.token)
    lease.check(second.token)
    told = events.recent(1)[0]
    assert (told.kind, told.level) == ("lease.changed", EventLevel.WARNING)
    assert told.data == {"holder": "Bob", "before": "Ada"}


def test_released_lease_frees_the_rig(lease: Lease) -> None:
    lease.release(lease.take(LeaseClaim(holder="Ada")).token)
    assert lease.describe().holder is None
    assert lease.describe().expires_in_s is None


def claim(
    person: str, *, admin: bool = False, take_over: bool = False, reason: str | None = None
) -> LeaseClaim:
    return LeaseClaim(
        holder="browser", person=person, may_take_over=admin, take_over=take_over, reason=reason
    )


def test_where_people_sign_in_an_admin_alone_takes_over_and_says_why(lease: Lease, events: EventLog) -> None:
    ada = lease.take(claim("ada"))
    assert lease.describe().person == "ada" and ada.holder == "ada (browser)"
    for reason in (None, "it is my turn"):
        with pytest.raises(Forbidden, match="only an admin may"):
            lease.take(claim("otto", take_over=True, reason=reason))
    with pytest.raises(InvalidInput, match="without a reason"):
        lease.take(claim("iris", admin=True, take_over=True))
    lease.check(ada.token)
    iris = lease.take(claim("iris", admin=True, take_over=True, reason="a fire drill"))
    assert "took the control lease over from ada (browser): a fire drill" in events.recent(1)[0].message
    assert lease.take(claim("iris", take_over=True)).token != iris.token  # one's own other page


def test_the_holder_hands_over_to_who_asked_and_nobody_comes_between(
    lease: Lease, clock: VirtualClock, events: EventLog
) -> None:
    with pytest.raises(Busy, match="which is free"):
        lease.ask(claim("otto"))
    ada = lease.take(claim("ada"))
    with pytest.raises(Busy, match="there is none"):
        lease.answer(ada.token, hand_over=True)
    assert lease.ask(claim("otto")).asked_by == "otto (browser)"
    assert events.recent(1)[0].kind == "lease.asked"
    with pytest.raises(Busy, match="asks for the lease already"):
        lease.ask(claim("rex"))
    with pytest.raises(Busy, match="ada"):
        lease.answer("another token", hand_over=True)
    assert lease.answer(ada.token, hand_over=True).holder is None
    with pytest.raises(Busy, match="kept for otto"):
        lease.take(claim("rex"))
    lease.check(lease.take(claim("otto")).token)
    with pytest.raises(Busy, match="otto"):
        lease.check(ada.token)


def test_what_was_handed_over_is_free_again_when_it_is_not_taken(lease: Lease, clock: VirtualClock) -> None:
    ada = lease.take(claim("ada"))
    lease.ask(claim("otto"))
    lease.answer(ada.token, hand_over=True)
    after(clock, OFFER_S + 1.0)
    assert lease.take(claim("rex")).holder == "rex (browser)"


def test_who_asks_may_be_refused(lease: Lease) -> None:
    ada = lease.take(claim("ada"))
    lease.ask(claim("otto"))
    assert lease.answer(ada.token, hand_over=False).asked_by is None
    lease.check(ada.token)


def test_a_holder_who_moves_nothing_loses_the_lease(
    lease: Lease, clock: VirtualClock, events: EventLog
) -> None:
    ada = lease.take(claim("ada"))
    after(clock, 10.0)
    lease.check(ada.token)
    lease.renew(ada.token)
    for _ in range(round(IDLE_S / 10.0)):
        after(clock, 10.0)
        lease.renew(ada.token)
    after(clock, 10.0)
    with pytest.raises(Busy, match="the lease is free"):
        lease.renew(ada.token)
    assert lease.describe().holder is None
    assert "nothing moved for 600 s" in events.recent(1)[0].message


def test_of_many_that_race_one_wins_and_the_others_are_told(lease: Lease) -> None:
    won: list[str] = []
    told: list[str] = []

    def race(number: int) -> None:
        try:
            won.append(lease.take(claim(f"service{number}")).holder)
        except Busy as error:
            told.append(str(error))

    threads = [threading.Thread(target=race, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(won) == 1 and len(told) == 7
    assert all(f"{won[0]} holds the control lease" in message for message in told)
