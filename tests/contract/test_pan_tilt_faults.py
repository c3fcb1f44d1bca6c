"""What a pan-tilt's driver does when board, line or people do not do what they should; on virtual time.

Every kind of board; what only one of them does is in `test_grbl_faults` and `test_ptu_faults`.
"""

import math
from collections.abc import Iterator

import pytest
from tests.support.devices.pan_tilt_boards import KINDS, Bench, Kind, bearing

from foveacam_hardware.contract import Busy, DeviceFault, NotConnected, OutOfRange, PanTiltState
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> Kind:
    return KINDS[str(request.param)]


@pytest.fixture
def bench(kind: Kind) -> Iterator[Bench]:
    built = kind.make()
    built.driver.connect()
    yield built
    built.driver.close()


@pytest.fixture
def homed(bench: Bench) -> Bench:
    return bench.homed()


def fault_of(state: PanTiltState) -> str:
    assert state.fault is not None
    return state.fault


def test_before_it_is_homed_it_knows_no_place_and_will_not_move(bench: Bench) -> None:
    assert bench.driver.state == PanTiltState(connected=True)

    with pytest.raises(DeviceFault, match=r"does not know where it stands; home it"):
        bench.driver.move_to(bearing(1.0, 0.0))


@pytest.mark.parametrize(("pan_deg", "tilt_deg"), [(math.nan, 0.0), (0.0, math.nan)])
def test_a_bearing_that_is_no_number_is_refused(homed: Bench, pan_deg: float, tilt_deg: float) -> None:
    with pytest.raises(OutOfRange, match="nan deg is outside"):
        homed.driver.move_to(bearing(pan_deg, tilt_deg))

    assert homed.rest().fault is None
    assert homed.stands_at(0.0, 0.0)


def test_homing_is_moving_until_the_rig_points_straight_ahead(bench: Bench, kind: Kind) -> None:
    into_s, longest_s = kind.homing_s
    began_ns = bench.clock.now_ns()
    bench.driver.home()

    assert bench.wait(into_s) == PanTiltState(connected=True, moving=True)
    with pytest.raises(Busy, match="wait"):
        bench.driver.move_to(bearing(1.0, 0.0))
    with pytest.raises(Busy, match="wait"):
        bench.driver.home()

    assert bench.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    assert bench.stands_at(0.0, 0.0)
    assert bench.clock.now_ns() - began_ns < longest_s * 1e9


def test_homing_that_fails_says_so_and_can_be_done_again(bench: Bench, kind: Kind) -> None:
    bench.board.set_faults(**kind.no_homing)
    bench.driver.home()

    state = bench.rest()
    assert not state.homed
    assert kind.homing_failed in fault_of(state)

    bench.board.set_faults(**kind.homing_again)
    bench.driver.home()
    assert bench.rest().homed


def test_a_board_that_dies_while_homing_is_noticed(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(0.5)
    bench.board.set_faults(silent=True)

    state = bench.wait(100.0)

    assert not state.connected
    assert not state.moving
    assert "connect it again" in fault_of(state)


def test_a_board_that_restarts_while_homing_has_failed(bench: Bench) -> None:
    bench.driver.home()
    bench.wait(2.0)
    bench.board.power_cycle()

    state = bench.rest()

    assert not state.homed
    assert "home again" in fault_of(state)


def test_a_limit_stops_everything_until_it_is_homed_again(homed: Bench, kind: Kind) -> None:
    homed.driver.move_to(bearing(50.0, 0.0))
    homed.wait(0.5)
    homed.board.hit_a_limit()
    homed.board.advance(homed.clock.now_ns())

    state = homed.rest()
    assert state.pose is None
    assert kind.limit in fault_of(state)
    with pytest.raises(DeviceFault, match="home it again"):
        homed.driver.move_to(bearing(0.0, 0.0))

    homed.driver.home()
    assert homed.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))
    assert homed.stands_at(0.0, 0.0)


def test_a_board_that_restarts_has_lost_its_place_and_works_again_when_homed(homed: Bench) -> None:
    homed.driver.move_to(bearing(20.0, 0.0))
    homed.rest()
    homed.board.power_cycle()

    state = homed.driver.state
    assert not state.homed
    assert state.pose is None
    assert "restarted by itself; home it again" in fault_of(state)
    assert homed.wait(1.0).fault == state.fault

    homed.driver.home()
    assert homed.rest().pose == bearing(0.0, 0.0)


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


