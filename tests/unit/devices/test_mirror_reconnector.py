"""The mirrors between looks: pinged five times a second, and off while the operator says so."""

from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeRig

from foveacam_hardware.contract import NotConnected, Stopped, VirtualClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.device_reconnector import (
    MIRRORS,
    PING_PERIOD_NS,
    DeviceReconnector,
    MirrorLinkMonitor,
)


class Setup:
    def __init__(self, folder: Path) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self.store = Store(folder)
        self.events = EventLog(self.store)
        self.watch = DeviceReconnector(clock=self.clock, events=self.events)
        self.rig = FakeRig(self.clock)
        self.rig.mirrors.connect()
        self.rig.mirrors.enable()
        self.pings = 0
        self.care = MirrorLinkMonitor(clock=self.clock, reconnector=self.watch)
        self.rig.mirrors.ping = self._ping  # type: ignore[method-assign]  # counted

    def _ping(self) -> float:
        self.pings += 1
        if self.rig.mirrors.lost:
            self.rig.mirrors.connected = False
            raise NotConnected("mirrors: no controller; plug it in")
        return 0.5

    def keep_for(self, duration_ns: int) -> None:
        end_ns = self.clock.now_ns() + duration_ns
        while self.clock.now_ns() < end_ns:
            self.care.ping_if_due(self.rig)
            self.clock.sleep_until_ns(self.clock.now_ns() + 10_000_000)


@pytest.fixture
def setup(tmp_path: Path) -> Setup:
    return Setup(tmp_path)


def test_the_controller_is_pinged_five_times_a_second(setup: Setup) -> None:
    setup.keep_for(1_000_000_000)

    assert PING_PERIOD_NS == 200_000_000
    assert setup.pings == 5


def test_a_controller_that_is_gone_is_told_at_the_next_ping_and_then_left_to_the_watch(setup: Setup) -> None:
    setup.rig.mirrors.lost = True
    setup.keep_for(600_000_000)

    problem = setup.watch.problem_of(MIRRORS)
    assert problem is not None
    assert "plug it in" in problem.detail
    assert setup.pings == 1


def test_mirrors_switched_off_stay_off_and_refuse_to_move(setup: Setup) -> None:
    setup.care.switch(setup.rig, on=False)
    assert not setup.rig.mirrors.enabled
    with pytest.raises(Stopped, match="POST /api/v1/mirrors/enable"):
        setup.care.check()

    setup.rig.mirrors.enable()  # as a reconnect does
    setup.keep_for(PING_PERIOD_NS)
    assert not setup.rig.mirrors.enabled


def test_mirrors_switched_on_again_may_move(setup: Setup) -> None:
    setup.care.switch(setup.rig, on=False)
    setup.care.switch(setup.rig, on=True)

    setup.care.check()
    assert setup.rig.mirrors.enabled
    assert setup.care.rail_wanted
