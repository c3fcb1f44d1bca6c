"""The pan-tilt behind the hardware thread: who may turn it when, and what a stop does to it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.devices.hardware_setup import PATIENCE_S, HardwareSetup, hardware_setup, never

from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    InvalidInput,
    NotConnected,
    OutOfRange,
    PanTiltPose,
    Stopped,
)
from foveacam_server.resources.devices.positioners.pan_tilt import PanTiltService
from foveacam_server.rig.exclusive_pan_tilt import exclusive_pan_tilt

THERE = PanTiltPose(pan_rad=0.3, tilt_rad=-0.1)


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path) as found:
        found.start()
        yield found


@pytest.fixture
def service(setup: HardwareSetup) -> PanTiltService:
    return PanTiltService(setup.hardware)


def test_move_reaches_the_device(service: PanTiltService) -> None:
    service.move(THERE).result(PATIENCE_S)
    assert service.read_state().result(PATIENCE_S).pose == THERE


def test_refusal_of_the_device_comes_back(service: PanTiltService) -> None:
    with pytest.raises(OutOfRange, match="outside"):
        service.move(PanTiltPose(pan_rad=2.0, tilt_rad=0.0)).result(PATIENCE_S)


def test_unknown_station_is_refused_with_those_there_are(
    setup: HardwareSetup, service: PanTiltService
) -> None:
    setup.hardware.submit(lambda _rig: None).result(PATIENCE_S)
    assert service.station("markers").distance_m == 5.0
    with pytest.raises(InvalidInput, match="'board', 'markers'"):
        service.station("nowhere")


def test_stop_holds_it_and_refuses_moves(setup: HardwareSetup, service: PanTiltService) -> None:
    setup.hardware.halt()
    assert setup.pan_tilt.commands[-1] == "hold"
    with pytest.raises(Stopped):
        service.move(THERE)
    setup.hardware.resume()
    service.move(THERE).result(PATIENCE_S)


def test_move_that_a_stop_overtakes_is_held_again(setup: HardwareSetup, service: PanTiltService) -> None:
    setup.pan_tilt.on_move = setup.hardware.halt  # type: ignore[assignment]  # its answer is not wanted
    with pytest.raises(Stopped):
        service.move(THERE).result(PATIENCE_S)
    assert setup.pan_tilt.commands == ["move", "hold", "hold"]


def test_moves_wait_for_the_job_that_has_the_rig(setup: HardwareSetup, service: PanTiltService) -> None:
    with setup.hardware.session("a calibration", cancelled=never):
        with pytest.raises(Busy, match="a calibration is using the rig"):
            service.move(THERE)
        pan_tilt = exclusive_pan_tilt(setup.hardware, cancelled=never)
        assert pan_tilt is not None
        pan_tilt.move_to(THERE)
        assert pan_tilt.state.pose == THERE


def test_cancelled_job_is_held_where_it_is(setup: HardwareSetup) -> None:
    pan_tilt = exclusive_pan_tilt(setup.hardware, cancelled=lambda: True)
    assert pan_tilt is not None
    with pytest.raises(Cancelled):
        pan_tilt.move_to(THERE)
    assert setup.pan_tilt.commands == ["hold"]


def test_hold_needs_nobodys_leave(setup: HardwareSetup, service: PanTiltService) -> None:
    with setup.hardware.session("a calibration", cancelled=never):
        service.hold()
    assert setup.pan_tilt.commands == ["hold"]


def test_homing_is_seen(service: PanTiltService) -> None:
    service.home().result(PATIENCE_S)
    assert service.read_state().result(PATIENCE_S).homed


def test_a_zero_is_confirmed_to_the_device_while_no_job_has_the_rig(
    setup: HardwareSetup, service: PanTiltService
) -> None:
    with (
        setup.hardware.session("a calibration", cancelled=never),
        pytest.raises(Busy, match="a calibration is using the rig"),
    ):
        service.confirm_zero()
    service.confirm_zero().result(PATIENCE_S)
    assert setup.pan_tilt.commands == ["confirm zero"]


def test_rig_on_a_fixed_base_says_how_to_name_one(setup: HardwareSetup, service: PanTiltService) -> None:
    setup.rig.pan_tilt = None
    setup.hardware.submit(lambda _rig: None).result(PATIENCE_S)
    with pytest.raises(NotConnected, match=r"\[pan_tilt\]"):
        service.move(THERE).result(PATIENCE_S)
    service.hold()


def test_alarm_of_the_device_is_told_until_it_is_over(setup: HardwareSetup) -> None:
    setup.pan_tilt.fault = "pan-tilt: alarm 1, a limit switch was hit; home it"
    assert setup.wait_for("device.fault")["device"] == "pan_tilt"
    setup.pan_tilt.fault = None
    assert setup.wait_for("device.recovered") == {"device": "pan_tilt"}
