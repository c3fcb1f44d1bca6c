import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    InvalidInput,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PanTiltPose,
    Stopped,
)
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.positioners.pan_tilt import PanTiltService
from foveacam_server.rig.exclusive_pan_tilt import exclusive_pan_tilt
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import LiveRates

from .fake_rig import FakePanTilt, FakeRig, Pictures

PATIENCE_S = 10.0
THERE = PanTiltPose(pan_rad=0.3, tilt_rad=-0.1)


class Setup:
    """A hardware thread on a fake rig that turns."""

    def __init__(self, folder: Path) -> None:
        self.store = Store(folder)
        self.events = EventLog(self.store)
        clock = MonotonicClock()
        self.rig = FakeRig(clock)
        self.hardware = HardwareThread(
            lambda: self.rig,
            sink=Pictures(),
            events=self.events,
            clock=clock,
            overlay=lambda _gaze: None,
            limits=LiveRates(),
        )
        self.desk = PanTiltService(self.hardware)

    @property
    def pan_tilt(self) -> FakePanTilt:
        assert self.rig.pan_tilt is not None
        return self.rig.pan_tilt

    def wait_for(self, kind: str) -> dict[str, object]:
        done = threading.Event()
        while not done.wait(0.01):
            for event in self.events.recent(200):
                if event.kind == kind:
                    return event.data
        raise AssertionError(kind)


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    found = Setup(tmp_path)
    found.hardware.start()
    assert found.hardware.wait_open(PATIENCE_S)
    yield found
    found.hardware.close()
    found.events.close()
    found.store.close()


def never() -> bool:
    return False


def test_move_reaches_the_device(setup: Setup) -> None:
    setup.desk.move(THERE).result(PATIENCE_S)
    assert setup.desk.read_state().result(PATIENCE_S).pose == THERE


def test_refusal_of_the_device_comes_back(setup: Setup) -> None:
    with pytest.raises(OutOfRange, match="outside"):
        setup.desk.move(PanTiltPose(pan_rad=2.0, tilt_rad=0.0)).result(PATIENCE_S)


def test_unknown_station_is_refused_with_those_there_are(setup: Setup) -> None:
    setup.hardware.submit(lambda _rig: None).result(PATIENCE_S)
    assert setup.desk.station("markers").distance_m == 5.0
    with pytest.raises(InvalidInput, match="'board', 'markers'"):
        setup.desk.station("nowhere")


def test_stop_holds_it_and_refuses_moves(setup: Setup) -> None:
    setup.hardware.halt()
    assert setup.pan_tilt.commands[-1] == "hold"
    with pytest.raises(Stopped):
        setup.desk.move(THERE)
    setup.hardware.resume()
    setup.desk.move(THERE).result(PATIENCE_S)


def test_move_that_a_stop_overtakes_is_held_again(setup: Setup) -> None:
    setup.pan_tilt.on_move = setup.hardware.halt  # type: ignore[assignment]  # its answer is not wanted
    with pytest.raises(Stopped):
        setup.desk.move(THERE).result(PATIENCE_S)
    assert setup.pan_tilt.commands == ["move", "hold", "hold"]


def test_moves_wait_for_the_job_that_has_the_rig(setup: Setup) -> None:
    with setup.hardware.session("a calibration", cancelled=never):
        with pytest.raises(Busy, match="a calibration is using the rig"):
            setup.desk.move(THERE)
        pan_tilt = exclusive_pan_tilt(setup.hardware, cancelled=never)
        assert pan_tilt is not None
        pan_tilt.move_to(THERE)
        assert pan_tilt.state.pose == THERE


def test_cancelled_job_is_held_where_it_is(setup: Setup) -> None:
    pan_tilt = exclusive_pan_tilt(setup.hardware, cancelled=lambda: True)
    assert pan_tilt is not None
    with pytest.raises(Cancelled):
        pan_tilt.move_to(THERE)
    assert setup.pan_tilt.commands == ["hold"]


def test_hold_needs_nobodys_leave(setup: Setup) -> None:
    with setup.hardware.session("a calibration", cancelled=never):
        setup.desk.hold()
    assert setup.pan_tilt.commands == ["hold"]


def test_homing_is_seen(setup: Setup) -> None:
    setup.desk.home().result(PATIENCE_S)
    assert setup.desk.read_state().result(PATIENCE_S).homed


def test_a_zero_is_confirmed_to_the_device_while_no_job_has_the_rig(setup: Setup) -> None:
    with (
        setup.hardware.session("a calibration", cancelled=never),
        pytest.raises(Busy, match="a calibration is using the rig"),
    ):
        setup.desk.confirm_zero()
    setup.desk.confirm_zero().result(PATIENCE_S)
    assert setup.pan_tilt.commands == ["confirm zero"]


def test_rig_on_a_fixed_base_says_how_to_name_one(setup: Setup) -> None:
    setup.rig.pan_tilt = None
    setup.hardware.submit(lambda _rig: None).result(PATIENCE_S)
    with pytest.raises(NotConnected, match=r"\[pan_tilt\]"):
        setup.desk.move(THERE).result(PATIENCE_S)
    setup.desk.hold()


def test_alarm_of_the_device_is_told_until_it_is_over(setup: Setup) -> None:
    setup.pan_tilt.fault = "pan-tilt: alarm 1, a limit switch was hit; home it"
    assert setup.wait_for("device.fault")["device"] == "pan_tilt"
    setup.pan_tilt.fault = None
    assert setup.wait_for("device.recovered") == {"device": "pan_tilt"}
