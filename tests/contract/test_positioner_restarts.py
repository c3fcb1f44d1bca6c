"""What is known of a positioner's place after silence, restarts and alarms; on virtual time.

Any sequence of them is tried in `test_positioner_sequences`.
"""

import pytest
from tests.support.devices.pan_tilt_boards import Bench, bearing, grbl_bench, ptu_bench

from foveacam_hardware.contract import Busy, DeviceFault, PanTiltState, RailLimits, VirtualClock
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.sim.far_ends.board_far_end import BoardFarEnd
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage
from foveacam_hardware.sim.pan_tilt import TurningHistory

WITHOUT_SWITCHES = {20: 0.0, 22: 0.0}


@pytest.fixture
def counting() -> Bench:
    """A board without switches whose zero was confirmed, and which has moved."""
    bench = grbl_bench(zero_deg=(0.0, 0.0), has_switches=False)
    bench.board.set_faults(settings=WITHOUT_SWITCHES)
    bench.board.power_cycle()
    bench.driver.connect()
    bench.driver.confirm_zero()
    bench.driver.move_to(bearing(30.0, -3.0))
    bench.rest()
    return bench


def silent(bench: Bench, silent_s: float, *, restarts: bool, watched: bool = True) -> None:
    """Let the board be silent, with or without a loss of power meanwhile, and then answer again."""
    bench.board.set_faults(silent=True)
    if restarts:
        bench.board.power_cycle()
    if watched:
        bench.wait(silent_s)
    else:
        bench.clock.sleep_until_ns(bench.clock.now_ns() + round(silent_s * 1e9))
    bench.board.set_faults(silent=False)


def test_a_board_that_restarted_in_silence_awaits_its_zero_when_it_is_connected_again(
    counting: Bench,
) -> None:
    silent(counting, 1.5, restarts=True)
    assert not counting.driver.state.connected

    counting.driver.connect()

    assert counting.driver.state == PanTiltState(connected=True, awaits_zero=True)
    with pytest.raises(DeviceFault, match="confirm that it stands there"):
        counting.driver.move_to(bearing(30.0, 0.0))
    assert counting.place_deg == (30.0, -3.0)


def test_a_board_that_lost_its_power_on_its_way_awaits_its_zero(counting: Bench) -> None:
    counting.driver.move_to(bearing(-60.0, 0.0))
    counting.wait(1.0)
    silent(counting, 1.5, restarts=True)

    counting.driver.connect()

    assert counting.driver.state == PanTiltState(connected=True, awaits_zero=True)


def test_an_unplugged_board_without_switches_awaits_its_zero(counting: Bench) -> None:
    counting.board.unplug()
    assert not counting.driver.state.connected
    counting.board.plug()

    counting.driver.connect()

    assert counting.driver.state == PanTiltState(connected=True, awaits_zero=True)


def test_a_board_that_was_silent_and_never_restarted_proves_it(counting: Bench) -> None:
    silent(counting, 1.5, restarts=False)
    assert not counting.driver.state.connected

    counting.driver.connect()

    assert counting.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(30.0, -3.0))
    counting.driver.move_to(bearing(5.0, 1.0))
    assert counting.rest().fault is None
    assert counting.place_deg == (5.0, 1.0)


@pytest.mark.parametrize("silent_s", [0.02, 0.3, 0.5])
def test_a_restart_is_noticed_though_its_greeting_was_missed(counting: Bench, silent_s: float) -> None:
    counting.driver.move_to(bearing(-60.0, 0.0))
    counting.wait(1.0)
    silent(counting, silent_s, restarts=True, watched=False)

    state = counting.wait(0.1)

    assert state.awaits_zero and not state.homed
    assert "restarted by itself; bring it to its zero, then confirm" in (state.fault or "")


def test_a_short_silence_without_a_restart_costs_nothing(counting: Bench) -> None:
    silent(counting, 0.5, restarts=False, watched=False)

    assert counting.wait(0.5) == PanTiltState(connected=True, homed=True, pose=bearing(30.0, -3.0))


def test_a_board_that_was_closed_awaits_its_zero(counting: Bench) -> None:
    counting.driver.close()

    counting.driver.connect()

    assert counting.driver.state == PanTiltState(connected=True, awaits_zero=True)


@pytest.mark.parametrize("skip", range(1, 9))
@pytest.mark.parametrize("damage", [DamageKind.DROP, DamageKind.CORRUPT])
def test_a_damaged_byte_of_the_proof_does_not_matter(counting: Bench, damage: DamageKind, skip: int) -> None:
    counting.clock.sleep_until_ns(counting.clock.now_ns() + 5_000_000_000)  # it may have restarted

    counting.board.damage_to_device(LineDamage(kind=damage, skip=skip % 4, value=0x01))
    counting.board.damage_to_host(LineDamage(kind=damage, skip=30 + 10 * skip, value=0x01))

    counting.wait(1.0)
    assert counting.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(30.0, -3.0))


def test_a_board_locked_at_its_start_is_unlocked_where_its_zero_is_confirmed() -> None:
    bench = grbl_bench(zero_deg=(0.0, 0.0), has_switches=False)  # with $22=1, as delivered
    bench.driver.connect()

    bench.driver.confirm_zero()

    assert bench.driver.state == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))


