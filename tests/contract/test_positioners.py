"""The contract of a positioner, run on every pan-tilt and rail: manual, simulated board, behind a port."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from tests.support.devices.positioner_benches import (
    Board,
    Position,
    PositionerBench,
    SharedShafts,
    board_process,
    grbl_pan_tilt,
    grbl_rail,
    manual_pan_tilt,
    manual_rail,
    ptu_pan_tilt,
    reported_position,
)

from foveacam_hardware.contract import Clock, MonotonicClock, NotConnected, OutOfRange, VirtualClock
from foveacam_hardware.rail_config import PAPER_PLACES
from foveacam_hardware.sim.far_ends.board_far_end import BoardKind
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import TurningHistory

SharedProcess = tuple[BoardProcess, SharedShafts]
MANUAL: dict[str, Callable[[Clock, TurningHistory], PositionerBench]] = {
    "manual pan-tilt": manual_pan_tilt,
    "manual rail": manual_rail,
}
DRIVEN: dict[str, Callable[[Board, Clock, TurningHistory], PositionerBench]] = {
    "grbl": grbl_pan_tilt,
    "ptu": ptu_pan_tilt,
    "rail": grbl_rail,
}
RAILS = ("rail loopback", "rail process", "manual rail")
KINDS = (*MANUAL, *(f"{name} {place}" for name in DRIVEN for place in ("loopback", "process")))


@pytest.fixture(scope="module")
def grbl() -> Iterator[SharedProcess]:
    with board_process(BoardKind.GRBL) as shared:
        yield shared


@pytest.fixture(scope="module")
def ptu() -> Iterator[SharedProcess]:
    with board_process(BoardKind.PTU) as shared:
        yield shared


@pytest.fixture(scope="module")
def rail() -> Iterator[SharedProcess]:
    with board_process(BoardKind.GRBL_WITH_RAIL) as shared:
        yield shared


def on_loopback(name: str, clock: VirtualClock, rig: TurningHistory) -> PositionerBench:
    if name == "ptu":
        return ptu_pan_tilt(BoardLoopback(PtuFarEnd(clock, rig), clock), clock, rig)
    board = BoardLoopback(GrblFarEnd(clock, rig, has_rail=name == "rail"), clock)
    return DRIVEN[name](board, clock, rig)


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[PositionerBench]:
    rig, virtual = TurningHistory(), VirtualClock(1_000_000_000)
    kind = str(request.param)
    name, _, place = kind.partition(" ")
    if kind in MANUAL:
        built = MANUAL[kind](virtual, rig)
    elif place == "loopback":
        built = on_loopback(name, virtual, rig)
    else:
        board, shafts = request.getfixturevalue(name)
        shafts.rig = rig
        board.power_cycle()
        built = DRIVEN[name](board, MonotonicClock(), rig)
        built.deliver = board.set_faults  # an empty command is answered after all movements
    yield built
    built.device.close()


def assert_arrived(bench: PositionerBench, position: Position) -> None:
    """Check that a motorised positioner reports this position and the rig has it, to the nearest step."""
    assert reported_position(bench.device.state) == pytest.approx(position, abs=0.6 * bench.step)
    assert bench.true_position == pytest.approx(position, abs=0.5 * bench.step + 1e-9)


def test_it_says_who_it_is_before_and_after_it_is_connected(bench: PositionerBench) -> None:
    serial = bench.device.info.serial
    bench.device.connect()

    assert bench.device.info.serial == serial
    assert bench.device.info.model


def test_connecting_and_closing_twice_is_harmless(bench: PositionerBench) -> None:
    state_type = type(bench.device.state)
    assert not bench.device.state.connected
    bench.device.connect()
    bench.device.connect()
    assert bench.device.state == state_type(connected=True)

    bench.device.close()
    bench.device.close()

    assert bench.device.state == state_type(connected=False)


@pytest.mark.parametrize("action", ["home", "hold", "move"])
def test_nothing_moves_before_it_is_connected(bench: PositionerBench, action: str) -> None:
    with pytest.raises(NotConnected, match="connect"):
        if action == "move":
            bench.move_to(bench.zero)
        else:
            getattr(bench.device, action)()


def test_it_can_be_used_again_after_it_was_closed(bench: PositionerBench) -> None:
    bench.home()
    bench.device.close()

    bench.home().move_to(bench.near)

    assert not bench.wait_for_rest().fault


def test_a_move_begins_at_once_and_ends_at_rest_where_it_was_asked_for(bench: PositionerBench) -> None:
    bench.home()
    bench.slow_down()
    bench.move_to(bench.near)

    assert bench.device.state.moving is bench.device.moves_itself
    state = bench.wait_for_rest()

    assert state.fault is None
    if bench.device.moves_itself:
        assert_arrived(bench, bench.near)
    else:
        assert bench.wanted == pytest.approx(bench.near)
        assert reported_position(state) is None


@pytest.mark.parametrize("bench", RAILS, indirect=True)
def test_a_rail_goes_to_each_of_the_papers_five_places(bench: PositionerBench) -> None:
    bench.home()
    for place in PAPER_PLACES:
        bench.move_to((1e3 * place.position_m,))

        assert bench.wait_for_rest().fault is None
        if bench.device.moves_itself:
            assert_arrived(bench, (1e3 * place.position_m,))


def test_after_homing_the_rig_is_at_its_zero(bench: PositionerBench) -> None:
    bench.home()

    assert bench.true_position == pytest.approx(bench.zero, abs=0.5 * bench.step)


def test_a_position_that_it_cannot_reach_is_refused_and_nothing_moves(bench: PositionerBench) -> None:
    bench.home()
    axes = range(len(bench.zero))
    no_numbers = [tuple(math.nan if axis == wrong else 0.0 for axis in axes) for wrong in axes]

    for position in (*bench.outside, *no_numbers):
        with pytest.raises(OutOfRange, match=bench.refusal):
            bench.move_to(position)
        assert not bench.device.state.moving


def test_the_limits_themselves_can_be_reached(bench: PositionerBench) -> None:
    bench.home()

    for position in bench.limits:
        bench.move_to(position)
        assert bench.wait_for_rest().fault is None


def test_a_hold_stops_it_on_its_way(bench: PositionerBench) -> None:
    bench.home()
    bench.slow_down()
    bench.move_to(bench.far)

    bench.device.hold()
    state = bench.wait_for_rest()

    assert state.fault is None
    assert abs(bench.true_position[0]) < bench.far[0] - 1.0
    bench.move_to(bench.zero)  # and it moves again
    assert bench.wait_for_rest().fault is None


def test_a_hold_from_another_thread_goes_through_while_its_state_is_read(bench: PositionerBench) -> None:
    bench.home()
    bench.slow_down()
    bench.move_to(bench.far)

    with ThreadPoolExecutor(1) as other:
        held = other.submit(bench.device.hold)
        state = bench.wait_for_rest()
        held.result()

    assert bench.wait_for_rest().fault is None
    assert state.connected
    assert abs(bench.true_position[0]) <= bench.far[0]


def test_the_last_of_two_moves_counts(bench: PositionerBench) -> None:
    bench.home()
    bench.slow_down()
    bench.move_to(bench.far)

    bench.move_to(bench.near)
    state = bench.wait_for_rest()

    assert state.fault is None
    if bench.device.moves_itself:
        assert_arrived(bench, bench.near)
