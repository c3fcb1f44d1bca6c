"""A Basler camera of the rig that is removed, or whose buffers fail: lost, degraded, and back by itself."""

import threading
from collections.abc import Callable, Iterator

import pytest

from foveacam_hardware.contract import CameraPhase, CameraSettings, DeviceInfo, MonotonicClock, Role
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.pylon.device import PylonDevice
from foveacam_hardware.drivers.cameras.pylon.settings import PylonOptions
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera

SERIAL = "0815-0001"
SETTINGS = CameraSettings(exposure_ns=1_000_000, gain_db=6.0, frame_rate_hz=20.0)


def wait_until(holds: Callable[[], bool]) -> None:
    never = threading.Event()
    for _ in range(600):
        if holds():
            return
        never.wait(0.02)
    raise AssertionError("it did not come about")


@pytest.fixture
def opened() -> Iterator[tuple[SupervisedCamera, list[PylonDevice]]]:
    """A streaming camera, and the devices that it has opened, the newest last."""
    devices: list[PylonDevice] = []
    clock = MonotonicClock()

    def factory() -> PylonDevice:
        devices.append(PylonDevice(SERIAL, clock=clock, options=PylonOptions(width=320, height=240)))
        return devices[-1]

    expected = DeviceInfo(vendor="Basler", model="", serial=SERIAL)
    camera = SupervisedCamera(
        Role.LEFT, factory, clock=clock, plan=CameraPlan(settings=SETTINGS), expected=expected
    )
    camera.connect()
    camera.start()
    yield camera, devices
    camera.close()


def test_a_removed_camera_comes_back_with_its_settings(
    opened: tuple[SupervisedCamera, list[PylonDevice]],
) -> None:
    camera, devices = opened
    before = camera.read(timeout_ms=5000.0)
    settings = camera.settings
    devices[-1]._camera.FirePnPCallback.Execute()
    wait_until(lambda: camera.link.epoch > before.epoch and camera.link.phase is CameraPhase.STREAMING)
    after = camera.read(timeout_ms=5000.0)

    assert (camera.settings, after.epoch) == (settings, before.epoch + 1)
    assert after.seq > before.seq
    assert camera.settings.gain_db == pytest.approx(6.0, abs=0.01)


def test_failed_buffers_are_counted_and_make_the_camera_degraded(
    opened: tuple[SupervisedCamera, list[PylonDevice]],
) -> None:
    camera, devices = opened
    camera.read(timeout_ms=5000.0)
    emulator = devices[-1]._camera
    emulator.ForceFailedBufferCount.SetValue(4)
    emulator.ForceFailedBuffer.Execute()
    wait_until(lambda: camera.counters.incomplete == 4)
    wait_until(lambda: camera.link.phase is CameraPhase.DEGRADED)
    reason = camera.link.reason
    wait_until(lambda: camera.link.phase is CameraPhase.STREAMING)

    assert "packets are missing" in reason
    assert camera.link.epoch == 1
