"""Reads a Basler camera's clock: a command takes the time, a feature tells it, by either family's names.

Readings are in nanoseconds, as the driver gives the times of frames.
"""

from foveacam_hardware.contract import Clock
from foveacam_hardware.drivers.cameras import pylon_nodes as nodes
from foveacam_hardware.drivers.cameras.device import ClockReading

LATCHES = (("TimestampLatch", "TimestampLatchValue"), ("GevTimestampControlLatch", "GevTimestampValue"))
"""The command and the value: of USB3 Vision cameras and newer ones, of older GigE Vision cameras."""


class PylonClock:
    """The clock of one open camera; `tick_ns`: what it counts in."""

    def __init__(self, map_: nodes.Nodes, *, clock: Clock, tick_ns: float) -> None:
        self._map = map_
        self._clock = clock
        self._tick_ns = tick_ns
        self._latch = next((latch for latch in LATCHES if _has(map_, latch)), None)

    def read(self) -> ClockReading | None:
        """Take the time and read it; None when the camera keeps none that can be read, or it stands at 0."""
        if self._latch is None:
            return None
        command, value = self._latch
        t_before_ns = self._clock.now_ns()
        self._map.GetNode(command).Execute()
        t_after_ns = self._clock.now_ns()
        told = self._map.GetNode(value)
        told.Node.InvalidateNode()  # the library remembers the time before
        ticks = int(told.GetValue())
        if ticks == 0:
            return None
        t_device_ns = round(ticks * self._tick_ns)
        return ClockReading(t_device_ns=t_device_ns, t_before_ns=t_before_ns, t_after_ns=t_after_ns)


def _has(map_: nodes.Nodes, latch: tuple[str, str]) -> bool:
    command, value = latch
    return nodes.can_execute(map_, command) and nodes.find(map_, (value,)) is not None
