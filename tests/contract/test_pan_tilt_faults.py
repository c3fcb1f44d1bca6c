"""What the Grbl driver does when board, line or people do not do what they should; on virtual time."""

import math
from collections.abc import Iterator

import pytest

from foveacam_hardware.contract import (
    Busy,
    DeviceFault,
    NotConnected,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.sim.far_ends.grbl_loopback import GrblLoopback
from foveacam_hardware.sim.far_ends.line_faults import Damage, DamageKind
from foveacam_hardware.sim.pan_tilt import TurningHistory

POLL_NS = 20_000_000


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


class Bench:
    """A board in this process and its driver, on virtual time."""

    def __init__(self, *, zero_deg: tuple[float, float] = (72.0, 32.0), has_switches: bool = True) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self.rig = TurningHistory()
        self.board = GrblLoopback(self.clock, self.rig)
        low, high = bearing(-70.0, -30.0), bearing(70.0, 30.0)
        self.driver = GrblPanTilt(
            self.board.open,
            self.clock,
            limits=PanTiltLimits(
                pan_min_rad=low.pan_rad,
                pan_max_rad=high.pan_rad,
                tilt_min_rad=low.tilt_rad,
                tilt_max_rad=high.tilt_rad,
            ),
            mounting=GrblMounting(zero=bearing(*zero_deg), has_switches=has_switches),
        )

    def wait(self, wait_s: float) -> PanTiltState:
        """Look on for a while, as a procedure does."""
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        while self.clock.now_ns() < end_ns:
            self.clock.sleep_until_ns(min(end_ns, self.clock.now_ns() + POLL_NS))
            state = self.driver.state
        return state

    def rest(self) -> PanTiltState:
        for _ in range(10_000):
            if not (state := self.driver.state).moving:
                return state
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        raise AssertionError("it never came to rest")

    @property
    def place_deg(self) -> tuple[float, float]:
        return self.rig.bearing_deg(self.clock.now_ns())


@pytest.fixture
def bench() -> Iterator[Bench]:
    built = Bench()
    built.driver.connect()
    yield built
    built.driver.close()


@pytest.fixture
def homed(bench: Bench) -> Bench:
    bench.driver.home()
    bench.rest()
    return bench


def test_before_it_is_homed_it_knows_no_place_and_will_not_move(bench: Bench) -> None:
    assert bench.driver.state == PanTiltState(connected=True)

    with pytest.raises(DeviceFault, match=r"does not know where it stands; home it"):
        bench.driver.move_to(bearing(1.0, 0.0))


def test_homing_is_moving_until_the_rig_points_straight_ahead(bench: Bench) -> None:
    bench.driver.home()

    state = bench.wait(1.0)
    assert state == PanTiltState(connected=True, moving=True)
    with pytest.raises(Busy, match="wait"):
        bench.driver.move_to(bearing(1.0, 0.0))
    with pytest.raises(Busy, match="wait"):
        bench.driver.home()

    assert bench.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    assert bench.clock.now_ns() < 12_000_000_000


def test_homing_that_finds_no_switch_says_so_and_can_be_done_again(bench: Bench) -> None:
    bench.board.configure(has_switches=False)
    bench.driver.home()

    state = bench.rest()
    assert not state.homed
    assert state.fault is not None
    assert "a reference switch was not found" in state.fault

    bench.board.configure(has_switches=True)
    bench.driver.home()
    assert bench.rest().homed


def test_a_hold_breaks_homing_off_without_a_fault(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(1.0)

    bench.driver.hold()

    assert bench.rest() == PanTiltState(connected=True)
    stopped_deg = bench.place_deg
    bench.wait(5.0)
    assert bench.place_deg == stopped_deg


def test_a_board_that_dies_while_homing_is_noticed(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(0.5)
    bench.board.configure(silent=True)

    state = bench.wait(100.0)

    assert not state.connected
    assert state.fault is not None
    assert "connect it again" in state.fault


def test_a_limit_switch_stops_everything_until_it_is_homed_again(homed: Bench) -> None:
    homed.driver.move_to(bearing(50.0, 0.0))
    homed.wait(0.5)
    homed.board.hit_a_limit()
    homed.board.advance(homed.clock.now_ns())

    state = homed.rest()
    assert state.pose is None
    assert state.fault is not None
    assert "limit switch was hit" in state.fault
    with pytest.raises(DeviceFault, match="home it again"):
        homed.driver.move_to(bearing(0.0, 0.0))

    homed.driver.home()
    assert homed.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))


def test_a_board_that_restarts_has_lost_its_place(homed: Bench) -> None:
    homed.driver.move_to(bearing(20.0, 0.0))
    homed.rest()
    homed.board.power_cycle()

    state = homed.driver.state

    assert not state.homed
    assert state.pose is None
    assert state.fault is not None
    assert "restarted by itself; home it again" in state.fault
    assert homed.wait(1.0).fault == state.fault


def test_an_unplugged_board_is_noticed_and_comes_back(homed: Bench) -> None:
    homed.board.unplug()
    state = homed.driver.state
    assert not state.connected
    assert state.fault is not None
    with pytest.raises(NotConnected, match="connect it again"):
        homed.driver.move_to(bearing(1.0, 0.0))

    homed.board.plug()
    homed.driver.connect()

    assert homed.driver.state == PanTiltState(connected=True)


def test_a_silent_board_is_given_up_within_a_second(homed: Bench) -> None:
    homed.board.configure(silent=True)
    began_ns = homed.clock.now_ns()

    assert not homed.driver.state.connected

    assert homed.clock.now_ns() - began_ns < 1_000_000_000


def test_a_port_where_nobody_speaks_grbl_is_named() -> None:
    bench = Bench()
    bench.board.configure(silent=True)

    with pytest.raises(NotConnected, match="nothing that speaks Grbl answers there"):
        bench.driver.connect()

    assert not bench.driver.state.connected


@pytest.mark.parametrize("skip", range(36))
def test_a_byte_of_a_move_lost_on_its_way_never_goes_unnoticed(homed: Bench, skip: int) -> None:
    homed.board.damage_to_device(Damage(kind=DamageKind.DROP, skip=skip))
    homed.driver.move_to(bearing(-11.0, 7.0))
    state = homed.rest()

    if homed.place_deg != pytest.approx((-11.0, 7.0), abs=0.051):
        assert state.fault is not None
        assert "move it again" in state.fault
    homed.driver.move_to(bearing(-11.0, 7.0))
    assert homed.rest().fault is None
    assert homed.place_deg == pytest.approx((-11.0, 7.0), abs=1e-9)


@pytest.mark.parametrize("skip", range(0, 60, 3))
def test_a_byte_of_an_answer_lost_on_its_way_does_not_matter(homed: Bench, skip: int) -> None:
    homed.board.damage_to_host(Damage(kind=DamageKind.CORRUPT, skip=skip, value=0x15))

    homed.driver.move_to(bearing(-11.0, 7.0))

    assert homed.rest().fault is None
    assert homed.place_deg == (-11.0, 7.0)


def test_answers_that_come_late_belong_to_their_own_questions(homed: Bench) -> None:
    homed.board.configure(slow_ns=250_000_000)

    for pan_deg in (5.0, -5.0, 10.0):
        homed.driver.move_to(bearing(pan_deg, 0.0))
        state = homed.rest()
        assert state.fault is None
        assert homed.place_deg == (pan_deg, 0.0)


def test_a_jog_that_another_program_stops_is_reported(homed: Bench) -> None:
    homed.driver.move_to(bearing(60.0, 0.0))
    homed.wait(0.5)
    homed.board.far_end.feed(b"\x85")

    state = homed.rest()

    assert state.homed
    assert state.fault is not None
    assert "stopped on its way" in state.fault
    homed.driver.move_to(bearing(0.0, 0.0))
    assert homed.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))


