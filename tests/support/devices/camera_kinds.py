"""The cameras that the contract is run on: each kind opens what it needs, and gives fresh cameras of it."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.camera_config import OpenCvCameraConfig, PylonCameraConfig
from foveacam_hardware.contract import Camera, MonotonicClock, Role
from foveacam_hardware.rig import load_rig_config, open_rig
from foveacam_hardware.rig_cameras import build_camera
from foveacam_hardware.rig_replay import replay_rig
from tests.support.devices.fake_camera import FakeCamera, supervised
from tests.support.devices.gige_cameras import (
    LOOPBACK,
    alone_on_loopback,
    aravis_camera,
    await_on_network,
    fake_program,
)
from tests.support.devices.gige_far_end import AcquisitionRequest, GigeCamera
from tests.support.devices.mjpeg_server import MjpegServer
from tests.support.scenes.memory_recording import MemoryRecording

NewCamera: TypeAlias = Callable[[], Camera]
"""Returns a camera that was never connected; free-running, unless its rig file says otherwise."""
Kind: TypeAlias = Callable[[], AbstractContextManager[NewCamera]]


@contextmanager
def scripted() -> Iterator[NewCamera]:
    """A camera without a library."""
    yield lambda: supervised(FakeCamera(MonotonicClock()))


@contextmanager
def aravis() -> Iterator[NewCamera]:
    """Aravis' fake GigE Vision camera in its own process."""
    with fake_program("FOVEA-1"):
        yield lambda: aravis_camera("FOVEA-1")


@contextmanager
def aravis_with_our_pictures() -> Iterator[NewCamera]:
    """The same in this process, sending pictures of ours."""
    rng = np.random.default_rng(3)

    def noise(request: AcquisitionRequest) -> NDArray[np.uint8]:
        shape = (request.height, request.width, request.channels)
        picture = rng.integers(0, 256, shape, dtype=np.uint8)
        return picture if request.channels == 3 else picture[:, :, 0]

    with alone_on_loopback(), GigeCamera(interface=LOOPBACK, serial="OURS-1", picture=noise):
        await_on_network("OURS-1")
        yield lambda: aravis_camera("OURS-1")


@contextmanager
def pylon() -> Iterator[NewCamera]:
    """The vendor's emulated Basler camera."""
    given = PylonCameraConfig(
        kind="pylon", serial="0815-0002", trigger="none", width_px=320, height_px=240, frame_rate_hz=25.0
    )
    yield lambda: build_camera(Role.RIGHT, given, clock=MonotonicClock())


@contextmanager
def movie() -> Iterator[NewCamera]:
    """A video file that begins anew at its end."""
    rng = np.random.default_rng(4)
    with TemporaryDirectory() as folder:
        path = str(Path(folder) / "noise.avi")
        writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (160, 120))
        for _ in range(30):
            writer.write(rng.integers(0, 256, (120, 160, 3), dtype=np.uint8))
        writer.release()
        given = OpenCvCameraConfig(kind="opencv", source=path, loop=True)
        yield lambda: build_camera(Role.WIDE, given, clock=MonotonicClock())


@contextmanager
def network_stream() -> Iterator[NewCamera]:
    """MJPEG over loopback."""
    with MjpegServer() as sender:
        given = OpenCvCameraConfig(kind="opencv", source=sender.url)
        yield lambda: build_camera(Role.WIDE, given, clock=MonotonicClock())


@contextmanager
def recording() -> Iterator[NewCamera]:
    """A recording that is played over and over."""
    yield lambda: replay_rig(MemoryRecording(frames=40)).wide


KINDS: dict[str, Kind] = {
    "scripted": scripted,
    "aravis": aravis,
    "aravis with our pictures": aravis_with_our_pictures,
    "pylon": pylon,
    "opencv movie": movie,
    "opencv stream": network_stream,
    "recording": recording,
}


def kinds_of(rig_file: str | None) -> dict[str, Kind]:
    """Return the cameras to run on: all that can be emulated, or those of a real rig."""
    if rig_file is None:
        return KINDS
    return {f"rig {role}": _of_rig(rig_file, role) for role in Role}


def _of_rig(rig_file: str, role: Role) -> Kind:
    @contextmanager
    def of_rig() -> Iterator[NewCamera]:
        config = load_rig_config(rig_file)
        yield lambda: open_rig(config).camera(role)

    return of_rig
