from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import Busy, VirtualClock
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.lease import LIFETIME_S, Lease
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
    granted = lease.take("Ada", take_over=False)
    lease.check(granted.token)
    for token in (None, "guess"):
        with pytest.raises(Busy, match="Ada holds the control lease"):
            lease.check(token)


def test_lease_ends_when_its_holder_is_not_heard_of(lease: Lease, clock: VirtualClock) -> None:
    lease.take("Ada", take_over=False)
    after(clock, LIFETIME_S)
    lease.check(None)
    assert lease.describe().holder is None


def test_heartbeat_keeps_the_lease(lease: Lease, clock: VirtualClock) -> None:
    granted = lease.take("Ada", take_over=False)
    for _ in range(5):
        after(clock, 0.9 * LIFETIME_S)
        assert lease.renew(granted.token).expires_in_s == pytest.approx(LIFETIME_S)
    assert lease.describe().holder == "Ada"


def test_expired_lease_cannot_be_kept(lease: Lease, clock: VirtualClock) -> None:
    granted = lease.take("Ada", take_over=False)
    after(clock, LIFETIME_S)
    with pytest.raises(Busy, match="nobody holds it"):
        lease.renew(granted.token)


def test_take_over_must_be_asked_for_and_is_a_warning_in_the_log(lease: Lease, events: EventLog) -> None:
    first = lease.take("Ada", take_over=False)
    with pytest.raises(Busy, match="take over"):
        lease.take("Bob", take_over=False)
    second = lease.take("Bob", take_over=True)
    with pytest.raises(Busy):
        lease.check(first.token)
    lease.check(second.token)
    told = events.recent(1)[0]
    assert (told.kind, told.level) == ("lease.changed", EventLevel.WARNING)
    assert told.data == {"holder": "Bob", "before": "Ada"}


def test_released_lease_frees_the_rig(lease: Lease) -> None:
    lease.release(lease.take("Ada", take_over=False).token)
    assert lease.describe().holder is None
    assert lease.describe().expires_in_s is None
