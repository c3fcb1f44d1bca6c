"""The driver of UVC cameras on a stand-in for one: settings, automatic modes, unplugging."""

import threading
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import AutoMode, CameraSettings, MonotonicClock, NotConnected, OutOfRange
from foveacam_hardware.drivers.cameras.device import GrabStatus
from foveacam_hardware.drivers.cameras.host_binning import average_2x2
from foveacam_hardware.drivers.cameras.opencv.device import OpenCvDevice

AS_IT_IS = CameraSettings(exposure_ns=0, frame_rate_hz=0.0)
AUTOMATIC = replace(AS_IT_IS, exposure_auto=AutoMode.CONTINUOUS, frame_rate_auto=True)
AUTO = cv2.CAP_PROP_AUTO_EXPOSURE


class FakeUvc:
    """A UVC camera as OpenCV shows it: it rounds, keeps to its sizes, and blocks until a picture is there."""

    def __init__(self) -> None:
        self.props = {
            cv2.CAP_PROP_FPS: 30.0,
            cv2.CAP_PROP_EXPOSURE: 156.0,
            AUTO: 3.0,
            cv2.CAP_PROP_FRAME_WIDTH: 640.0,
            cv2.CAP_PROP_FRAME_HEIGHT: 480.0,
        }
        self.pictures = threading.Semaphore(0)
        self.refuses: set[int] = set()
        self.unplugged = False
        self.released = False
        self.scene: NDArray[np.uint8] | None = None
        """What it sees at 640x480; None: nothing but grey."""
        self.halves_by = "mean"
        """What it makes its half size of: "mean", "crop", or "skip" (every second pixel)."""

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        return not self.released

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        self.pictures.acquire(timeout=10.0)
        if self.unplugged:
            return False, None
        return True, np.full((480, 640, 3), 50, dtype=np.uint8) if self.scene is None else self._picture(
            self.scene
        )

    def _picture(self, scene: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self.props[cv2.CAP_PROP_FRAME_WIDTH] == 640.0:
            return scene
        if self.halves_by == "crop":
            return scene[120:360, 160:480]
        return scene[::2, ::2] if self.halves_by == "skip" else np.asarray(average_2x2(scene), dtype=np.uint8)

    def get(self, prop: int, /) -> float:
        return self.props.get(prop, -1.0)

    def set(self, prop: int, value: float, /) -> bool:
        if prop in self.refuses:
            return False
        if prop == cv2.CAP_PROP_FPS:
            value = 15.0 if value < 20.0 else 30.0
        self.props[prop] = value
        return True

    def release(self) -> None:
        self.released = True


def uvc() -> tuple[FakeUvc, OpenCvDevice]:
    camera = FakeUvc()
    device = OpenCvDevice(0, clock=MonotonicClock(), opener=lambda _: camera)
    device.open()
    return camera, device


def test_a_uvc_camera_takes_exposure_and_rate_in_its_own_steps() -> None:
    camera, device = uvc()
    taken = device.configure(replace(AS_IT_IS, exposure_ns=8_040_000, frame_rate_hz=18.0))

    assert (taken.exposure_ns, taken.frame_rate_hz) == (8_000_000, 15.0)
    assert camera.props[AUTO] == 1.0
    assert device.configure(AS_IT_IS).exposure_ns == 8_000_000
    device.close()
    assert camera.released


def test_a_uvc_camera_exposes_by_itself_and_says_how_long() -> None:
    camera, device = uvc()
    taken = device.configure(AUTOMATIC)
    camera.props[cv2.CAP_PROP_EXPOSURE] = 312.0

    assert device.ranges().exposure_autos == (AutoMode.OFF, AutoMode.CONTINUOUS)
    assert taken.exposure_auto is AutoMode.CONTINUOUS
    assert camera.props[AUTO] == 3.0
    assert device.read_settings().exposure_ns == 31_200_000
    assert device.configure(replace(AS_IT_IS, exposure_ns=8_000_000)).exposure_auto is AutoMode.OFF
    with pytest.raises(OutOfRange, match="automatic exposure, once, is not one of its own; use off, cont"):
        device.configure(replace(AUTOMATIC, exposure_auto=AutoMode.ONCE))
    device.close()


def test_a_uvc_camera_goes_back_to_the_rate_that_it_had() -> None:
    _, device = uvc()
    slow = device.configure(replace(AS_IT_IS, frame_rate_hz=15.0))
    own = device.configure(AUTOMATIC)

    assert (slow.frame_rate_hz, slow.frame_rate_auto) == (15.0, False)
    assert (own.frame_rate_hz, own.frame_rate_auto) == (30.0, True)
    device.close()


@pytest.mark.parametrize("lacking", [(cv2.CAP_PROP_EXPOSURE, AUTO), (AUTO,)], ids=["exposure", "mode"])
def test_a_uvc_camera_that_lacks_something_begins_all_the_same_and_has_no_mode(
    lacking: tuple[int, ...],
) -> None:
    camera = FakeUvc()
    for prop in lacking:
        del camera.props[prop]
        camera.refuses.add(prop)
    device = OpenCvDevice(0, clock=MonotonicClock(), opener=lambda _: camera)
    device.open()

    assert device.configure(AUTOMATIC).exposure_auto is AutoMode.OFF
    assert device.ranges().exposure_autos == (AutoMode.OFF,)
    device.close()


def test_pictures_of_a_uvc_camera_that_nobody_took_are_counted() -> None:
    camera, device = uvc()
    device.configure(AS_IT_IS)
    device.start()
    camera.pictures.release(3)
    while device.underruns() < 2:
        pass

    taken = device.grab(timeout_ms=4000.0)
    assert taken is not None
    assert taken.status is GrabStatus.OK
    assert device.grab(timeout_ms=10.0) is None
    camera.pictures.release(1)
    device.close()


def test_an_unplugged_uvc_camera_is_lost_in_words() -> None:
    camera, device = uvc()
    device.configure(AS_IT_IS)
    device.start()
    camera.unplugged = True
    camera.pictures.release(1)
    with pytest.raises(NotConnected, match="no pictures any more; plug it in"):
        device.grab(timeout_ms=2000.0)
    device.close()


def textured() -> NDArray[np.uint8]:
    rng = np.random.default_rng(2)
    fine = cv2.GaussianBlur(rng.normal(128.0, 250.0, (480, 640, 3)).astype(np.float32), (0, 0), 2.0)
    return np.clip(fine, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("halves_by", "contrast", "binning"),
    [("mean", True, 2), ("crop", True, 1), ("skip", True, 1), ("mean", False, 1)],
)
def test_half_the_size_is_used_where_it_shows_that_it_is_the_mean(
    halves_by: str, contrast: bool, binning: int
) -> None:
    camera, device = uvc()
    camera.halves_by = halves_by
    camera.scene = textured() if contrast else np.full((480, 640, 3), 50, dtype=np.uint8)
    for _ in range(4):
        camera.pictures.release()
    taken = device.configure(replace(AS_IT_IS, binning=2))
    again = device.configure(replace(AS_IT_IS, binning=2))

    assert taken.binning == again.binning == binning
    assert camera.props[cv2.CAP_PROP_FRAME_WIDTH] == 640.0 / binning
    assert device.configure(AS_IT_IS).binning == 1
    assert camera.props[cv2.CAP_PROP_FRAME_WIDTH] == 640.0
    device.close()


def test_a_camera_without_half_its_size_is_averaged_by_the_host() -> None:
    camera, device = uvc()
    camera.refuses = {cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT}
    for _ in range(2):
        camera.pictures.release()

    assert device.configure(replace(AS_IT_IS, binning=2)).binning == 1
    assert camera.props[cv2.CAP_PROP_FRAME_WIDTH] == 640.0
    device.close()
