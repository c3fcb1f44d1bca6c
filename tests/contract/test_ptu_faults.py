"""What a FLIR unit's driver does when unit, line or people do not do what they should; on virtual time."""

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
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.line_faults import Damage, DamageKind
from foveacam_hardware.sim.far_ends.ptu_firmware import SECONDS_A_STEP
from foveacam_hardware.sim.far_ends.ptu_loopback import PtuLoopback
from foveacam_hardware.sim.pan_tilt import TurningHistory

POLL_NS = 20_000_000
STEP_DEG = SECONDS_A_STEP / 3600.0


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


class Bench:
    """A unit in this process and its driver, on virtual time."""

    def __init__(
        self, *, mounting: PtuMounting | None = None, pan_deg: float = 70.0, tilt_deg: float = 30.0
    ) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self.rig = TurningHistory()
        self.unit = PtuLoopback(self.clock, self.rig)
        low, high = bearing(-pan_deg, -tilt_deg), bearing(pan_deg, tilt_deg)
        limits = PanTiltLimits(
            pan_min_rad=low.pan_rad,
            pan_max_rad=high.pan_rad,
            tilt_min_rad=low.tilt_rad,
            tilt_max_rad=high.tilt_rad,
        )
        self.driver = PtuPanTilt(self.unit.open, self.clock, limits=limits, mounting=mounting)

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

    def stands_at(self, pan_deg: float, tilt_deg: float) -> bool:
        at_deg = self.rig.bearing_deg(self.clock.now_ns())
        return max(abs(at_deg[0] - pan_deg), abs(at_deg[1] - tilt_deg)) <= 0.51 * STEP_DEG


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

    assert bench.wait(2.0) == PanTiltState(connected=True, moving=True)
    with pytest.raises(Busy, match="wait"):
        bench.driver.move_to(bearing(1.0, 0.0))
    with pytest.raises(Busy, match="wait"):
        bench.driver.home()

    state = bench.rest()
    assert state.homed
    assert state.pose == bearing(0.0, 0.0)
    assert bench.stands_at(0.0, 0.0)


def test_homing_that_the_unit_breaks_off_says_so_and_can_be_done_again(bench: Bench) -> None:
    bench.unit.configure(seized=True)
    bench.driver.home()
    state = bench.rest()

    assert not state.homed
    assert state.fault is not None
    assert "homing failed" in state.fault

    bench.unit.configure(seized=False)
    bench.driver.home()
    assert bench.rest().homed


