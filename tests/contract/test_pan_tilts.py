"""What every pan-tilt of the contract does, driven by hand or by motors, in this process or behind a port."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeAlias

import pytest

from foveacam_hardware.contract import (
    Clock,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PanTilt,
    PanTiltPose,
    PanTiltState,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.board_far_end import BoardFaults, BoardKind
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import TurningHistory, TurnSegment

from .pan_tilt_boards import GRBL_STEP_DEG, PTU_STEP_DEG, bearing, reach

KINDS = ("grbl loopback", "grbl process", "ptu loopback", "ptu process", "manual")
GRBL_SPEED: BoardFaults = {"settings": {24: 1e6, 25: 1e6, 110: 1e6, 111: 1e6, 120: 1e6, 121: 1e6}}
PTU_SPEED: BoardFaults = {"steps_per_s": 2_000_000, "slow_ns": -8_000_000}
"""Motors (and a unit) that are quick, for tests in real time: homing takes a tenth of a second."""
GRBL_STROLL: BoardFaults = {"settings": {110: 600.0, 111: 600.0}}
PTU_STROLL: BoardFaults = {"steps_per_s": 200}
"""Motors that take several seconds for 60 degrees: slow enough to be met on their way by a busy machine."""
POLL_NS = 10_000_000
PATIENCE_NS = 30_000_000_000
SPEED_RAD_S = math.radians(10_000.0)
LIMITS = reach()


@dataclass
class Bench:
    pan_tilt: PanTilt
    clock: Clock
    rig: TurningHistory
    """Where the rig really stands."""
    step_deg: float = 0.0
    """Of its motors: as near as it can come to a bearing, and half of that is rounding."""
    stroll: Callable[[], None] = lambda: None
    """Makes its motors slow."""

    def stands_at(self, pan_deg: float, tilt_deg: float) -> bool:
        """Return whether the rig really points there, to the nearest step."""
        at_deg = self.rig.bearing_deg(self.clock.now_ns())
        near_deg = 0.5 * self.step_deg + 1e-9
        return max(abs(at_deg[0] - pan_deg), abs(at_deg[1] - tilt_deg)) <= near_deg

    def rest(self) -> PanTiltState:
        """Wait until it rests."""
        end_ns = self.clock.now_ns() + PATIENCE_NS
        while (state := self.pan_tilt.state).moving:
            assert self.clock.now_ns() < end_ns
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        return state

    def homed(self) -> PanTilt:
        self.pan_tilt.connect()
        self.pan_tilt.home()
        self.rest()
        return self.pan_tilt


Board: TypeAlias = BoardLoopback[GrblFarEnd] | BoardLoopback[PtuFarEnd] | BoardProcess


def on_grbl(board: Board, clock: Clock, rig: TurningHistory) -> Bench:
    board.set_faults(**GRBL_SPEED)
    mounting = GrblMounting(zero=bearing(72.0, 32.0), speed_rad_s=SPEED_RAD_S)
    driver = GrblPanTilt(board.open, clock, limits=LIMITS, mounting=mounting)
    return Bench(driver, clock, rig, GRBL_STEP_DEG, lambda: board.set_faults(**GRBL_STROLL))


def on_ptu(board: Board, clock: Clock, rig: TurningHistory) -> Bench:
    board.set_faults(**PTU_SPEED)
    driver = PtuPanTilt(board.open, clock, limits=LIMITS, mounting=PtuMounting(speed_rad_s=SPEED_RAD_S))
    return Bench(driver, clock, rig, PTU_STEP_DEG, lambda: board.set_faults(**PTU_STROLL))


class Shafts:
    """Shafts between motors that a module's tests share and the rig of the test that runs."""

    def __init__(self) -> None:
        self.rig = TurningHistory()

    def add_segment(self, segment: TurnSegment) -> None:
        self.rig.add_segment(segment)


def started(kind: BoardKind) -> Iterator[tuple[BoardProcess, Shafts]]:
    shafts = Shafts()
    with BoardProcess(kind, shafts) as process:
        process.open().close()  # it is up
        yield process, shafts


@pytest.fixture(scope="module")
def grbl() -> Iterator[tuple[BoardProcess, Shafts]]:
    yield from started(BoardKind.GRBL)


@pytest.fixture(scope="module")
def ptu() -> Iterator[tuple[BoardProcess, Shafts]]:
    yield from started(BoardKind.PTU)


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    rig = TurningHistory()
    virtual = VirtualClock(1_000_000_000)
    match request.param:
        case "manual":
            built = Bench(ManualPanTilt(), virtual, rig)
        case "grbl loopback":
            built = on_grbl(BoardLoopback(GrblFarEnd(virtual, rig), virtual), virtual, rig)
        case "ptu loopback":
            built = on_ptu(BoardLoopback(PtuFarEnd(virtual, rig), virtual), virtual, rig)
        case process:
            board, shafts = request.getfixturevalue(process.removesuffix(" process"))
            shafts.rig = rig
            board.power_cycle()
            on_board = on_grbl if process.startswith("grbl") else on_ptu
            built = on_board(board, MonotonicClock(), rig)
    yield built
    built.pan_tilt.close()


