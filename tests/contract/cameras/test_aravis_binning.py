"""Binning through libaravis: on its fake camera, which describes itself as one that averages or sums."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from tests.support.devices import genicam_descriptions as genicam
from tests.support.devices.gige_cameras import (
    HEIGHT,
    OPTIONS,
    SETTINGS,
    WIDTH,
    await_on_network,
    fake_program,
    require_library,
)

from foveacam_hardware.contract import MonotonicClock, PixelFormat
from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice
from foveacam_hardware.drivers.cameras.aravis.region import REGION
from foveacam_hardware.drivers.cameras.aravis.settings import AravisFeatures, AravisOptions

SERIAL = "BINS-1"
BINNED = replace(SETTINGS, binning=2)


@contextmanager
def opened(options: AravisOptions = OPTIONS) -> Iterator[AravisDevice]:
    device = AravisDevice(SERIAL, clock=MonotonicClock(), options=options)
    device.open()
    yield device
    device.close()


@pytest.fixture(scope="module")
def served(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Serve a camera with the modes of binning of the test's parameter."""
    require_library()
    path = tmp_path_factory.mktemp("genicam") / "camera.xml"
    path.write_text(genicam.with_binning_modes(*request.param), encoding="utf-8")
    with fake_program(SERIAL, description=path):
        await_on_network(SERIAL)
        yield


def with_modes(*modes: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("served", [modes], indirect=True, ids=["-".join(modes)], scope="module")


def features(device: AravisDevice) -> AravisFeatures:
    found = device._features
    assert found is not None
    return found


def state(device: AravisDevice) -> tuple[int, int, tuple[int, ...]]:
    """Return both binnings and the region of the camera."""
    read = features(device).integer
    return read("BinningHorizontal"), read("BinningVertical"), tuple(read(name) for name in REGION)


@with_modes("Sum", "Average")
def test_a_camera_that_averages_bins_the_same_part_of_its_sensor(served: None) -> None:
    with opened() as device:
        device.configure(SETTINGS)
        _, _, whole = state(device)
        taken = device.configure(BINNED)
        half = state(device)
        device.start()
        grab = device.grab(timeout_ms=2000.0)
        device.stop()
        back = device.configure(SETTINGS)

        assert taken.binning == 2
        assert half == (2, 2, tuple(size // 2 for size in whole))
        assert features(device).text("BinningHorizontalMode") == "Average"
        assert features(device).text("BinningVerticalMode") == "Average"
        assert grab is not None
        assert grab.image is not None
        assert grab.image.shape == (HEIGHT // 2, WIDTH // 2)
        assert (back.binning, state(device)) == (1, (1, 1, whole))


@with_modes("Sum", "Average")
@pytest.mark.parametrize("offset_px", [100, 101])
def test_a_region_that_begins_at_an_odd_pixel_is_left_to_the_host(served: None, offset_px: int) -> None:
    with opened(replace(OPTIONS, offset_x_px=offset_px, offset_y_px=40)) as device:
        taken = device.configure(BINNED)

        assert taken.binning == (1 if offset_px % 2 else 2)
        expected_px = (offset_px, 40, WIDTH, HEIGHT)
        assert state(device)[2] == tuple(size // taken.binning for size in expected_px)


@with_modes("Sum", "Average")
def test_a_bayer_mosaic_is_left_to_the_host(served: None) -> None:
    with opened() as device:
        assert device.configure(replace(BINNED, pixel_format=PixelFormat.BAYER_RG8)).binning == 1
        assert state(device)[:2] == (1, 1)


@with_modes("Sum")
def test_a_camera_that_can_only_add_up_is_left_at_full_size(served: None) -> None:
    with opened() as device:
        assert device.configure(BINNED).binning == 1
        assert state(device)[:2] == (1, 1)
