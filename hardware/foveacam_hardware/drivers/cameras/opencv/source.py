"""Sources of images that OpenCV can read (UVC camera, network stream, video file, numbered images).

Opens a capture with a deadline for every read, or raises the reason; reads live captures in a thread.
"""

import re
import threading
from enum import StrEnum
from pathlib import Path
from typing import Protocol, TypeAlias, cast
from urllib.parse import urlsplit

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, NotConnected

Source: TypeAlias = str | int

OPEN_TIMEOUT_MS = 4000
READ_TIMEOUT_MS = 1000
"""How long a network stream may be silent before a read fails."""

JOIN_S = 2.0
"""Wait for a read in progress when closing; after that its thread releases the capture itself."""


class SourceKind(StrEnum):
    """Kind of an image source."""

    DEVICE = "UVC camera"
    STREAM = "network stream"
    MOVIE = "video file"
    IMAGES = "image sequence"


class OpenCvCapture(Protocol):
    """The part of `cv2.VideoCapture` that is used."""

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        """Return whether it can be read."""
        ...

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Return success and the next image, BGR or grey."""
        ...

    def get(self, prop: int, /) -> float:
        """Return a property; -1 or 0 when it does not exist."""
        ...

    def set(self, prop: int, value: float, /) -> bool:
        """Set a property; return whether it exists."""
        ...

    def release(self) -> None:
        """Release the source."""
        ...


def kind_of(source: Source) -> SourceKind:
    """Return the kind of a source, from its name alone."""
    if isinstance(source, int) or source.startswith("/dev/"):
        return SourceKind.DEVICE
    if "://" in source:
        return SourceKind.STREAM
    return SourceKind.IMAGES if re.search(r"%0?\d*d", source) else SourceKind.MOVIE


def shown(source: Source) -> str:
    """Return a source for display, without the password of an address."""
    if isinstance(source, int) or "@" not in source or "://" not in source:
        return str(source)
    parts = urlsplit(source)
    return parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()


def open_capture(source: Source) -> OpenCvCapture:
    """Open a source, with deadlines for network streams; raise `NotConnected` with the reason."""
    kind = kind_of(source)
    name = f"opencv source {shown(source)}"
    if kind is SourceKind.MOVIE and not Path(str(source)).is_file():
        raise NotConnected(f"{name}: there is no such file; correct its path in the rig file")
    capture = _capture(source, kind)
    if not capture.isOpened():
        capture.release()
        raise NotConnected(f"{name}: {_WHY_NOT[kind]}")
    return capture


def _capture(source: Source, kind: SourceKind) -> OpenCvCapture:
    deadlines: list[int] = []
    if kind is SourceKind.STREAM:
        deadlines = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_TIMEOUT_MS]
        deadlines += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, READ_TIMEOUT_MS]
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)  # the reason is given in our own message
    capture = cv2.VideoCapture(source, _BACKENDS[kind], deadlines)
    return cast(OpenCvCapture, capture)  # OpenCV's types also allow images on a graphics card


_BACKENDS = {
    SourceKind.DEVICE: cv2.CAP_V4L2,
    SourceKind.IMAGES: cv2.CAP_IMAGES,
    SourceKind.MOVIE: cv2.CAP_FFMPEG,
    SourceKind.STREAM: cv2.CAP_FFMPEG,
}
_WHY_NOT = {
    SourceKind.DEVICE: "it cannot be opened; plug it in, close the program that holds it, and see that you"
    " are in the group 'video'",
    SourceKind.STREAM: "no video stream answers there; switch the sender on, or correct the address",
    SourceKind.MOVIE: "it is no video that can be read; convert it, for example to MJPEG in AVI",
    SourceKind.IMAGES: "there is no first image of that name; number them from 0 or 1, as shots/%04d.png",
}


class FramePump:
    """Reads a live capture continuously in its own thread and keeps only the newest image."""

    def __init__(self, capture: OpenCvCapture, *, clock: Clock) -> None:
        self._capture = capture
        self._clock = clock
        self._changed = threading.Condition()
        self._newest: tuple[NDArray[np.uint8], int] | None = None
        self._closing = False
        self._orphaned = False
        self.ended = False
        """Whether the capture has delivered its last image."""
        self.overwritten = 0
        """Number of images that replaced one not yet taken."""
        self._thread = threading.Thread(target=self._run, name="opencv-pump", daemon=True)
        self._thread.start()

    def take_newest(self, *, timeout_s: float) -> tuple[NDArray[np.uint8], int] | None:
        """Return the newest image not yet taken and its arrival time, ns; None when none arrived in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self.ended, timeout_s)
            newest, self._newest = self._newest, None
            return newest

    def close(self) -> bool:
        """End the thread; return whether the capture is free, else the thread releases it later."""
        self._closing = True
        self._thread.join(JOIN_S)
        with self._changed:
            self._orphaned = self._thread.is_alive()
            return not self._orphaned

    def _run(self) -> None:
        while not self._closing and self._read_one():
            pass
        with self._changed:
            if self._orphaned:
                self._capture.release()

    def _read_one(self) -> bool:
        there, image = self._capture.read()
        t_ns = self._clock.now_ns()
        with self._changed:
            if there and image is not None:
                self.overwritten += self._newest is not None
                self._newest = image, t_ns
            else:
                self.ended = True
            self._changed.notify_all()
        return not self.ended