def test_a_bearing_that_the_board_refuses_is_a_fault_in_words() -> None:
    bench = Bench(zero_deg=(60.0, 32.0))  # the switch is said to be nearer than the limit
    bench.driver.connect()
    bench.driver.home()
    bench.rest()

    with pytest.raises(DeviceFault, match="beyond its travel"):
        bench.driver.move_to(bearing(65.0, 0.0))

    assert not bench.driver.state.moving


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({13: 1.0}, r"inches; set \$13=0"),
        ({22: 0.0}, r"homing is switched off"),
        ({130: 100.0}, r"pan turn by 140 deg, the board allows 100"),
        ({131: 59.0}, r"tilt turn by 60 deg, the board allows 59"),
    ],
)
def test_a_board_set_up_wrongly_is_refused_at_once(settings: dict[int, float], words: str) -> None:
    bench = Bench()
    bench.board.configure(settings=settings)

    with pytest.raises(DeviceFault, match=words):
        bench.driver.connect()

    state = bench.driver.state
    assert not state.connected
    assert state.fault is not None


def test_a_board_that_reports_work_positions_is_understood(homed: Bench) -> None:
    homed.board.configure(settings={10: 0.0})

    homed.driver.move_to(bearing(4.0, 2.0))

    assert homed.rest().fault is None
    assert homed.place_deg == (4.0, 2.0)


def test_without_switches_it_counts_from_where_it_stood() -> None:
    bench = Bench(zero_deg=(0.0, 0.0), has_switches=False)
    bench.board.configure(settings={20: 0.0, 22: 0.0})
    bench.board.power_cycle()
    bench.driver.connect()

    assert bench.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    with pytest.raises(DeviceFault, match="no reference switches"):
        bench.driver.home()
    bench.driver.move_to(bearing(9.0, -3.0))
    assert bench.rest().fault is None
    assert bench.place_deg == (9.0, -3.0)


def test_a_move_left_over_by_another_program_is_stopped_by_connecting(homed: Bench) -> None:
    homed.driver.move_to(bearing(60.0, 0.0))
    homed.wait(0.3)
    driver = GrblPanTilt(homed.board.open, homed.clock, limits=homed.driver.limits)

    driver.connect()

    assert driver.state == PanTiltState(connected=True)
    assert homed.place_deg[0] < 30.0


def test_the_same_session_runs_the_same_way_every_time() -> None:
    def session() -> tuple[int, tuple[float, float]]:
        bench = Bench()
        bench.driver.connect()
        bench.driver.home()
        bench.rest()
        bench.driver.move_to(bearing(33.0, -11.0))
        bench.wait(0.4)
        bench.driver.hold()
        bench.rest()
        return bench.clock.now_ns(), bench.place_deg

    assert session() == session()
