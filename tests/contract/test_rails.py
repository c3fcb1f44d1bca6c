"""What every rail of the contract does, moved by hand or by a motor, in this process or behind a port."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from foveacam_hardware.contract import (
    Clock,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    Rail,
    RailLimits,
    RailState,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.drivers.positioners.manual import ManualRail
from foveacam_hardware.rail_config import PAPER_PLACES
from foveacam_hardware.sim.far_ends.board_far_end import BoardKind
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.grbl_firmware import RAIL_SWITCH_MM
from foveacam_hardware.sim.pan_tilt import TurningHistory, TurnSegment

KINDS = ("loopback", "process", "manual")
BRISK = dict.fromkeys((24, 25, 110, 111, 112, 120, 121, 122), 1e6)
"""Settings of a board whose motors are quick, for tests in real time: homing takes a tenth of a second."""
STROLL = {112: 6_000.0}
"""A second for 100 mm: slow enough to be held on its way by a busy machine."""
POLL_NS = 10_000_000
PATIENCE_NS = 30_000_000_000
LIMITS = RailLimits(min_m=-0.3, max_m=0.3)
STEP_MM = 0.01


@dataclass
class Bench:
    rail: Rail
    clock: Clock
    rig: TurningHistory
    """Where the rig really stands."""
    stroll: Callable[[], None] = lambda: None
    """Makes its motor slow."""

    @property
    def stands_at_mm(self) -> float:
        return self.rig.slide_mm(self.clock.now_ns())[0]

    def rest(self) -> RailState:
        end_ns = self.clock.now_ns() + PATIENCE_NS
        while (state := self.rail.state).moving:
            assert self.clock.now_ns() < end_ns
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        return state

    def homed(self) -> Rail:
        self.rail.connect()
        self.rail.home()
        self.rest()
        return self.rail


def motorised(board: BoardLoopback[GrblFarEnd] | BoardProcess, clock: Clock, rig: TurningHistory) -> Bench:
    board.set_faults(settings=BRISK)
    mounting = GrblRailMounting(zero_m=1e-3 * RAIL_SWITCH_MM, speed_m_s=16.0)
    rail = GrblRail(board.open, clock, limits=LIMITS, mounting=mounting)
    return Bench(rail, clock, rig, lambda: board.set_faults(settings=STROLL))


class Shafts:
    """Shafts between motors that a module's tests share and the rig of the test that runs."""

    def __init__(self) -> None:
        self.rig = TurningHistory()

    def add_segment(self, segment: TurnSegment) -> None:
        self.rig.add_segment(segment)


@pytest.fixture(scope="module")
def process() -> Iterator[tuple[BoardProcess, Shafts]]:
    shafts = Shafts()
    with BoardProcess(BoardKind.GRBL_WITH_RAIL, shafts) as board:
        board.open().close()  # it is up
        yield board, shafts


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    rig, virtual = TurningHistory(), VirtualClock(1_000_000_000)
    match request.param:
        case "manual":
            built = Bench(ManualRail(limits=LIMITS), virtual, rig)
        case "loopback":
            built = motorised(BoardLoopback(GrblFarEnd(virtual, rig, has_rail=True), virtual), virtual, rig)
        case _:
            board, shafts = request.getfixturevalue("process")
            shafts.rig = rig
            board.power_cycle()
            built = motorised(board, MonotonicClock(), rig)
    yield built
    built.rail.close()


def test_it_says_who_it_is_before_and_after_it_is_connected(bench: Bench) -> None:
    serial = bench.rail.info.serial
    bench.rail.connect()

    assert bench.rail.info.serial == serial
    assert bench.rail.info.model


def test_connecting_and_closing_twice_is_harmless(bench: Bench) -> None:
    assert not bench.rail.state.connected
    bench.rail.connect()
    bench.rail.connect()
    assert bench.rail.state == RailState(connected=True)

    bench.rail.close()
    bench.rail.close()

    assert bench.rail.state == RailState(connected=False)


@pytest.mark.parametrize("action", ["home", "hold", "move"])
def test_nothing_moves_before_it_is_connected(bench: Bench, action: str) -> None:
    with pytest.raises(NotConnected, match="connect"):
        if action == "move":
            bench.rail.move_to(0.0)
        else:
            getattr(bench.rail, action)()


def test_after_homing_the_rig_stands_in_the_middle(bench: Bench) -> None:
    bench.homed()

    assert bench.stands_at_mm == 0.0


def test_it_goes_to_each_of_the_papers_five_places(bench: Bench) -> None:
    rail = bench.homed()
    for place in PAPER_PLACES:
        rail.move_to(place.position_m)
        state = bench.rest()

        assert state.fault is None
        if isinstance(rail, ManualRail):
            assert rail.wanted_m == place.position_m
            assert state.position_m is None
        else:
            assert state.position_m == pytest.approx(place.position_m, abs=1e-3 * STEP_MM)
            assert bench.stands_at_mm == pytest.approx(1e3 * place.position_m, abs=STEP_MM)


def test_a_place_that_it_cannot_reach_is_refused_and_nothing_moves(bench: Bench) -> None:
    rail = bench.homed()

    for position_m in (0.301, -0.301, 5.0, float("nan"), float("inf")):
        with pytest.raises(OutOfRange, match="outside -300 to 300 mm; choose"):
            rail.move_to(position_m)
        assert not rail.state.moving


def test_a_hold_stops_it_on_its_way(bench: Bench) -> None:
    rail = bench.homed()
    bench.stroll()
    rail.move_to(0.3)

    rail.hold()
    state = bench.rest()

    assert state.fault is None
    assert abs(bench.stands_at_mm) < 299.0
    rail.move_to(0.0)  # and it moves again
    assert bench.rest().fault is None


def test_the_last_of_two_moves_counts(bench: Bench) -> None:
    rail = bench.homed()
    bench.stroll()
    rail.move_to(0.3)

    rail.move_to(-0.1)
    state = bench.rest()

    if rail.moves_itself:
        assert state.position_m == pytest.approx(-0.1, abs=1e-3 * STEP_MM)
        assert bench.stands_at_mm == pytest.approx(-100.0, abs=STEP_MM)
