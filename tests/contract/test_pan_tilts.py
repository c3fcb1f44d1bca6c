"""What every pan-tilt of the contract does, driven by hand or by motors, in this process or behind a port."""

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import pytest

from foveacam_hardware.contract import (
    Clock,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PanTilt,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.manual_pan_tilt import ManualPanTilt
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.grbl_host import GrblProcess
from foveacam_hardware.sim.far_ends.grbl_loopback import GrblLoopback
from foveacam_hardware.sim.far_ends.ptu_firmware import SECONDS_A_STEP
from foveacam_hardware.sim.far_ends.ptu_host import PtuProcess
from foveacam_hardware.sim.far_ends.ptu_loopback import PtuLoopback
from foveacam_hardware.sim.pan_tilt import Turning, TurningHistory

KINDS = ("grbl loopback", "grbl process", "ptu loopback", "ptu process", "manual")
BRISK = {24: 12_000.0, 25: 18_000.0, 110: 18_000.0, 111: 18_000.0, 120: 4000.0, 121: 4000.0}
"""Settings of a board whose motors are quick, for tests in real time."""
POLL_NS = 10_000_000
PATIENCE_NS = 30_000_000_000
SPEED_RAD_S = math.radians(200.0)
BRISK_STEPS_S = 400_000
GRBL_STEP_DEG = 0.01
PTU_STEP_DEG = SECONDS_A_STEP / 3600.0
LIMITS = PanTiltLimits(
    pan_min_rad=math.radians(-70.0),
    pan_max_rad=math.radians(70.0),
    tilt_min_rad=math.radians(-30.0),
    tilt_max_rad=math.radians(30.0),
)


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


@dataclass
class Bench:
    pan_tilt: PanTilt
    clock: Clock
    rig: TurningHistory
    """Where the rig really stands."""
    step_deg: float = 0.0
    """Of its motors: as near as it can come to a bearing, and half of that is rounding."""

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


def on_grbl(board: GrblLoopback | GrblProcess, clock: Clock) -> GrblPanTilt:
    board.configure(settings=BRISK)
    mounting = GrblMounting(zero=bearing(72.0, 32.0), speed_rad_s=SPEED_RAD_S)
    return GrblPanTilt(board.open, clock, limits=LIMITS, mounting=mounting)


def on_ptu(unit: PtuLoopback | PtuProcess, clock: Clock) -> PtuPanTilt:
    unit.configure(steps_per_s=BRISK_STEPS_S)
    return PtuPanTilt(unit.open, clock, limits=LIMITS, mounting=PtuMounting(speed_rad_s=SPEED_RAD_S))


class Shafts:
    """Shafts between motors that a module's tests share and the rig of the test that runs."""

    def __init__(self) -> None:
        self.rig = TurningHistory()

    def turn(self, turning: Turning) -> None:
        self.rig.turn(turning)


@pytest.fixture(scope="module")
def grbl() -> Iterator[tuple[GrblProcess, Shafts]]:
    shafts = Shafts()
    with GrblProcess(shafts) as process:
        process.open().close()  # it is up
        yield process, shafts


@pytest.fixture(scope="module")
def ptu() -> Iterator[tuple[PtuProcess, Shafts]]:
    shafts = Shafts()
    with PtuProcess(shafts) as process:
        process.open().close()
        yield process, shafts


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    rig = TurningHistory()
    virtual, real = VirtualClock(1_000_000_000), MonotonicClock()
    match request.param:
        case "manual":
            yield Bench(ManualPanTilt(), virtual, rig)
        case "grbl loopback":
            yield from used(Bench(on_grbl(GrblLoopback(virtual, rig), virtual), virtual, rig, GRBL_STEP_DEG))
        case "ptu loopback":
            yield from used(Bench(on_ptu(PtuLoopback(virtual, rig), virtual), virtual, rig, PTU_STEP_DEG))
        case "grbl process":
            board, shafts = request.getfixturevalue("grbl")
            shafts.rig = rig
            board.power_cycle()
            yield from used(Bench(on_grbl(board, real), real, rig, GRBL_STEP_DEG))
        case "ptu process":
            unit, shafts = request.getfixturevalue("ptu")
            shafts.rig = rig
            unit.power_cycle()
            yield from used(Bench(on_ptu(unit, real), real, rig, PTU_STEP_DEG))


def used(bench: Bench) -> Iterator[Bench]:
    yield bench
    bench.pan_tilt.close()


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


@pytest.mark.parametrize(("pan_deg", "tilt_deg"), [(180.1, 0.0), (0.0, 90.1), (-181.0, 0.0), (0.0, -91.0)])
def test_a_bearing_that_it_cannot_reach_is_refused_and_nothing_moves(
    bench: Bench, pan_deg: float, tilt_deg: float
) -> None:
    pan_tilt = bench.homed()

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
    pan_tilt.move_to(bearing(60.0, 0.0))

    pan_tilt.hold()
    state = bench.rest()

    assert state.fault is None
    assert abs(bench.rig.bearing_deg(bench.clock.now_ns())[0]) < 59.0
    pan_tilt.move_to(bearing(1.0, 0.0))  # and it moves again
    assert bench.rest().fault is None


def test_a_hold_from_another_thread_goes_through_while_its_state_is_read(bench: Bench) -> None:
    pan_tilt = bench.homed()
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
    pan_tilt.move_to(bearing(60.0, 20.0))

    pan_tilt.move_to(bearing(-5.0, 1.0))
    state = bench.rest()

    if pan_tilt.moves_itself:
        assert state.pose is not None
        assert math.degrees(state.pose.pan_rad) == pytest.approx(-5.0, abs=0.6 * bench.step_deg)
        assert bench.stands_at(-5.0, 1.0)
