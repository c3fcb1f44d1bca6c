"""Pictures through OpenCV behind the seam `CameraDevice`: UVC cameras, streams, video files, image sequences.

A live source is read all the time and gives its newest picture; a file is played at its rate, or a picture a
software trigger. None of them hears a pulse, so such a camera can look on but not be a steered eye.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
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
from foveacam_hardware.drivers.cameras.opencv.settings import (
    SourceCapabilities,
    abilities_of,
    check,
    ranges_of,
    read_back,
    write,
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
    """What else a rig file says: the size of pictures (None: as they come), whether a file begins anew."""

    width: int | None = None
    height: int | None = None
    loop: bool = False


class OpenCvDevice:
    """One source; one thread makes every call. `settings` of zero leave the source's own."""

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
        self._who = f"opencv source {shown(source)}"
        self._clock = clock
        self._options = options or OpenCvOptions()
        self._opener = opener
        self._capture: OpenCvCapture | None = None
        self._pump: FramePump | None = None
        self._can = SourceCapabilities(kind=self._kind, own_rate_hz=0.0, sets_exposure=False)
        self._taken: CameraSettings | None = None
        self._started = False
        self._due_ns = 0
        self._played = 0
        self._not_before_ns = 0
        self._triggers = 0
        self._underruns_before = 0

    def open(self) -> DeviceInfo:
        """Open the source and check the size of its pictures."""
        self.close()
        capture = self._opener(self._source)
        self._capture = capture
        self._played = 0
        try:
            self._choose_size(capture)
        except OutOfRange:
            self.close()
            raise
        self._can = abilities_of(capture, self._kind)
        if self._kind is SourceKind.STREAM:  # from now on, so that nothing old waits in it
            self._pump = FramePump(capture, clock=self._clock)
        return DeviceInfo(
            vendor="OpenCV", model=str(self._kind), serial=shown(self._source), version=cv2.__version__
        )

    def close(self) -> None:
        """Let go; harmless when closed or gone."""
        self._started = False
        free = self._stop_pump()
        capture, self._capture = self._capture, None
        if capture is not None and free:
            capture.release()

    def ranges(self) -> CameraRanges:
        """Return what it accepts; what cannot be set has one value."""
        self._opened()
        return ranges_of(self._can)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return what it took."""
        capture = self._opened()
        check(settings, self._can, who=self._who)
        self._taken = write(capture, settings, self._can)
        return self._taken

    def read_settings(self) -> CameraSettings:
        """Return what is in force; V4L2 tells it past the pictures that another thread reads."""
        if self._taken is not None:
            self._taken = read_back(self._opened(), self._taken, self._can)
            return self._taken
        raise NotConnected(f"{self._who}: it was not configured; configure it first")

    def start(self) -> None:
        """Begin to deliver: live sources from now on, files from where they were."""
        capture = self._opened()
        if self._kind is SourceKind.DEVICE and self._pump is None:
            self._pump = FramePump(capture, clock=self._clock)
        self._started = True
        self._triggers = 0
        self._due_ns = self._not_before_ns = self._clock.now_ns()
        self._underruns_before = 0 if self._pump is None else self._pump.overwritten

    def stop(self) -> None:
        """Stop delivering; a file stays where it is."""
        self._started = False
        if self._kind is SourceKind.DEVICE and not self._stop_pump():
            self._capture = None
            raise NotConnected(f"{self._who}: it does not end a frame that it began; plug it in anew")

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next picture, or None when none came in time; raise `NotConnected` at its end."""
        capture = self._opened()
        if self._pump is not None:
            return self._newest(self._pump, timeout_ms)
        return self._play(capture, timeout_ms)

    def software_trigger(self) -> None:
        """Let one picture through: of a file the next, of a live source the next that comes."""
        self._opened()
        self._triggers += 1
        self._not_before_ns = self._clock.now_ns()

    def alive(self) -> bool:
        """Return whether there is a source that has not ended."""
        return self._capture is not None and (self._pump is None or not self._pump.ended)

    def underruns(self) -> int:
        """Return how many live pictures nobody took, since `start`."""
        return 0 if self._pump is None else self._pump.overwritten - self._underruns_before

    # Live --------------------------------------------------------------------------------------------------

    def _newest(self, pump: FramePump, timeout_ms: float) -> Grab | None:
        until_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while (left_ns := until_ns - self._clock.now_ns()) >= 0:
            found = pump.take(timeout_s=left_ns / 1e9)
            if found is None:
                break
            image, t_ns = found
            if self._started and t_ns >= self._not_before_ns and self._wanted():
                return self._grab(image, number=None, t_ns=t_ns)
        if pump.ended:
            raise NotConnected(f"{self._who}: {_GONE[self._kind]}; it is opened again by itself")
        return None

    def _stop_pump(self) -> bool:
        """Return whether the capture is free."""
        pump, self._pump = self._pump, None
        return pump is None or pump.close()

    # Files -------------------------------------------------------------------------------------------------

    def _play(self, capture: OpenCvCapture, timeout_ms: float) -> Grab | None:
        """Return the next picture when its time has come."""
        until_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        due_ns = max(0 if self._waits else self._due_ns, self._clock.now_ns())
        if not self._started or due_ns > until_ns or not self._wanted():
            self._clock.sleep_until_ns(until_ns)
            return None
        self._clock.sleep_until_ns(due_ns)
        image = self._next_picture(capture)
        self._due_ns = due_ns + round(1e9 / self._rate_hz())
        self._played += 1
        return self._grab(image, number=self._played, t_ns=self._clock.now_ns())

    def _next_picture(self, capture: OpenCvCapture) -> NDArray[np.uint8]:
        there, image = capture.read()
        if not there and self._options.loop and self._played > 0:
            capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
            there, image = capture.read()
        if there and image is not None:
            return image
        raise NotConnected(
            f"{self._who}: it ended after {self._played} pictures; write loop = true in the rig file to begin"
            " anew at once"
        )

    # Both --------------------------------------------------------------------------------------------------

    def _wanted(self) -> bool:
        """Return whether a picture may go out; take note of the trigger that lets it."""
        if not self._waits:
            return True
        if self._triggers == 0:
            return False
        self._triggers -= 1
        return True

    @property
    def _waits(self) -> bool:
        """Whether each picture has a trigger of its own."""
        return self._taken is not None and self._taken.triggered

    def _rate_hz(self) -> float:
        return self._can.own_rate_hz if self._taken is None else self._taken.frame_rate_hz

    def _grab(self, image: NDArray[np.uint8], *, number: int | None, t_ns: int) -> Grab:
        grey = self._taken is None or self._taken.pixel_format is PixelFormat.MONO8
        picture = _picture(image, grey=grey)
        return Grab(
            status=GrabStatus.INCOMPLETE if picture is None else GrabStatus.OK,
            image=picture,
            bits=8,
            number=number,
            t_device_ns=None,
            t_host_ns=t_ns,
        )

    def _opened(self) -> OpenCvCapture:
        if self._capture is None:
            raise NotConnected(f"{self._who}: it is not open; connect it first")
        return self._capture

    def _choose_size(self, capture: OpenCvCapture) -> None:
        wished = {
            "width_px": (cv2.CAP_PROP_FRAME_WIDTH, self._options.width),
            "height_px": (cv2.CAP_PROP_FRAME_HEIGHT, self._options.height),
        }
        if self._kind is SourceKind.DEVICE:
            for prop, size in wished.values():
                capture.set(prop, size or capture.get(prop))
        for name, (prop, size) in wished.items():
            found = round(capture.get(prop))
            if size is not None and found != size:
                raise OutOfRange(
                    f"{self._who}: asked for {name} = {size}, and its pictures have {found}; write that, or"
                    " leave it out"
                )


_GONE = {
    SourceKind.DEVICE: "it gives no pictures any more; plug it in",
    SourceKind.STREAM: "its sender has stopped",
}


def _picture(image: NDArray[np.uint8], *, grey: bool) -> Image | None:
    """Return a picture in the format asked for; None for what has no eight-bit pixels."""
    if image.size == 0 or image.dtype != np.uint8:
        return None
    if image.ndim == 2:
        return image if grey else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)
    code = cv2.COLOR_BGR2GRAY if grey else cv2.COLOR_BGR2RGB
    return np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)
