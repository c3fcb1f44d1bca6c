"""The controller's far end in the same process, on simulated time: the fastest host there is.

A write runs the far end until it has nothing left to do, moving the clock from event to event, so a
whole session takes no time and always runs the same way. The driver's reader thread works as ever.
"""

import threading

from foveacam_hardware.contract import Clock, NotConnected
from foveacam_hardware.sim.controller_far_end import ControllerFarEnd


class LoopbackLink:
    """A `Link` to a far end in this process. A new one is what opening the port again is."""

    def __init__(self, far_end: ControllerFarEnd, clock: Clock) -> None:
        self._far_end = far_end
        self._clock = clock
        self._arrived = threading.Condition()
        self._inbox = bytearray()
        self._open = True
        self._check()

    def write(self, data: bytes) -> None:
        """Hand `data` to the far end, and let it finish."""
        with self._arrived:
            self._check()
            self._far_end.feed(data)
            while self._far_end.busy and (due_ns := self._far_end.next_event_ns()) is not None:
                self._clock.sleep_until_ns(due_ns)
                self._far_end.advance(due_ns)
            self._inbox += self._far_end.take()
            self._arrived.notify_all()

    def read(self, timeout_s: float) -> bytes:
        """Return what the far end has answered."""
        with self._arrived:
            if not self._inbox:
                self._arrived.wait(timeout_s)
            self._check()
            data = bytes(self._inbox)
            self._inbox.clear()
            return data

    def close(self) -> None:
        """Release the link."""
        with self._arrived:
            self._open = False
            self._arrived.notify_all()

    def _check(self) -> None:
        if self._far_end.unplugged or not self._open:
            raise NotConnected(
                "simulated controller: the link is gone; plug the controller in again and reconnect"
            )
