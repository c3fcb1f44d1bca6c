"""Reads a live capture all the time, so that what it gives is never old; the newest picture wins."""

import threading

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock
from foveacam_hardware.drivers.cameras.opencv_source import OpenCvCapture

JOIN_S = 2.0
"""How long a read that is under way is waited for; later, its thread lets the capture go by itself."""


class FramePump:
    """A thread that owns a capture until it is closed."""

    def __init__(self, capture: OpenCvCapture, *, clock: Clock) -> None:
        self._capture = capture
        self._clock = clock
        self._changed = threading.Condition()
        self._newest: tuple[NDArray[np.uint8], int] | None = None
        self._closing = False
        self._orphaned = False
        self.ended = False
        """Whether the capture has given its last picture."""
        self.overwritten = 0
        """Pictures that came before the one before them was taken."""
        self._thread = threading.Thread(target=self._run, name="opencv-pump", daemon=True)
        self._thread.start()

    def take(self, *, timeout_s: float) -> tuple[NDArray[np.uint8], int] | None:
        """Return the newest picture not yet taken and when it came, ns; None when none came in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self.ended, timeout_s)
            newest, self._newest = self._newest, None
            return newest

    def close(self) -> bool:
        """End the thread; tell whether the capture is free: else the thread lets it go by itself, later."""
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