def test_a_unit_that_dies_while_homing_is_noticed(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(0.5)
    bench.unit.configure(silent=True)

    state = bench.wait(100.0)

    assert not state.homed
    assert not state.moving
    assert state.fault is not None


def test_a_unit_that_restarts_while_homing_has_failed(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(2.0)
    bench.unit.power_cycle()

    state = bench.rest()

    assert not state.homed
    assert state.fault is not None
    assert "home again" in state.fault


def test_a_limit_stops_everything_until_it_is_homed_again(homed: Bench) -> None:
    homed.driver.move_to(bearing(50.0, 0.0))
    homed.wait(0.5)
    homed.unit.hit_a_limit()

    state = homed.rest()
    assert state.pose is None
    assert state.fault is not None
    assert "pan ran into a limit" in state.fault
    with pytest.raises(DeviceFault, match="home it again"):
        homed.driver.move_to(bearing(0.0, 0.0))

    homed.driver.home()
    assert homed.rest().pose == bearing(0.0, 0.0)
    assert homed.stands_at(0.0, 0.0)


def test_a_unit_that_restarts_has_lost_its_place_and_works_again_when_homed(homed: Bench) -> None:
    homed.driver.move_to(bearing(20.0, 0.0))
    homed.rest()
    homed.unit.power_cycle()

    state = homed.driver.state
    assert state.pose is None
    assert state.fault is not None
    assert "restarted by itself; home it again" in state.fault
    assert homed.wait(1.0).fault == state.fault

    homed.driver.home()
    assert homed.rest().pose == bearing(0.0, 0.0)


def test_an_unplugged_unit_is_noticed_and_comes_back(homed: Bench) -> None:
    homed.unit.unplug()
    state = homed.driver.state
    assert not state.connected
    assert state.fault is not None
    with pytest.raises(NotConnected, match="connect it again"):
        homed.driver.move_to(bearing(1.0, 0.0))

    homed.unit.plug()
    homed.driver.connect()

    assert homed.driver.state == PanTiltState(connected=True)


def test_a_silent_unit_is_given_up_within_two_seconds(homed: Bench) -> None:
    homed.unit.configure(silent=True)
    began_ns = homed.clock.now_ns()

    assert not homed.driver.state.connected

    assert homed.clock.now_ns() - began_ns < 2_000_000_000


def test_a_port_where_no_such_unit_speaks_is_named() -> None:
    bench = Bench()
    bench.unit.configure(silent=True)

    with pytest.raises(NotConnected, match="no FLIR pan-tilt unit answers there"):
        bench.driver.connect()

    assert not bench.driver.state.connected


class Modem:
    """Somebody else at the port."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._asked = False

    def write(self, data: bytes) -> None:
        self._asked = True

    def read(self, timeout_s: float) -> bytes:
        self._clock.sleep_until_ns(self._clock.now_ns() + round(timeout_s * 1e9))
        answer = b"\r\nERROR\r\n" if self._asked else b""
        self._asked = False
        return answer

    def close(self) -> None:
        pass


def test_a_modem_at_the_port_is_quoted() -> None:
    clock = VirtualClock(1_000_000_000)
    driver = PtuPanTilt(lambda: Modem(clock), clock, limits=Bench().driver.limits)

    with pytest.raises(NotConnected, match=r"it said 'ERROR'.*check port"):
        driver.connect()


@pytest.mark.parametrize("skip", range(18))
@pytest.mark.parametrize("kind", [DamageKind.DROP, DamageKind.CORRUPT])
def test_a_byte_of_a_move_lost_on_its_way_never_goes_unnoticed(
    homed: Bench, skip: int, kind: DamageKind
) -> None:
    homed.unit.damage_to_device(Damage(kind=kind, skip=skip, value=0x01))
    try:
        homed.driver.move_to(bearing(-11.0, 7.0))
    except (DeviceFault, NotConnected):
        pass  # it said so at once
    else:
        state = homed.rest()
        assert homed.stands_at(-11.0, 7.0) or state.fault is not None
    homed.rest()

    if not homed.driver.state.connected:
        homed.driver.connect()
        homed.driver.home()
        homed.rest()
    homed.driver.move_to(bearing(-11.0, 7.0))
    assert homed.rest().fault is None
    assert homed.stands_at(-11.0, 7.0)


@pytest.mark.parametrize("skip", range(0, 24, 2))
@pytest.mark.parametrize("kind", [DamageKind.DROP, DamageKind.CORRUPT])
def test_a_byte_of_a_reply_lost_on_its_way_does_not_matter(homed: Bench, skip: int, kind: DamageKind) -> None:
    homed.unit.damage_to_host(Damage(kind=kind, skip=skip, value=0x15))

    homed.driver.move_to(bearing(-11.0, 7.0))

    homed.rest()
    assert homed.stands_at(-11.0, 7.0)


def test_replies_that_come_late_belong_to_their_own_commands(homed: Bench) -> None:
    homed.unit.configure(slow_ns=250_000_000)

    for pan_deg in (5.0, -5.0, 10.0):
        homed.driver.move_to(bearing(pan_deg, 0.0))
        state = homed.rest()
        assert state.fault is None
        assert homed.stands_at(pan_deg, 0.0)


def test_a_reply_that_comes_after_its_deadline_is_not_taken_for_the_next_ones(homed: Bench) -> None:
    homed.driver.move_to(bearing(20.0, -10.0))
    homed.rest()
    homed.unit.configure(slow_ns=500_000_000)
    homed.driver.state  # noqa: B018 - a look that comes too early
    homed.unit.configure(slow_ns=0)
    if not homed.driver.state.connected:
        homed.driver.connect()
        return

    state = homed.wait(2.0)
    assert state.pose is not None
    assert math.degrees(state.pose.pan_rad) == pytest.approx(20.0, abs=STEP_DEG)
    assert math.degrees(state.pose.tilt_rad) == pytest.approx(-10.0, abs=STEP_DEG)


def test_a_move_that_somebody_else_stops_is_reported(homed: Bench) -> None:
    homed.driver.move_to(bearing(60.0, 0.0))
    homed.wait(0.5)
    homed.unit.far_end.firmware.word(homed.clock.now_ns(), "H")

    state = homed.rest()

    assert state.fault is not None
    assert "move it again" in state.fault


def test_a_hold_while_homing_leaves_it_where_the_reset_ends(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(1.0)
    bench.driver.hold()

    state = bench.rest()

    assert state.fault is None
    assert state.homed
    assert bench.stands_at(0.0, 0.0)


def test_after_homing_it_turns_to_where_the_rig_looks_straight_ahead() -> None:
    bench = Bench(mounting=PtuMounting(zero=bearing(10.0, -5.0)), pan_deg=60.0, tilt_deg=25.0)
    bench.driver.connect()
    bench.driver.home()

    state = bench.rest()

    assert state.pose is not None
    assert math.degrees(state.pose.pan_rad) == pytest.approx(0.0, abs=STEP_DEG)
    assert bench.stands_at(-10.0, 5.0)  # the shafts' own count


def test_a_unit_that_hangs_from_the_ceiling_turns_the_other_way() -> None:
    bench = Bench(mounting=PtuMounting(upside_down=True))
    bench.driver.connect()
    bench.driver.home()
    bench.rest()

    bench.driver.move_to(bearing(20.0, 10.0))
    bench.rest()

    assert bench.stands_at(-20.0, -10.0)


@pytest.mark.parametrize(("pan_deg", "tilt_deg", "axis"), [(170.0, 30.0, "pan"), (70.0, 40.0, "tilt")])
def test_limits_that_the_unit_cannot_reach_are_refused(pan_deg: float, tilt_deg: float, axis: str) -> None:
    bench = Bench(pan_deg=pan_deg, tilt_deg=tilt_deg)

    with pytest.raises(DeviceFault, match=rf"lets {axis} turn farther .* narrow the rig file's limits"):
        bench.driver.connect()


def test_a_speed_that_the_unit_cannot_do_is_refused() -> None:
    bench = Bench(mounting=PtuMounting(speed_rad_s=math.radians(190.0)))

    with pytest.raises(DeviceFault, match=r"speed_deg_s = 190 is outside .* change it"):
        bench.driver.connect()
