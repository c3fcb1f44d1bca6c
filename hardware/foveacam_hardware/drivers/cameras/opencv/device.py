"""UVC cameras, network streams, video files and image sequences through OpenCV, as a `CameraDevice`.

A live source is read continuously and delivers its newest image; a file is played at its rate, or one image
per software trigger. None of them has a trigger input, so such a camera can be the wide one but not a fovea.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Binning,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceInfo,
    Image,
    NotConnected,
    OutOfRange,
    PixelFormat,
)
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.opencv.half_size import HalfSize
from foveacam_hardware.drivers.cameras.opencv.settings import (
    SourceCapabilities,
    check_settings,
    ranges_of,
    read_back,
    read_capabilities,
    write_settings,
)
from foveacam_hardware.drivers.cameras.opencv.source import (
    FramePump,
    OpenCvCapture,
    Source,
    SourceKind,
    kind_of,
    open_capture,
    shown,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenCvOptions:
    """Rig file options: image size (None: the source's own), and whether a file restarts at its end."""

    width: int | None = None
    height: int | None = None
    loop: bool = False


class OpenCvDevice:
    """One source; one thread makes every call. Settings of zero leave the source's own values."""

    def __init__(
        self,
        source: Source,
        *,
        clock: Clock,
        options: OpenCvOptions | None = None,
        opener: Callable[[Source], OpenCvCapture] = open_capture,
    ) -> None:
        self._source = source
        self._kind = kind_of(source)
        self._label = f"opencv source {shown(source)}"
        self._clock = clock
        self._options = options or OpenCvOptions()
        self._opener = opener
        self._capture: OpenCvCapture | None = None
        self._pump: FramePump | None = None
        self._half_size: HalfSize | None = None
        self._can = SourceCapabilities(kind=self._kind, own_rate_hz=0.0, sets_exposure=False)
        self._settings: CameraSettings | None = None
        self._started = False
        self._due_ns = 0
        self._played = 0
        self._not_before_ns = 0
        self._triggers = 0
        self._underruns_before = 0

    def open(self) -> DeviceInfo:
        """Open the source and check its image size."""
        self.close()
        capture = self._opener(self._source)
        self._capture = capture
        self._played = 0
        try:
            self._choose_size(capture)
        except OutOfRange:
            self.close()
            raise
        self._can = read_capabilities(capture, self._kind)
        self._half_size = HalfSize(capture, label=self._label) if self._kind is SourceKind.DEVICE else None
        if self._kind is SourceKind.STREAM:  # read at once, so that no old image stays buffered
            self._pump = FramePump(capture, clock=self._clock)
        return DeviceInfo(
            vendor="OpenCV", model=str(self._kind), serial=shown(self._source), version=cv2.__version__
        )

    def close(self) -> None:
        """Release the source; do nothing when it is closed or gone."""
        self._started = False
        free = self._stop_pump()
        capture, self._capture = self._capture, None
        if capture is not None and free:
            capture.release()

    def ranges(self) -> CameraRanges:
        """Return the accepted values of every setting; one that cannot be set has a single value."""
        self._open_capture()
        return ranges_of(self._can)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return those in force."""
        capture = self._open_capture()
        check_settings(settings, self._can, label=self._label)
        own_binning: Binning = 1 if self._half_size is None else self._half_size.apply(settings.binning)
        self._settings = write_settings(capture, replace(settings, binning=own_binning), self._can)
        return self._settings

    def read_settings(self) -> CameraSettings:
        """Return the settings in force; V4L2 allows this while another thread reads images."""
        if self._settings is not None:
            self._settings = read_back(self._open_capture(), self._settings, self._can)
            return self._settings
        raise NotConnected(f"{self._label}: it was not configured; configure it first")

    def start(self) -> None:
        """Start delivering: live sources from now on, files from their current position."""
        capture = self._open_capture()
        if self._kind is SourceKind.DEVICE and self._pump is None:
            self._pump = FramePump(capture, clock=self._clock)
        self._started = True
        self._triggers = 0
        self._due_ns = self._not_before_ns = self._clock.now_ns()
        self._underruns_before = 0 if self._pump is None else self._pump.overwritten

    def stop(self) -> None:
        """Stop delivering; a file keeps its position."""
        self._started = False
        if self._kind is SourceKind.DEVICE and not self._stop_pump():
            self._capture = None
            raise NotConnected(f"{self._label}: it began a frame and does not finish it; plug it in anew")

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next image, None when none arrived in time; raise `NotConnected` at the source's end."""
        capture = self._open_capture()
        if self._pump is not None:
            return self._newest(self._pump, timeout_ms)
        return self._play(capture, timeout_ms)

    def software_trigger(self) -> None:
        """Let one image through: the next one of a file, the next to arrive of a live source."""
        self._open_capture()
        self._triggers += 1
        self._not_before_ns = self._clock.now_ns()

    def alive(self) -> bool:
        """Return whether the source is open and has not ended."""
        return self._capture is not None and (self._pump is None or not self._pump.ended)

    def underruns(self) -> int:
        """Return the number of live images since `start` that were overwritten unread."""
        return 0 if self._pump is None else self._pump.overwritten - self._underruns_before

    # Live sources ------------------------------------------------------------------------------------------

    def _newest(self, pump: FramePump, timeout_ms: float) -> Grab | None:
        until_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while (left_ns := until_ns - self._clock.now_ns()) >= 0:
            found = pump.take_newest(timeout_s=left_ns / 1e9)
            if found is None:
                break
            image, t_ns = found
            if self._started and t_ns >= self._not_before_ns and self._use_trigger():
                return self._grab(image, number=None, t_ns=t_ns)
        if pump.ended:
            raise NotConnected(f"{self._label}: {_GONE[self._kind]}; it is opened again by itself")
        return None

    def _stop_pump(self) -> bool:
        """Stop the pump; return whether the capture is free."""
        pump, self._pump = self._pump, None
        return pump is None or pump.close()

    # Files -------------------------------------------------------------------------------------------------

    def _play(self, capture: OpenCvCapture, timeout_ms: float) -> Grab | None:
        """Return the next image of a file when it is due."""
        until_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        due_ns = max(0 if self._triggered else self._due_ns, self._clock.now_ns())
        if not self._started or due_ns > until_ns or not self._use_trigger():
            self._clock.sleep_until_ns(until_ns)
            return None
        self._clock.sleep_until_ns(due_ns)
        image = self._next_image(capture)
        self._due_ns = due_ns + round(1e9 / self._rate_hz())
        self._played += 1
        return self._grab(image, number=self._played, t_ns=self._clock.now_ns())

    def _next_image(self, capture: OpenCvCapture) -> NDArray[np.uint8]:
        there, image = capture.read()
        if not there and self._options.loop and self._played > 0:
            capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
            there, image = capture.read()
        if there and image is not None:
            return image
        raise NotConnected(
            f"{self._label}: it ended after {self._played} pictures; write loop = true in the rig file to"
            " begin anew at once"
        )

    # All sources -------------------------------------------------------------------------------------------

    def _use_trigger(self) -> bool:
        """Return whether an image may be delivered; use up a pending trigger when triggers are required."""
        if not self._triggered:
            return True
        if self._triggers == 0:
            return False
        self._triggers -= 1
        return True

    @property
    def _triggered(self) -> bool:
        """Whether each image needs a trigger."""
        return self._settings is not None and self._settings.triggered

    def _rate_hz(self) -> float:
        return self._can.own_rate_hz if self._settings is None else self._settings.frame_rate_hz

    def _grab(self, image: NDArray[np.uint8], *, number: int | None, t_ns: int) -> Grab:
        grey = self._settings is None or self._settings.pixel_format is PixelFormat.MONO8
        converted = _convert(image, grey=grey)
        return Grab(
            status=GrabStatus.INCOMPLETE if converted is None else GrabStatus.OK,
            image=converted,
            bits=8,
            number=number,
            t_device_ns=None,
            t_host_ns=t_ns,
        )

    def _open_capture(self) -> OpenCvCapture:
        if self._capture is None:
            raise NotConnected(f"{self._label}: it is not open; connect it first")
        return self._capture

    def _choose_size(self, capture: OpenCvCapture) -> None:
        requested = {
            "width_px": (cv2.CAP_PROP_FRAME_WIDTH, self._options.width),
            "height_px": (cv2.CAP_PROP_FRAME_HEIGHT, self._options.height),
        }
        if self._kind is SourceKind.DEVICE:
            for prop, size in requested.values():
                capture.set(prop, size or capture.get(prop))
        for name, (prop, size) in requested.items():
            found = round(capture.get(prop))
            if size is not None and found != size:
                raise OutOfRange(
                    f"{self._label}: asked for {name} = {size}, and its pictures have {found}; write that, or"
                    " leave it out"
                )


_GONE = {
    SourceKind.DEVICE: "it gives no pictures any more; plug it in",
    SourceKind.STREAM: "its sender has stopped",
}


def _convert(image: NDArray[np.uint8], *, grey: bool) -> Image | None:
    """Return the image as grey or RGB; None when its pixels are not eight-bit."""
    if image.size == 0 or image.dtype != np.uint8:
        return None
    if image.ndim == 2:
        return image if grey else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)
    code = cv2.COLOR_BGR2GRAY if grey else cv2.COLOR_BGR2RGB
    return np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)