def test_a_silent_board_is_given_up(homed: Bench, kind: Kind) -> None:
    homed.board.set_faults(silent=True)
    began_ns = homed.clock.now_ns()

    assert not homed.driver.state.connected

    assert homed.clock.now_ns() - began_ns < kind.silent_s * 1e9


def test_a_port_where_nobody_answers_is_named(kind: Kind) -> None:
    bench = kind.make()
    bench.board.set_faults(silent=True)

    with pytest.raises(NotConnected, match=kind.no_reply):
        bench.driver.connect()

    assert not bench.driver.state.connected


LOST_OF_A_MOVE = [
    *(("grbl", DamageKind.DROP, skip) for skip in range(36)),
    *(("ptu", damage, skip) for damage in (DamageKind.DROP, DamageKind.CORRUPT) for skip in range(18)),
]


@pytest.mark.parametrize(("kind", "damage", "skip"), LOST_OF_A_MOVE, indirect=["kind"])
def test_a_byte_of_a_move_lost_on_its_way_never_goes_unnoticed(
    homed: Bench, kind: Kind, damage: DamageKind, skip: int
) -> None:
    homed.board.damage_to_device(LineDamage(kind=damage, skip=skip, value=0x01))
    try:
        homed.driver.move_to(bearing(-11.0, 7.0))
    except (DeviceFault, NotConnected):
        assert kind.refuses_damage  # it said so at once
    else:
        state = homed.rest()
        if not homed.stands_at(-11.0, 7.0, near_deg=kind.damaged_deg or None):
            assert "again" in fault_of(state)
    homed.rest()

    if not homed.driver.state.connected:
        assert kind.refuses_damage
        homed.homed()
    homed.driver.move_to(bearing(-11.0, 7.0))
    assert homed.rest().fault is None
    assert homed.stands_at(-11.0, 7.0)


LOST_OF_AN_ANSWER = [
    *(("grbl", DamageKind.CORRUPT, skip) for skip in range(0, 60, 3)),
    *(("ptu", damage, skip) for damage in (DamageKind.DROP, DamageKind.CORRUPT) for skip in range(0, 24, 2)),
]


@pytest.mark.parametrize(("kind", "damage", "skip"), LOST_OF_AN_ANSWER, indirect=["kind"])
def test_a_byte_of_an_answer_lost_on_its_way_does_not_matter(
    homed: Bench, kind: Kind, damage: DamageKind, skip: int
) -> None:
    homed.board.damage_to_host(LineDamage(kind=damage, skip=skip, value=0x15))

    homed.driver.move_to(bearing(-11.0, 7.0))

    state = homed.rest()
    assert homed.stands_at(-11.0, 7.0)
    assert state.fault is None or kind.refuses_damage


def test_answers_that_come_late_belong_to_their_own_questions(homed: Bench) -> None:
    homed.board.set_faults(slow_ns=250_000_000)

    for pan_deg in (5.0, -5.0, 10.0):
        homed.driver.move_to(bearing(pan_deg, 0.0))
        assert homed.rest().fault is None
        assert homed.stands_at(pan_deg, 0.0)


def test_a_move_that_another_program_stops_is_reported_and_it_moves_again(homed: Bench, kind: Kind) -> None:
    homed.driver.move_to(bearing(60.0, 0.0))
    homed.wait(0.5)
    homed.board.far_end.feed(kind.stop)

    state = homed.rest()

    assert state.homed
    assert kind.stopped in fault_of(state)
    homed.driver.move_to(bearing(0.0, 0.0))
    assert homed.rest() == PanTiltState(connected=True, homed=True, pose=bearing(0.0, 0.0))


def test_what_a_board_does_not_have_cannot_be_impaired(kind: Kind, bench: Bench) -> None:
    other = next(found for found in KINDS.values() if found is not kind)
    with pytest.raises(ValueError, match="this board has no"):
        bench.board.set_faults(**({"steps_per_s": 1} if other is KINDS["ptu"] else {"has_switches": False}))


def test_the_same_session_runs_the_same_way_every_time(kind: Kind) -> None:
    def session() -> tuple[int, tuple[float, float]]:
        bench = kind.make().homed()
        bench.driver.move_to(bearing(33.0, -11.0))
        bench.wait(0.4)
        bench.driver.hold()
        bench.rest()
        return bench.clock.now_ns(), bench.place_deg

    assert session() == session()
