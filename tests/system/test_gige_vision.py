"""Genuine GigE Vision, served by libaravis: our pictures arrive unchanged, faults are noticed."""

import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    CameraPhase,
    FoveaError,
    MonotonicClock,
    NotConnected,
    PixelFormat,
    Role,
    Timeout,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice
from foveacam_hardware.drivers.cameras.aravis.settings import AravisOptions
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera
from foveacam_hardware.sim.rig import open_simulated
from tests.support.devices.gige_cameras import (
    LOOPBACK,
    OPTIONS,
    SETTINGS,
    FakeProgram,
    alone_on_loopback,
    aravis_camera,
    await_on_network,
    fake_program,
    require_library,
)
from tests.support.devices.gige_far_end import AcquisitionRequest, GigeCamera

WHOLE = AravisOptions(width_px=1440, height_px=1080, packet_size_bytes=8900)
PATIENCE_S = 40.0
FIRST_FRAME = 65400
"""What the fake camera's numbers begin with."""
COMMANDED = replace(SETTINGS, triggered=True, trigger_source=TriggerSource.SOFTWARE)
UP = (CameraPhase.STREAMING, CameraPhase.DEGRADED)


def wait_until(reached: Callable[[], bool]) -> None:
    """Wait until something is so; how soon it is, `foveacam bench faults` measures."""
    until_s = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < until_s, "it did not become so"
        threading.Event().wait(0.01)


@pytest.fixture(scope="module")
def wide_picture() -> NDArray[np.uint8]:
    """What the wide camera of the simulated rig sees, grey."""
    with open_simulated(inline=True) as rig:
        rig.wide.configure(replace(rig.wide.settings, pixel_format=PixelFormat.MONO8))
        return np.asarray(rig.wide.read().image, dtype=np.uint8)


def test_a_rendered_wide_frame_comes_through_gige_vision_unchanged(wide_picture: NDArray[np.uint8]) -> None:
    asked: list[AcquisitionRequest] = []

    def serve(request: AcquisitionRequest) -> NDArray[np.uint8]:
        asked.append(request)
        return wide_picture

    with alone_on_loopback(), GigeCamera(interface=LOOPBACK, serial="OURS-2", picture=serve):
        await_on_network("OURS-2")
        camera = aravis_camera("OURS-2", settings=replace(SETTINGS, gain_db=2.0), options=WHOLE)
        camera.connect()
        camera.start()
        frames = list(camera.frames(5, timeout_ms=5000.0))
        camera.close()

    assert all(np.array_equal(frame.image, wide_picture) for frame in frames)
    assert float(wide_picture.std()) > 10.0
    assert (asked[-1].exposure_us, asked[-1].gain) == (5000, 2)  # what was set has arrived at the far end


@pytest.fixture(scope="module")
def program() -> Iterator[FakeProgram]:
    with fake_program("FOVEA-2") as running:
        yield running


@pytest.fixture
def camera(program: FakeProgram, request: pytest.FixtureRequest) -> Iterator[SupervisedCamera]:
    opened = aravis_camera(program.serial, settings=request.param)
    try:
        opened.connect()
        opened.start()
        expose(opened)
        yield opened
    finally:
        opened.close()  # also one that failed: it would go on trying, and hold the camera for good


def expose(camera: SupervisedCamera) -> int:
    """Return the epoch of the next frame."""
    if camera.settings.triggered:
        camera.software_trigger()
    return camera.read(timeout_ms=10_000.0).epoch


@pytest.mark.parametrize(
    ("camera", "fault", "outage_s"),
    [
        pytest.param(SETTINGS, "killed", 0.0, id="free running, killed"),
        pytest.param(SETTINGS, "killed", 3.5, id="free running, killed for long"),
        pytest.param(SETTINGS, "stopped", 0.0, id="free running, stopped"),
        pytest.param(COMMANDED, "killed", 0.0, id="by command, killed"),
        pytest.param(COMMANDED, "stopped", 0.0, id="by command, stopped"),
    ],
    indirect=["camera"],
)
def test_a_camera_that_is_gone_is_noticed_and_comes_back_by_itself(
    camera: SupervisedCamera, program: FakeProgram, fault: str, outage_s: float
) -> None:
    if fault == "killed":
        program.kill()
    else:
        program.signal(signal.SIGSTOP)
    wait_until(lambda: camera.link.phase not in UP)
    with pytest.raises(NotConnected, match="camera wide: asked to read, but it is not connected"):
        camera.read(timeout_ms=100.0)
    threading.Event().wait(outage_s)  # how long it is away is the fault itself
    if fault == "killed":
        program.come_back()
    else:
        program.signal(signal.SIGCONT)
    wait_until(lambda: camera.link.phase in UP)
    assert expose(camera) >= 2


