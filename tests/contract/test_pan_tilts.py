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
from foveacam_hardware.drivers.grbl import GrblPanTilt
from foveacam_hardware.drivers.grbl_axes import GrblMounting
from foveacam_hardware.drivers.manual_pan_tilt import ManualPanTilt
from foveacam_hardware.sim.grbl_host import GrblProcess
from foveacam_hardware.sim.grbl_loopback import GrblLoopback
from foveacam_hardware.sim.pan_tilt import TurningHistory

KINDS = ("loopback", "process", "manual")
BRISK = {24: 12_000.0, 25: 18_000.0, 110: 18_000.0, 111: 18_000.0, 120: 4000.0, 121: 4000.0}
"""Settings of a board whose motors are quick, for tests in real time."""
POLL_NS = 10_000_000
PATIENCE_NS = 30_000_000_000
STEP_RAD = math.radians(0.011)


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


@dataclass
class Bench:
    pan_tilt: PanTilt
    clock: Clock
    rig: TurningHistory
    """Where the rig really stands."""

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


def motorised(board: GrblLoopback | GrblProcess, clock: Clock) -> GrblPanTilt:
    board.configure(settings=BRISK)
    low, high = bearing(-70.0, -30.0), bearing(70.0, 30.0)
    limits = PanTiltLimits(
        pan_min_rad=low.pan_rad,
        pan_max_rad=high.pan_rad,
        tilt_min_rad=low.tilt_rad,
        tilt_max_rad=high.tilt_rad,
    )
    mounting = GrblMounting(zero=bearing(72.0, 32.0), speed_rad_s=math.radians(200.0))
    return GrblPanTilt(board.open, clock, limits=limits, mounting=mounting)


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    rig = TurningHistory()
    match request.param:
        case "manual":
            yield Bench(ManualPanTilt(), VirtualClock(1_000_000_000), rig)
        case "loopback":
            clock = VirtualClock(1_000_000_000)
            built = Bench(motorised(GrblLoopback(clock, rig), clock), clock, rig)
            yield built
            built.pan_tilt.close()
        case _:
            with GrblProcess(rig) as process:
                process.open().close()  # it is up
                real = MonotonicClock()
                built = Bench(motorised(process, real), real, rig)
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
    pan_tilt.move_to(bearing(12.3, -7.5))

    assert pan_tilt.state.moving is pan_tilt.moves_itself
    state = bench.rest()

    assert state.fault is None
    if isinstance(pan_tilt, ManualPanTilt):
        assert pan_tilt.wanted == bearing(12.3, -7.5)
        assert state.pose is None
    else:
        assert state.pose is not None
        assert state.pose.pan_rad == pytest.approx(math.radians(12.3), abs=STEP_RAD)
        assert state.pose.tilt_rad == pytest.approx(math.radians(-7.5), abs=STEP_RAD)
        assert bench.rig.bearing_deg(bench.clock.now_ns()) == (12.3, -7.5)


def test_after_homing_the_rig_points_straight_ahead(bench: Bench) -> None:
    bench.homed()

    assert bench.rig.bearing_deg(bench.clock.now_ns()) == (0.0, 0.0)


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
        assert state.pose.pan_rad == pytest.approx(math.radians(-5.0), abs=STEP_RAD)
        assert bench.rig.bearing_deg(bench.clock.now_ns()) == (-5.0, 1.0)
