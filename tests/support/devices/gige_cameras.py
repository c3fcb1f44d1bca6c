"""GigE Vision cameras on this machine's loopback, served by libaravis.

Only one can be there at a time, whichever process of the tests it belongs to.
"""

import fcntl
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from foveacam_hardware.contract import CameraSettings, Clock, DeviceInfo, MonotonicClock, NotConnected, Role
from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary, find_cameras
from foveacam_hardware.drivers.cameras.aravis.settings import AravisOptions
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera

LOOPBACK = "127.0.0.1"
PROGRAM = "arv-fake-gv-camera-0.8"
SETTINGS = CameraSettings(exposure_ns=5_000_000, frame_rate_hz=30.0)
WIDTH, HEIGHT = 720, 540
OPTIONS = AravisOptions(width_px=WIDTH, height_px=HEIGHT, packet_size_bytes=8900, interface=LOOPBACK)


def require_library() -> None:
    """Skip where there is no libaravis to be had."""
    try:
        AravisLibrary()
    except NotConnected as missing:
        pytest.skip(str(missing))


@contextmanager
def alone_on_loopback() -> Iterator[None]:
    """Keep other processes' cameras away; skip where there is no library."""
    require_library()
    with (Path(tempfile.gettempdir()) / "foveacam-gige-loopback.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class FakeProgram:
    """The fake camera in its own process, which can be stopped and killed."""

    def __init__(self, serial: str, *, description: Path | None = None) -> None:
        if shutil.which(PROGRAM) is None:
            pytest.skip(f"{PROGRAM} is not installed; Debian and Ubuntu: apt-get install aravis-tools")
        self.serial = serial
        self._described = [] if description is None else ["-g", str(description)]
        self._process = self._launch()

    def signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def kill(self) -> None:
        """End it at once, as a pulled plug does."""
        self._process.kill()
        self._process.wait()

    def come_back(self) -> None:
        """Start it again."""
        self._process = self._launch()

    def _launch(self) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [PROGRAM, "-i", LOOPBACK, "-s", self.serial, *self._described],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


def await_on_network(serial: str, *, within_s: float = 20.0) -> None:
    """Wait until a camera answers."""
    until_s = time.monotonic() + within_s
    while all(found.info.serial != serial for found in find_cameras()):
        assert time.monotonic() < until_s, f"{serial} does not answer"
        threading.Event().wait(0.05)


@contextmanager
def fake_program(serial: str, *, description: Path | None = None) -> Iterator[FakeProgram]:
    """Run the fake camera, alone on the loopback; `description`: a GenICam file in place of its own."""
    with alone_on_loopback():
        program = FakeProgram(serial, description=description)
        try:
            await_on_network(serial)
            yield program
        finally:
            program.kill()


def aravis_camera(
    serial: str,
    *,
    role: Role = Role.WIDE,
    settings: CameraSettings = SETTINGS,
    options: AravisOptions = OPTIONS,
    clock: Clock | None = None,
) -> SupervisedCamera:
    """Return the camera of this serial number, not connected."""
    on = clock or MonotonicClock()
    return SupervisedCamera(
        role,
        lambda: AravisDevice(serial, clock=on, options=options),
        clock=on,
        plan=CameraPlan(settings=settings),
        expected=DeviceInfo(vendor="", model="aravis", serial=serial),
    )