def test_homing_after_a_hold_in_an_alarm_ends_homed_at_rest_straight_ahead() -> None:
    for bench in (grbl_bench().homed(), ptu_bench().homed()):
        bench.board.hit_a_limit()
        bench.wait(1.0)
        bench.driver.hold()
        bench.wait(1.0)

        bench.driver.home()

        assert bench.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
        assert bench.stands_at(0.0, 0.0)


def hold_before(bench: Bench, line: bytes) -> None:
    """Let another thread hold it between a driver's last check and the bytes that it then sends."""
    far_end = bench.board.far_end
    feed = far_end.feed

    def feed_late(data: bytes) -> None:
        if data.startswith(line):
            far_end.feed = feed  # type: ignore[method-assign]  # a far end has no hook for this
            bench.driver.hold()
        feed(data)

    far_end.feed = feed_late  # type: ignore[method-assign]  # as above


def test_a_hold_by_another_thread_just_before_homing_begins_stops_it() -> None:
    bench = grbl_bench().homed()
    hold_before(bench, b"$H")

    bench.driver.home()

    assert bench.rest() == PanTiltState(connected=True)
    assert bench.stands_at(0.0, 0.0)


def test_a_hold_by_another_thread_just_before_a_move_begins_stops_it() -> None:
    bench = grbl_bench().homed()
    hold_before(bench, b"$J")

    bench.driver.move_to(bearing(60.0, 0.0))

    assert bench.rest().fault is None
    assert bench.place_deg[0] < 1.0


def test_a_board_that_a_person_holds_is_homed_only_once_it_is_released() -> None:
    bench = grbl_bench().homed()
    bench.board.far_end.feed(b"!")

    assert "it is in state Hold: release it at the board; home it again" in (bench.driver.state.fault or "")
    with pytest.raises(DeviceFault, match="in state Hold; release it at the board first"):
        bench.driver.home()
    bench.board.far_end.feed(b"~")
    bench.driver.home()

    assert bench.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))


def mute_rail() -> tuple[BoardLoopback[BoardFarEnd], VirtualClock, GrblRail]:
    """Return a rail without switches whose board an alarm has silenced."""
    clock = VirtualClock(1_000_000_000)
    board: BoardLoopback[BoardFarEnd] = BoardLoopback(
        GrblFarEnd(clock, TurningHistory(), has_rail=True), clock
    )
    rail = GrblRail(
        board.open,
        clock,
        limits=RailLimits(min_m=-0.3, max_m=0.3),
        mounting=GrblRailMounting(has_switches=False),
    )
    rail.connect()
    rail.confirm_zero()
    board.hit_a_limit()
    return board, clock, rail


def test_the_zero_of_a_board_that_says_nothing_is_refused_in_words() -> None:
    _, _, rail = mute_rail()

    with pytest.raises(DeviceFault, match=r"counts nothing; .* then confirm again"):
        rail.confirm_zero()

    assert rail.state.awaits_zero


def test_a_board_that_an_alarm_silenced_is_reset_after_a_second_and_keeps_its_fault() -> None:
    _, clock, rail = mute_rail()
    fault = rail.state.fault

    for _ in range(200):
        clock.sleep_until_ns(clock.now_ns() + 100_000_000)
        assert rail.state.connected

    assert rail.state.fault == fault
    assert "limit switch was hit" in (fault or "")


def test_a_board_switched_off_after_an_alarm_has_its_last_word_within_five_seconds() -> None:
    board, clock, rail = mute_rail()
    assert rail.state.connected
    board.set_faults(silent=True)
    off_ns = clock.now_ns()

    while rail.state.connected and clock.now_ns() - off_ns < 60_000_000_000:
        clock.sleep_until_ns(clock.now_ns() + 100_000_000)

    assert (clock.now_ns() - off_ns) / 1e9 < 5.0
    assert "did not answer a reset; check its cable" in (rail.state.fault or "")


def test_homing_that_was_held_ends_soon_though_the_board_died_of_it() -> None:
    bench = grbl_bench()
    bench.driver.connect()
    bench.driver.home()
    bench.wait(0.5)
    bench.board.set_faults(silent=True)
    bench.driver.hold()
    with pytest.raises(Busy, match="wait"):
        bench.driver.home()

    assert not bench.wait(6.0).connected


def test_what_a_board_sent_before_it_was_connected_is_not_believed() -> None:
    bench = grbl_bench().homed()
    bench.driver.close()
    bench.board.far_end.feed(b"?")  # another session asked, and is gone
    bench.board.hit_a_limit()  # it is silent now, until it is reset

    bench.driver.connect()

    assert bench.driver.state == PanTiltState(connected=True)
    bench.driver.home()
    assert bench.rest().homed


def test_a_homing_command_that_arrived_as_an_unlocking_one_has_not_homed() -> None:
    bench = grbl_bench()
    bench.driver.connect()
    bench.board.damage_to_device(LineDamage(kind=DamageKind.CORRUPT, skip=5, value=ord("H") ^ ord("X")))

    bench.driver.home()

    state = bench.rest()
    assert not state.homed
    assert "homing failed (it took the command for another one)" in (state.fault or "")


def test_the_success_of_a_hold_is_not_taken_for_that_of_a_homing_that_a_limit_broke_off() -> None:
    bench = ptu_bench()
    bench.driver.connect()
    bench.driver.home()
    bench.wait(3.0)
    bench.board.hit_a_limit()
    bench.driver.hold()

    state = bench.rest()

    assert not state.homed
    bench.driver.home()
    assert bench.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
