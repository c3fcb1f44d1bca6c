"""What a Basler camera sets by itself, on the vendor's emulator: it has the modes, and changes no value.

What a camera would change, a test changes through the library.
"""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from foveacam_hardware.contract import (
    AutoMode,
    CameraSettings,
    DeviceFault,
    MonotonicClock,
    OutOfRange,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.pylon.device import PylonDevice
from foveacam_hardware.drivers.cameras.pylon.nodes import READ_ONLY, Vendor
from foveacam_hardware.drivers.cameras.pylon.settings import PylonOptions, check_settings, ranges_of

SERIAL = "0815-0001"
SETTINGS = CameraSettings(exposure_ns=1_000_000, frame_rate_hz=100.0)
CONTINUOUS = replace(SETTINGS, exposure_auto=AutoMode.CONTINUOUS)
ONCE = replace(SETTINGS, exposure_auto=AutoMode.ONCE)
FREE = replace(SETTINGS, frame_rate_auto=True)


@pytest.fixture(scope="module")
def device() -> Iterator[PylonDevice]:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=64, height=64))
    device.open()
    yield device
    device.close()


def features(device: PylonDevice) -> Vendor:
    """Return the features of the vendor's camera itself."""
    return device._camera.GetNodeMap()


@pytest.mark.parametrize("asked", [CONTINUOUS, ONCE, SETTINGS])
def test_a_mode_reaches_the_camera(device: PylonDevice, asked: CameraSettings) -> None:
    taken = device.configure(asked)

    assert taken == asked
    assert features(device).GetNode("ExposureAuto").GetValue() == asked.exposure_auto.title()


def test_what_the_camera_sets_itself_to_is_read_while_it_streams(device: PylonDevice) -> None:
    device.configure(ONCE)
    device.start()
    features(device).GetNode("ExposureTimeAbs").SetValue(3300.0)
    running = device.read_settings()
    features(device).GetNode("ExposureAuto").SetValue("Off")
    ended = device.read_settings()
    device.stop()

    assert (running.exposure_ns, running.exposure_auto) == (3_300_000, AutoMode.ONCE)
    assert (ended.exposure_ns, ended.exposure_auto) == (3_300_000, AutoMode.OFF)


def test_a_rate_of_its_own_is_switched_and_left(device: PylonDevice) -> None:
    enabled = features(device).GetNode("AcquisitionFrameRateEnable")
    free = device.configure(FREE)
    assert not enabled.GetValue()
    by_hand = device.configure(SETTINGS)

    assert (free.frame_rate_auto, by_hand.frame_rate_auto, by_hand.frame_rate_hz) == (True, False, 100.0)
    assert enabled.GetValue()


def test_a_camera_that_was_not_configured_has_no_settings_to_tell() -> None:
    fresh = PylonDevice(SERIAL, clock=MonotonicClock())
    with pytest.raises(DeviceFault, match="configure it first"):
        fresh.read_settings()


class Locked:
    """A number that cannot be written while the camera sets it itself, as on real cameras."""

    def __init__(self, node: Vendor) -> None:
        self._node = node

    def __getattr__(self, name: str) -> Vendor:
        return getattr(self._node, name)

    def GetAccessMode(self) -> int:  # noqa: N802 - the vendor's name
        return READ_ONLY


class Features:
    """The emulator's features, of which some are locked, and some are missing."""

    def __init__(self, nodes: Vendor, *, locked: tuple[str, ...] = (), missing: tuple[str, ...] = ()) -> None:
        self._nodes = nodes
        self._locked = locked
        self._missing = missing

    def GetNode(self, name: str) -> Vendor:  # noqa: N802 - the vendor's name
        node = None if name in self._missing else self._nodes.GetNode(name)
        return Locked(node) if name in self._locked else node


def test_what_is_locked_meanwhile_keeps_its_range(device: PylonDevice) -> None:
    by_hand = device.ranges()
    device.configure(replace(CONTINUOUS, frame_rate_auto=True))
    locked = Features(features(device), locked=("ExposureTimeAbs", "AcquisitionFrameRateAbs"))

    assert ranges_of(locked) == by_hand
    device.configure(SETTINGS)
    assert ranges_of(locked).exposure_ns == ValueRange(low=1e6, high=1e6)  # locked for another reason


def test_a_camera_without_the_modes_refuses_them_in_a_sentence(device: PylonDevice) -> None:
    plain = Features(features(device), missing=("ExposureAuto", "AcquisitionFrameRateEnable"))

    assert ranges_of(plain).exposure_autos == (AutoMode.OFF,)
    with pytest.raises(OutOfRange, match="camera 1: automatic exposure, once, is not one of its own"):
        check_settings(plain, ONCE, label="camera 1")
    with pytest.raises(OutOfRange, match="camera 1: it cannot choose its frame rate itself; give one in Hz"):
        check_settings(plain, FREE, label="camera 1")
