"""Access of captures and stills to the rig: all of their work goes through the hardware thread."""

from collections.abc import Callable
from typing import TypeVar

from foveacam_hardware.contract import Clock, Head
from foveacam_pipeline.capture.run import CaptureRig
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig

T = TypeVar("T")

LONGEST_S = 120.0
"""Timeout of one command: an exposure of 10 s, tried three times, with its readout."""


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
        """Raise `Stopped` or `NotConnected` when the mirrors cannot move now."""
        self._hardware.check_may_move()

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that steers and exposes; after a stop meanwhile the mirrors are parked again."""
        return answer_of(self._hardware.expose(work), asked="an exposure", within_s=LONGEST_S)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that moves no mirror."""
        return answer_of(self._hardware.submit(work), asked="its settings", within_s=LONGEST_S)


class StillRigAccess:
    """Implements the pipeline's `RigAccess` for a still, which exposes at the mirrors' present pose.

    Unlike a look it is allowed while a fovea is missing: the other cameras make a still.
    """

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
        """Raise `Stopped` while the stop is engaged or the mirrors are switched off."""
        check_may_expose(self._hardware)

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that exposes; after a stop meanwhile the mirrors are parked again."""

        def exposing(rig: AssembledRig) -> T:
            check_may_expose(self._hardware)
            try:
                return work(rig)
            finally:
                if self._hardware.halted:  # a pulse carries a position, and may have undone the parking
                    rig.mirrors.park()

        check_may_expose(self._hardware)
        return answer_of(self._hardware.submit(exposing), asked="an exposure", within_s=LONGEST_S)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that exposes nothing."""
        return answer_of(self._hardware.submit(work), asked="its settings", within_s=LONGEST_S)


def check_may_expose(hardware: HardwareThread) -> None:
    """Raise `Stopped` while the stop is engaged or the mirrors are off, as no pulse may be given then."""
    if hardware.halted:
        raise refusals.stopped()
    hardware.mirrors.check()
