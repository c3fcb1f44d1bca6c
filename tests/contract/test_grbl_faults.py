"""What only a Grbl board does when it, its settings or people do not do what they should; on virtual time."""

import pytest
from tests.support.devices.pan_tilt_boards import Bench, bearing, grbl_bench

from foveacam_hardware.contract import DeviceFault, InvalidInput, PanTiltState
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt


@pytest.fixture
def homed() -> Bench:
    return grbl_bench().homed()


def test_a_hold_breaks_homing_off_without_a_fault() -> None:
    bench = grbl_bench()
    bench.driver.connect()
    bench.driver.home()
    bench.wait(1.0)

    bench.driver.hold()

    assert bench.rest() == PanTiltState(connected=True)
    stopped_deg = bench.place_deg
    bench.wait(5.0)
    assert bench.place_deg == stopped_deg
    assert bench.driver.state == PanTiltState(connected=True)  # its alarm and its new start were asked for
    bench.driver.home()
    assert bench.rest().homed


@pytest.mark.parametrize("slow_ms", [0, 290, 310, 700])
def test_a_board_that_answers_late_is_homed_too(slow_ms: int) -> None:
    bench = grbl_bench()
    bench.driver.connect()
    bench.board.set_faults(slow_ns=slow_ms * 1_000_000)  # 310: a report is asked for twice

    bench.driver.home()

    state = bench.rest()
    assert state.fault is None
    assert state.homed
    assert bench.stands_at(0.0, 0.0)


def test_a_hold_at_the_very_end_of_homing_is_no_fault_either() -> None:
    bench = grbl_bench()
    bench.driver.connect()
    bench.driver.home()
    end_ns = bench.clock.now_ns() + 30_000_000_000
    bench.clock.sleep_until_ns(end_ns)  # found, and nobody has looked yet

    bench.driver.hold()

    assert bench.rest() == PanTiltState(connected=True)
    assert bench.wait(2.0) == PanTiltState(connected=True)


def test_a_bearing_that_the_board_refuses_is_a_fault_in_words() -> None:
    bench = grbl_bench(zero_deg=(60.0, 32.0)).homed()  # the switch is said to be nearer than the limit

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
    bench = grbl_bench()
    bench.board.set_faults(settings=settings)

    with pytest.raises(DeviceFault, match=words):
        bench.driver.connect()

    state = bench.driver.state
    assert not state.connected
    assert state.fault is not None


def test_a_board_that_says_it_moves_and_stands_still_is_stopped_and_reported(homed: Bench) -> None:
    homed.board.set_faults(seized=True)
    homed.driver.move_to(bearing(20.0, 0.0))
    assert homed.wait(1.9).fault is None

    state = homed.wait(0.5)

    assert not state.moving
    assert "has stood still for 2 s" in (state.fault or "")
    homed.board.set_faults(seized=False)
    homed.driver.move_to(bearing(20.0, 0.0))
    assert homed.rest().fault is None
    assert homed.stands_at(20.0, 0.0)


def test_a_board_that_an_alarm_has_silenced_lets_nobody_wait_for_it(homed: Bench) -> None:
    homed.board.hit_a_limit()
    fault = homed.driver.state.fault
    began_ns = homed.clock.now_ns()

    states = {homed.driver.state for _ in range(10)}

    assert {state.fault for state in states} == {fault}
    assert "limit switch" in (fault or "")
    assert homed.clock.now_ns() - began_ns < 10_000_000
    homed.board.unplug()
    assert not homed.driver.state.connected


def test_a_board_that_reports_work_positions_is_understood(homed: Bench) -> None:
    homed.board.set_faults(settings={10: 0.0})

    homed.driver.move_to(bearing(4.0, 2.0))

    assert homed.rest().fault is None
    assert homed.place_deg == (4.0, 2.0)


def test_without_switches_it_counts_from_where_its_zero_is_confirmed() -> None:
    bench = grbl_bench(zero_deg=(0.0, 0.0), has_switches=False)
    bench.board.set_faults(settings={20: 0.0, 22: 0.0})
    bench.board.power_cycle()
    bench.driver.connect()

    assert bench.driver.state == PanTiltState(connected=True, awaits_zero=True)  # nobody saw it start
    with pytest.raises(DeviceFault, match="bring it to its zero, then confirm"):
        bench.driver.move_to(bearing(9.0, -3.0))
    bench.driver.confirm_zero()

    assert bench.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    with pytest.raises(DeviceFault, match="no reference switches"):
        bench.driver.home()
    bench.driver.move_to(bearing(9.0, -3.0))
    assert bench.rest().fault is None
    assert bench.place_deg == (9.0, -3.0)


def counting() -> Bench:
    """A board without switches that was connected at its zero and has moved."""
    bench = grbl_bench(zero_deg=(0.0, 0.0), has_switches=False)
    bench.board.set_faults(settings={20: 0.0, 22: 0.0})
    bench.board.power_cycle()
    bench.driver.connect()
    bench.driver.confirm_zero()
    bench.driver.move_to(bearing(9.0, -3.0))
    bench.rest()
    return bench


def test_a_board_without_switches_that_restarts_works_again_once_its_zero_is_confirmed() -> None:
    bench = counting()
    bench.board.power_cycle()
    state = bench.wait(1.0)

    assert state.awaits_zero and state.connected and not state.homed
    assert "restarted by itself; bring it to its zero, then confirm" in (state.fault or "")
    bench.driver.connect()
    assert bench.driver.state.fault == state.fault  # connecting anew says nothing of where it stands
    bench.driver.confirm_zero()

    assert bench.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    bench.driver.move_to(bearing(5.0, 1.0))
    assert bench.rest().fault is None
    assert bench.place_deg == (14.0, -2.0)  # from where it was said to stand at its zero


def test_a_zero_that_the_board_does_not_count_from_is_not_taken() -> None:
    bench = counting()
    bench.driver.move_to(bearing(60.0, 0.0))
    bench.wait(0.5)
    bench.board.open().write(b"\x18")  # another program resets it on its way
    state = bench.wait(1.0)

    assert state.awaits_zero
    assert "lost its position; bring it to its zero, switch the board off and on" in (state.fault or "")
    with pytest.raises(DeviceFault, match=r"state Alarm and counts X .*off and on, then confirm again"):
        bench.driver.confirm_zero()
    bench.board.power_cycle()
    assert bench.wait(1.0).fault == state.fault
    bench.driver.confirm_zero()
    assert bench.driver.state.homed


def test_a_board_with_switches_takes_nobodys_word_for_its_zero(homed: Bench) -> None:
    with pytest.raises(InvalidInput, match="reference switches; home it"):
        homed.driver.confirm_zero()
    assert not homed.driver.state.awaits_zero


def test_a_move_left_over_by_another_program_is_stopped_by_connecting(homed: Bench) -> None:
    homed.driver.move_to(bearing(60.0, 0.0))
    homed.wait(0.3)
    driver = GrblPanTilt(homed.board.open, homed.clock, limits=homed.driver.limits)

    driver.connect()

    assert driver.state == PanTiltState(connected=True)
    assert homed.place_deg[0] < 30.0
