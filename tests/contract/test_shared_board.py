"""A pan-tilt and a rail on one Grbl board: X, Y and Z of one machine; on virtual time."""

import math

import pytest

from foveacam_hardware.contract import (
    DeviceFault,
    NotConnected,
    PanTiltLimits,
    PanTiltPose,
    RailLimits,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.pan_tilt import TurningHistory

POLL_NS = 20_000_000
TURN = PanTiltLimits(pan_min_rad=-1.2, pan_max_rad=1.2, tilt_min_rad=-0.5, tilt_max_rad=0.5)
SLIDE = RailLimits(min_m=-0.3, max_m=0.3)


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


class Bench:
    """One board, both devices on it."""

    def __init__(self, *, has_rail: bool = True) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self.rig = TurningHistory()
        self.board = BoardLoopback(GrblFarEnd(self.clock, self.rig, has_rail=has_rail), self.clock)
        mounting = GrblMounting(zero=bearing(72.0, 32.0))
        rail_mounting = GrblRailMounting(zero_m=0.31, speed_m_s=0.1)
        axes = [*mounting.axes(TURN), rail_mounting.axis(SLIDE)]
        shared = GrblBoard(self.board.open, self.clock, axes=axes, name="base")
        self.pan_tilt = GrblPanTilt(self.board.open, self.clock, limits=TURN, mounting=mounting, board=shared)
        self.rail = GrblRail(self.board.open, self.clock, limits=SLIDE, mounting=rail_mounting, board=shared)

    def homed(self) -> "Bench":
        self.pan_tilt.connect()
        self.rail.connect()
        self.pan_tilt.home()
        self.rest()
        return self

    def rest(self) -> None:
        for _ in range(10_000):
            if not (self.pan_tilt.state.moving or self.rail.state.moving):
                return
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        raise AssertionError("it never came to rest")

    def wait(self, wait_s: float) -> None:
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        while self.clock.now_ns() < end_ns:
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
            _ = self.pan_tilt.state, self.rail.state

    @property
    def stands_at(self) -> tuple[float, float, float]:
        t_ns = self.clock.now_ns()
        return (*self.rig.bearing_deg(t_ns), self.rig.slide_mm(t_ns)[0])


def test_homing_one_homes_both_and_leaves_them_at_zero() -> None:
    bench = Bench().homed()

    assert bench.pan_tilt.state.homed
    assert bench.rail.state.homed
    assert bench.stands_at == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_a_move_of_one_leaves_the_other_where_it_stands() -> None:
    bench = Bench().homed()

    bench.rail.move_to(-0.3)
    bench.rest()
    bench.pan_tilt.move_to(bearing(10.0, -5.0))
    bench.rest()

    assert bench.stands_at == pytest.approx((10.0, -5.0, -300.0), abs=0.01)
    assert bench.rail.state.position_m == pytest.approx(-0.3, abs=1e-5)


def test_a_move_of_one_while_the_other_is_on_its_way_brings_both_to_their_goals() -> None:
    bench = Bench().homed()

    bench.rail.move_to(0.1)
    bench.wait(0.3)
    bench.pan_tilt.move_to(bearing(-20.0, 3.0))
    bench.rest()

    assert bench.stands_at == pytest.approx((-20.0, 3.0, 100.0), abs=0.01)
    assert bench.pan_tilt.state.fault is None
    assert bench.rail.state.fault is None


def test_on_a_way_of_all_axes_each_goes_as_fast_as_it_may() -> None:
    bench = Bench().homed()
    began_ns = bench.clock.now_ns()

    bench.rail.move_to(0.3)
    bench.pan_tilt.move_to(bearing(20.0, 0.0))
    bench.rest()

    assert (bench.clock.now_ns() - began_ns) / 1e9 < 4.0  # 300 mm at 100 mm/s, and a start that is given up


def test_a_hold_of_one_stops_both_without_a_fault() -> None:
    bench = Bench().homed()
    bench.rail.move_to(0.3)
    bench.wait(0.2)
    bench.pan_tilt.move_to(bearing(60.0, 0.0))
    bench.wait(0.5)

    bench.rail.hold()
    bench.rest()

    pan_deg, _, slide_mm = bench.stands_at
    assert pan_deg < 59.0
    assert slide_mm < 299.0
    assert bench.pan_tilt.state.fault is None


def test_closing_one_leaves_the_other_connected() -> None:
    bench = Bench().homed()

    bench.pan_tilt.close()

    assert not bench.pan_tilt.state.connected
    with pytest.raises(NotConnected, match="connect it"):
        bench.pan_tilt.hold()
    bench.rail.move_to(0.1)
    bench.rest()
    assert bench.rail.state.position_m == pytest.approx(0.1, abs=1e-5)
    bench.rail.close()
    assert not bench.rail.state.connected


def test_a_rail_that_is_not_connected_does_not_move_though_its_board_is() -> None:
    bench = Bench()
    bench.pan_tilt.connect()

    with pytest.raises(NotConnected, match="connect it"):
        bench.rail.move_to(0.1)
    assert not bench.rail.state.connected


def test_an_alarm_is_both_devices_fault() -> None:
    bench = Bench().homed()
    bench.rail.move_to(0.3)
    bench.wait(0.5)
    bench.board.hit_a_limit()
    bench.rest()

    for state in (bench.pan_tilt.state, bench.rail.state):
        assert not state.homed
        assert state.fault is not None
        assert "limit switch was hit" in state.fault


def test_a_board_whose_rail_is_shorter_than_the_limits_is_refused() -> None:
    bench = Bench()
    bench.board.set_faults(settings={132: 500.0})

    with pytest.raises(DeviceFault, match=r"lets the rail move by 600 mm, the board allows 500.*\$132"):
        bench.rail.connect()
