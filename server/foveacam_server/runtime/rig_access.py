"""A capture's way to the rig: every piece of its work goes through the hardware thread."""

from collections.abc import Callable
from typing import TypeVar

from foveacam_hardware.contract import Clock, Head
from foveacam_pipeline.capture.run import CaptureRig
from foveacam_server.runtime.exclusive_head import answer_of
from foveacam_server.runtime.hardware import HardwareThread

T = TypeVar("T")

LONGEST_S = 120.0
"""Of one piece of work: an exposure of 10 s, tried three times, and its readout."""


class ThreadAccess:
    """Implements the pipeline's `RigAccess` for the holder of a session."""

    def __init__(self, hardware: HardwareThread, head: Head, *, clock: Clock) -> None:
        self._hardware = hardware
        self._head = head
        self._clock = clock

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        return self._clock

    @property
    def head(self) -> Head:
        """Looks of the session."""
        return self._head

    def check_may_move(self) -> None:
        """Raise `Stopped` or `NotConnected` when nothing may move now."""
        self._hardware.check_may_move()

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that steers and exposes; a stop that comes meanwhile is followed by another park."""
        return answer_of(self._hardware.shoot(work), asked="an exposure", within_s=LONGEST_S)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that moves no mirror."""
        return answer_of(self._hardware.submit(work), asked="its settings", within_s=LONGEST_S)