def test_it_says_who_it_is_before_and_after_it_is_connected(bench: Bench) -> None:
    serial = bench.pan_tilt.info.serial
    bench.pan_tilt.connect()

    assert bench.pan_tilt.info.serial == serial
    assert bench.pan_tilt.info.model


def test_connecting_and_closing_twice_is_harmless(bench: Bench) -> None:
    assert not bench.pan_tilt.state.connected
    bench.pan_tilt.connect()
    bench.pan_tilt.connect()
    assert bench.pan_tilt.state == PanTiltState(connected=True)

    bench.pan_tilt.close()
    bench.pan_tilt.close()

    assert bench.pan_tilt.state == PanTiltState(connected=False)


@pytest.mark.parametrize("action", ["home", "hold", "move"])
def test_nothing_moves_before_it_is_connected(bench: Bench, action: str) -> None:
    with pytest.raises(NotConnected, match="connect"):
        if action == "move":
            bench.pan_tilt.move_to(bearing(0.0, 0.0))
        else:
            getattr(bench.pan_tilt, action)()


def test_it_can_be_used_again_after_it_was_closed(bench: Bench) -> None:
    bench.homed()
    bench.pan_tilt.close()

    bench.homed().move_to(bearing(3.0, -2.0))

    assert not bench.rest().fault


def test_a_move_begins_at_once_and_ends_at_rest_where_it_was_asked_for(bench: Bench) -> None:
    pan_tilt = bench.homed()
    bench.stroll()
    pan_tilt.move_to(bearing(12.3, -7.5))

    assert pan_tilt.state.moving is pan_tilt.moves_itself
    state = bench.rest()

    assert state.fault is None
    if isinstance(pan_tilt, ManualPanTilt):
        assert pan_tilt.wanted == bearing(12.3, -7.5)
        assert state.pose is None
    else:
        assert state.pose is not None
        assert math.degrees(state.pose.pan_rad) == pytest.approx(12.3, abs=0.6 * bench.step_deg)
        assert math.degrees(state.pose.tilt_rad) == pytest.approx(-7.5, abs=0.6 * bench.step_deg)
        assert bench.stands_at(12.3, -7.5)


def test_after_homing_the_rig_points_straight_ahead(bench: Bench) -> None:
    bench.homed()

    assert bench.stands_at(0.0, 0.0)


def test_a_bearing_that_it_cannot_reach_is_refused_and_nothing_moves(bench: Bench) -> None:
    pan_tilt = bench.homed()

    for pan_deg, tilt_deg in ((180.1, 0.0), (0.0, 90.1), (-181.0, 0.0), (0.0, -91.0)):
        with pytest.raises(OutOfRange, match="outside"):
            pan_tilt.move_to(bearing(pan_deg, tilt_deg))
        assert not pan_tilt.state.moving


def test_the_limits_themselves_can_be_reached(bench: Bench) -> None:
    pan_tilt = bench.homed()
    limits = pan_tilt.limits

    pan_tilt.move_to(PanTiltPose(pan_rad=limits.pan_min_rad, tilt_rad=limits.tilt_min_rad))
    assert bench.rest().fault is None
    pan_tilt.move_to(PanTiltPose(pan_rad=limits.pan_max_rad, tilt_rad=limits.tilt_max_rad))

    assert bench.rest().fault is None


def test_a_hold_stops_it_on_its_way(bench: Bench) -> None:
    pan_tilt = bench.homed()
    bench.stroll()
    pan_tilt.move_to(bearing(60.0, 0.0))

    pan_tilt.hold()
    state = bench.rest()

    assert state.fault is None
    assert abs(bench.rig.bearing_deg(bench.clock.now_ns())[0]) < 59.0
    pan_tilt.move_to(bearing(1.0, 0.0))  # and it moves again
    assert bench.rest().fault is None


def test_a_hold_from_another_thread_goes_through_while_its_state_is_read(bench: Bench) -> None:
    pan_tilt = bench.homed()
    bench.stroll()
    pan_tilt.move_to(bearing(60.0, 0.0))

    with ThreadPoolExecutor(1) as other:
        held = other.submit(pan_tilt.hold)
        state = bench.rest()
        held.result()

    assert bench.rest().fault is None
    assert state.connected
    assert abs(bench.rig.bearing_deg(bench.clock.now_ns())[0]) <= 60.0


def test_the_last_of_two_moves_counts(bench: Bench) -> None:
    pan_tilt = bench.homed()
    bench.stroll()
    pan_tilt.move_to(bearing(60.0, 20.0))

    pan_tilt.move_to(bearing(-5.0, 1.0))
    state = bench.rest()

    if pan_tilt.moves_itself:
        assert state.pose is not None
        assert math.degrees(state.pose.pan_rad) == pytest.approx(-5.0, abs=0.6 * bench.step_deg)
        assert bench.stands_at(-5.0, 1.0)