def test_a_camera_that_another_program_holds_says_so(program: FakeProgram) -> None:
    code = (
        "import sys\n"
        "from foveacam_hardware.contract import MonotonicClock\n"
        "from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice\n"
        f"device = AravisDevice({program.serial!r}, clock=MonotonicClock())\n"
        "device.open()\n"
        "print('held', flush=True)\n"
        "sys.stdin.read()\n"
        "device.close()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with closing(aravis_camera(program.serial)) as camera:
            with pytest.raises(NotConnected, match=r"serial FOVEA-2 is held by another program.*close"):
                camera.connect()
            holder.communicate("")
            wait_until(lambda: camera.link.phase is CameraPhase.READY)


@pytest.mark.parametrize(
    ("serial", "options", "words"),
    [
        ("FOVEA-9", OPTIONS, r"FOVEA-9 is not found \(cameras that answer: .*FOVEA-2.*correct the serial"),
        (
            "FOVEA-2",
            replace(OPTIONS, interface="10.9.8.7"),
            r"reached through 10\.9\.8\.7.*found through 127",
        ),
    ],
)
def test_a_camera_that_is_not_where_the_rig_file_says_is_told_with_what_was_found(
    program: FakeProgram, serial: str, options: AravisOptions, words: str
) -> None:
    with closing(aravis_camera(serial, options=options)) as camera, pytest.raises(NotConnected, match=words):
        camera.connect()


def test_more_pixels_than_the_sensor_has_are_refused(program: FakeProgram) -> None:
    too_many = AravisOptions(width_px=5000, height_px=5000)
    with (
        closing(aravis_camera(program.serial, options=too_many)) as camera,
        pytest.raises(FoveaError, match="5000x5000 pixels, but its sensor has 2048x2048"),
    ):
        camera.connect()


def test_a_camera_that_waits_for_its_line_is_silent_and_not_lost(program: FakeProgram) -> None:
    waiting = replace(SETTINGS, triggered=True)
    with closing(aravis_camera(program.serial, role=Role.LEFT, settings=waiting)) as camera:
        camera.connect()
        camera.start()
        with pytest.raises(Timeout, match="camera left: no trigger arrived in time; check the trigger cable"):
            camera.read(timeout_ms=1200.0)

        assert camera.settings == waiting
        assert (camera.link.phase, camera.link.epoch) == (CameraPhase.STREAMING, 1)


def test_what_others_send_on_the_network_does_not_count_as_frames(program: FakeProgram) -> None:
    """A packet socket hears everything until its filter stands, and numbers frames by what it heard."""
    for _ in range(3):
        with foreign_frames(), closing(aravis_camera(program.serial, settings=COMMANDED)) as camera:
            camera.connect()
            camera.start()
            assert expose(camera) == 1


@contextmanager
def foreign_frames() -> Iterator[None]:
    """Let the loopback be full of packets like a camera's, of a later frame, for a port of somebody else."""
    ended = threading.Event()
    leader = struct.pack(">HHI", 0, FIRST_FRAME + 50, 1 << 24) + bytes(64)

    def flood() -> None:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        ):
            listener.bind((LOOPBACK, 0))
            while not ended.wait(0.002):
                sender.sendto(leader, listener.getsockname())

    flooding = threading.Thread(target=flood)
    flooding.start()
    try:
        yield
    finally:
        ended.set()
        flooding.join()


def test_an_output_that_is_not_there_does_not_keep_a_camera_from_opening(program: FakeProgram) -> None:
    device = AravisDevice(
        program.serial, clock=MonotonicClock(), options=replace(OPTIONS, strobe_line="Line9")
    )
    assert device.open().serial == program.serial
    assert device.alive()
    device.close()
    device.close()


def test_three_cameras_on_three_interfaces_open_as_a_rig(tmp_path: Path) -> None:
    """In a network of its own: three cameras need three addresses."""
    require_library()
    unshared = subprocess.run(
        [
            "unshare",
            "--net",
            "--map-root-user",
            sys.executable,
            "-m",
            "tests.support.servers.gige_rig",
            str(tmp_path),
        ],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    if "unshare" in unshared.stderr:
        pytest.skip(f"no network of its own to be had here: {unshared.stderr.strip()}")

    assert unshared.returncode == 0, unshared.stderr
    assert unshared.stdout.split() == ["wide", "left", "right", "missing:mirrors"]
