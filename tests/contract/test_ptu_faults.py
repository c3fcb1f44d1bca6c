"""What only a FLIR unit does when it, its mounting or people do not do what they should; on virtual time."""

import math

import pytest
from tests.support.devices.pan_tilt_boards import PTU_STEP_DEG, Bench, bearing, ptu_bench, reach

from foveacam_hardware.contract import DeviceFault, NotConnected, VirtualClock
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuAxes, PtuMounting


@pytest.fixture
def homed() -> Bench:
    return ptu_bench().homed()


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


def test_each_axis_counts_in_steps_of_its_own() -> None:
    axes = PtuAxes(
        mounting=PtuMounting(zero=bearing(1.0, -2.0)),
        pan_step_rad=math.radians(0.05),
        tilt_step_rad=math.radians(0.02),
    )

    assert axes.steps(bearing(11.0, 3.0)) == (-200, -250)  # it counts to the left and up
    found = axes.bearing((-200, -250))
    assert (found.pan_rad, found.tilt_rad) == pytest.approx((math.radians(11.0), math.radians(3.0)))


def test_a_modem_at_the_port_is_quoted() -> None:
    clock = VirtualClock(1_000_000_000)
    driver = PtuPanTilt(lambda: Modem(clock), clock, limits=reach())

    with pytest.raises(NotConnected, match=r"it sent 'ERROR'.*check port"):
        driver.connect()


def test_a_reply_that_comes_after_its_deadline_is_not_taken_for_the_next_ones(homed: Bench) -> None:
    homed.driver.move_to(bearing(20.0, -10.0))
    homed.rest()
    homed.board.set_faults(slow_ns=500_000_000)
    assert not homed.driver.state.connected
    homed.board.set_faults(slow_ns=0)

    homed.homed()
    homed.driver.move_to(bearing(20.0, -10.0))
    state = homed.rest()
    assert state.pose is not None
    assert math.degrees(state.pose.pan_rad) == pytest.approx(20.0, abs=PTU_STEP_DEG)
    assert math.degrees(state.pose.tilt_rad) == pytest.approx(-10.0, abs=PTU_STEP_DEG)


def test_a_hold_while_homing_leaves_it_where_the_reset_ends() -> None:
    bench = ptu_bench()
    bench.driver.connect()
    bench.driver.home()
    bench.wait(1.0)
    bench.driver.hold()

    state = bench.rest()

    assert state.fault is None
    assert state.homed
    assert bench.stands_at(0.0, 0.0)


def test_after_homing_it_turns_to_where_the_rig_looks_straight_ahead() -> None:
    bench = ptu_bench(mounting=PtuMounting(zero=bearing(10.0, -5.0)), limits=reach(60.0, 25.0)).homed()

    state = bench.rest()

    assert state.pose is not None
    assert math.degrees(state.pose.pan_rad) == pytest.approx(0.0, abs=PTU_STEP_DEG)
    assert bench.stands_at(-10.0, 5.0)  # the shafts' own count


def test_a_unit_that_hangs_from_the_ceiling_turns_the_other_way() -> None:
    bench = ptu_bench(mounting=PtuMounting(upside_down=True)).homed()

    bench.driver.move_to(bearing(20.0, 10.0))
    bench.rest()

    assert bench.stands_at(-20.0, -10.0)


@pytest.mark.parametrize(("pan_deg", "tilt_deg", "axis"), [(170.0, 30.0, "pan"), (70.0, 40.0, "tilt")])
def test_limits_that_the_unit_cannot_reach_are_refused(pan_deg: float, tilt_deg: float, axis: str) -> None:
    bench = ptu_bench(limits=reach(pan_deg, tilt_deg))

    with pytest.raises(DeviceFault, match=rf"lets {axis} turn farther .* narrow the rig file's limits"):
        bench.driver.connect()


def test_a_speed_that_the_unit_cannot_do_is_refused() -> None:
    bench = ptu_bench(mounting=PtuMounting(speed_rad_s=math.radians(190.0)))

    with pytest.raises(DeviceFault, match=r"speed_deg_s = 190 is outside .* change it"):
        bench.driver.connect()
