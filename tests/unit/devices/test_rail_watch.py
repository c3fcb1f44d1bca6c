"""What becomes of a rail is told in the event log: the real driver on a Grbl board, on virtual time."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeRig

from foveacam_hardware.contract import NotConnected, RailLimits, VirtualClock
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.pan_tilt import TurningHistory
from foveacam_server.foundation.events import Event, EventLevel, EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.device_reconnector import LAST_RETRY_S, RAIL, DeviceReconnector
from foveacam_server.rig.status import RigStatus, rail_state

LOOK_NS = 250_000_000


class Watched:
    """A rail, and a watch that looks at it as often as the hardware thread does."""

    def __init__(self, folder: Path) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self.board = BoardLoopback(GrblFarEnd(self.clock, TurningHistory(), has_rail=True), self.clock)
        self.rail = GrblRail(
            self.board.open,
            self.clock,
            limits=RailLimits(min_m=-0.3, max_m=0.3),
            mounting=GrblRailMounting(zero_m=0.31, speed_m_s=0.1),
        )
        self.store = Store(folder)
        self.events = EventLog(self.store)
        self.watch = DeviceReconnector(clock=self.clock, events=self.events)
        self.rig = FakeRig(self.clock)

    def look(self, times: int = 1) -> list[Event]:
        """Look so often; return all that was told so far."""
        for _ in range(times):
            self.clock.sleep_until_ns(self.clock.now_ns() + LOOK_NS)
            self.watch.update(self.rig, RigStatus(rail=rail_state(self.rail)))
        return self.events.recent(100)

    def homed(self) -> "Watched":
        self.rail.connect()
        self.rail.home()
        while self.rail.state.moving:
            self.look()
        assert self.events.recent(1) == []
        return self


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    made = Watched(tmp_path)
    yield made
    made.rail.close()
    made.events.close()
    made.store.close()


def kinds(events: list[Event]) -> list[str]:
    return [event.kind for event in events]


def test_an_alarm_of_its_board_is_told_with_what_to_do_and_so_is_its_end(watched: Watched) -> None:
    watched.homed().board.hit_a_limit()

    (told,) = watched.look(times=3)

    assert (told.kind, told.level, told.data["device"]) == ("device.fault", EventLevel.ERROR, "rail")
    assert "limit switch was hit" in told.message
    assert told.data["remedy"] == "home it again"
    assert [problem.device for problem in watched.watch.problems] == [RAIL]
    watched.rail.home()
    assert kinds(watched.look()) == ["device.fault", "device.recovered"]
    assert watched.watch.problems == ()


def test_an_alarm_is_no_reason_to_connect_anything_again(watched: Watched) -> None:
    watched.homed().board.hit_a_limit()
    watched.look(times=round(2 * LAST_RETRY_S / 0.25))

    assert not watched.watch.retry_due()


def test_a_lost_rail_is_told_tried_again_and_told_to_be_back(watched: Watched) -> None:
    watched.homed().board.unplug()
    (told,) = watched.look(times=3)
    assert told.data["device"] == "rail"
    assert "plug it in again" in told.message
    assert watched.watch.retry_due()

    watched.board.plug()
    watched.rail.connect()

    assert kinds(watched.look(times=2)) == ["device.fault", "device.recovered"]


def test_a_rail_that_stands_still_on_its_way_is_told_and_moves_again_when_told_to(watched: Watched) -> None:
    watched.homed().board.set_faults(seized=True)
    watched.rail.move_to(0.2)
    assert watched.look(times=4) == []

    (told,) = watched.look(times=8)

    assert "has stood still for 2 s" in told.message
    assert told.data["remedy"] == "look at it, then move it again"
    assert not watched.rail.state.moving
    watched.board.set_faults(seized=False)
    watched.rail.move_to(0.2)
    assert kinds(watched.look(times=30)) == ["device.fault", "device.recovered"]
    assert watched.rail.state.position_m == pytest.approx(0.2, abs=1e-5)


def test_a_rail_that_is_lost_after_an_alarm_is_told_twice(watched: Watched) -> None:
    watched.homed().board.hit_a_limit()
    watched.look(times=2)
    watched.board.unplug()

    alarm, lost = watched.look(times=3)

    assert "limit switch" in alarm.message
    assert "plug it in again" in lost.message
    assert watched.watch.retry_due()


def test_a_rail_that_was_never_there_is_told_once(watched: Watched) -> None:
    watched.board.unplug()
    watched.watch.add_problem(RAIL, detail="rail: no such port; plug it in")

    assert kinds(watched.look(times=3)) == ["device.fault"]


def test_a_board_that_says_nothing_holds_whoever_connects_up_only_once_in_a_while(watched: Watched) -> None:
    watched.homed().board.set_faults(silent=True)
    watched.look()
    waited_s = []
    for _ in range(4):
        began_ns = watched.clock.now_ns()
        with pytest.raises(NotConnected, match="answers there"):
            watched.rail.connect()
        waited_s.append((watched.clock.now_ns() - began_ns) / 1e9)
        watched.clock.sleep_until_ns(watched.clock.now_ns() + 4_000_000_000)

    assert [seconds > 1.0 for seconds in waited_s] == [True, False, False, True]
    assert waited_s[1] == 0.0
