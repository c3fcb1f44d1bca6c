"""The rail behind the hardware thread: who may move it when, and what a stop does to it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from tests.support.devices.hardware_setup import PATIENCE_S, HardwareSetup, hardware_setup, never

from foveacam_hardware.contract import (
    Busy,
    DeviceInfo,
    InvalidInput,
    NotConnected,
    OutOfRange,
    RailLimits,
    RailState,
    Stopped,
)
from foveacam_hardware.rail_config import PAPER_PLACES
from foveacam_server.resources.devices.positioners.rail import RailService


class FakeRail:
    """Moves at once."""

    info = DeviceInfo(vendor="test", model="rail", serial="3")
    limits = RailLimits(min_m=-0.3, max_m=0.3)
    moves_itself = True

    def __init__(self) -> None:
        self.position_m = 0.0
        self.commands: list[str] = []
        self.fault: str | None = None

    @property
    def state(self) -> RailState:
        return RailState(connected=True, homed=True, position_m=self.position_m, fault=self.fault)

    def connect(self) -> None:
        return

    def close(self) -> None:
        return

    def home(self) -> None:
        self.commands.append("home")

    def confirm_zero(self) -> None:
        self.commands.append("confirm zero")
        self.fault = None

    def move_to(self, position_m: float) -> None:
        if abs(position_m) > 0.3:
            raise OutOfRange("rail: outside ±300 mm; choose a place inside")
        self.commands.append("move")
        self.position_m = position_m

    def hold(self) -> None:
        self.commands.append("hold")


@dataclass
class OnRail:
    setup: HardwareSetup
    rail: FakeRail
    service: RailService


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path) as found:
        found.start()
        yield found


@pytest.fixture
def on_rail(setup: HardwareSetup) -> Iterator[OnRail]:
    rail = FakeRail()
    setup.rig.rail, setup.rig.rail_places = rail, PAPER_PLACES
    yield OnRail(setup=setup, rail=rail, service=RailService(setup.hardware))


def test_a_move_to_a_place_by_its_name_says_where_that_is(on_rail: OnRail) -> None:
    assert on_rail.service.move_to_place("far left").result(PATIENCE_S) == -0.3

    seen = on_rail.service.read_status().result(PATIENCE_S)
    assert seen is not None
    assert seen.state.position_m == -0.3
    assert seen.places == PAPER_PLACES


def test_a_place_that_nobody_named_lists_those_there_are(on_rail: OnRail) -> None:
    with pytest.raises(InvalidInput, match=r"no place 'middle'.*'centre'.*choose one"):
        on_rail.service.move_to_place("middle").result(PATIENCE_S)


def test_a_place_beyond_the_rail_is_refused(on_rail: OnRail) -> None:
    with pytest.raises(OutOfRange):
        on_rail.service.move(0.4).result(PATIENCE_S)


def test_while_stopped_nothing_moves_and_the_stop_itself_holds_the_rail(on_rail: OnRail) -> None:
    on_rail.setup.hardware.halt()

    assert on_rail.rail.commands == ["hold"]
    with pytest.raises(Stopped):
        on_rail.service.move(0.1)
    with pytest.raises(Stopped):
        on_rail.service.home()


def test_a_move_that_the_stop_overtakes_is_held(on_rail: OnRail, monkeypatch: pytest.MonkeyPatch) -> None:
    move_to = on_rail.rail.move_to

    def move_late(position_m: float) -> None:
        on_rail.setup.hardware.halt()
        move_to(position_m)

    monkeypatch.setattr(on_rail.rail, "move_to", move_late)
    with pytest.raises(Stopped):
        on_rail.service.move(0.1).result(PATIENCE_S)
    assert on_rail.rail.commands == ["hold", "move", "hold"]


def test_moves_wait_for_the_job_that_has_the_rig(on_rail: OnRail) -> None:
    with (
        on_rail.setup.hardware.session("a capture", cancelled=never),
        pytest.raises(Busy, match="a capture is using the rig"),
    ):
        on_rail.service.move(0.1)


def test_a_hold_goes_past_the_queue_while_a_job_has_the_rig(on_rail: OnRail) -> None:
    on_rail.service.read_status().result(PATIENCE_S)
    with on_rail.setup.hardware.session("a capture", cancelled=never):
        on_rail.service.hold()

    assert on_rail.rail.commands == ["hold"]


def test_its_alarm_is_told_until_it_is_over_and_keeps_nobody_from_looking(on_rail: OnRail) -> None:
    on_rail.rail.fault = "rail: alarm 1, a limit switch was hit; home it"
    assert on_rail.setup.wait_for("device.fault")["device"] == "rail"
    on_rail.setup.hardware.check_may_move()

    on_rail.rail.fault = None
    assert on_rail.setup.wait_for("device.recovered") == {"device": "rail"}


def test_a_rig_without_a_rail_says_how_to_name_one(setup: HardwareSetup) -> None:
    service = RailService(setup.hardware)

    assert service.read_status().result(PATIENCE_S) is None
    with pytest.raises(NotConnected, match=r"\[rail\]"):
        service.move(0.0).result(PATIENCE_S)
    service.hold()
