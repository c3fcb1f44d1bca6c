"""Automatic modes through libaravis: on its fake camera, which describes itself as one that has them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.devices import genicam_descriptions as genicam
from tests.support.devices.gige_cameras import (
    OPTIONS,
    SETTINGS,
    await_on_network,
    fake_program,
    require_library,
)

from foveacam_hardware.contract import AutoMode, CameraSettings, MonotonicClock
from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice
from foveacam_hardware.drivers.cameras.aravis.settings import AravisFeatures

SERIAL = "AUTO-1"
CONTINUOUS = replace(SETTINGS, exposure_auto=AutoMode.CONTINUOUS)
ONCE = replace(SETTINGS, exposure_auto=AutoMode.ONCE)
FREE = replace(SETTINGS, frame_rate_auto=True)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    require_library()
    path: Path = tmp_path_factory.mktemp("genicam") / "camera.xml"
    path.write_text(genicam.with_automatic_modes(), encoding="utf-8")
    with fake_program(SERIAL, description=path):
        await_on_network(SERIAL)
        yield


@pytest.fixture
def device(served: None) -> Iterator[AravisDevice]:
    device = AravisDevice(SERIAL, clock=MonotonicClock(), options=OPTIONS)
    device.open()
    yield device
    device.close()


def registers(device: AravisDevice) -> AravisFeatures:
    """Return the camera's memory: what a camera does by itself is done there."""
    features = device._features
    assert features is not None
    return features


def test_its_modes_are_those_that_the_camera_names(device: AravisDevice) -> None:
    ranges = device.ranges()

    assert set(ranges.exposure_autos) == set(AutoMode)
    assert ranges.frame_rate_auto


@pytest.mark.parametrize(("asked", "written"), [(CONTINUOUS, genicam.CONTINUOUS), (ONCE, genicam.ONCE)])
def test_a_mode_reaches_the_camera_and_is_left_again(
    device: AravisDevice, asked: CameraSettings, written: int
) -> None:
    assert device.configure(asked).exposure_auto is asked.exposure_auto
    assert registers(device).read_register(genicam.EXPOSURE_AUTO_AT) == written
    assert device.configure(SETTINGS).exposure_auto is AutoMode.OFF
    assert registers(device).read_register(genicam.EXPOSURE_AUTO_AT) == genicam.OFF


def test_what_the_camera_sets_itself_to_is_read_while_it_streams(device: AravisDevice) -> None:
    device.configure(ONCE)
    device.start()
    registers(device).call("set_exposure_time", 12_000.0)
    running = device.read_settings()
    registers(device).write_register(genicam.EXPOSURE_AUTO_AT, genicam.OFF)
    ended = device.read_settings()

    assert (running.exposure_ns, running.exposure_auto) == (12_000_000, AutoMode.ONCE)
    assert (ended.exposure_ns, ended.exposure_auto) == (12_000_000, AutoMode.OFF)


def test_a_rate_of_its_own_is_switched_and_told_as_the_camera_says(device: AravisDevice) -> None:
    registers(device).write_register(genicam.RESULTING_AT, 87)
    free = device.configure(FREE)
    assert registers(device).read_register(genicam.RATE_BY_HAND_AT) == 0
    by_hand = device.configure(SETTINGS)

    assert (free.frame_rate_auto, free.frame_rate_hz) == (True, 87.0)
    assert not by_hand.frame_rate_auto
    assert by_hand.frame_rate_hz == pytest.approx(30.0, rel=0.01)
    assert registers(device).read_register(genicam.RATE_BY_HAND_AT) == 1


def test_an_opened_camera_has_nothing_automatic_left_of_before(device: AravisDevice) -> None:
    device.configure(CONTINUOUS)
    device.close()
    device.open()

    assert registers(device).read_register(genicam.EXPOSURE_AUTO_AT) == genicam.OFF
