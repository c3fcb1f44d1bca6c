"""Reads the clock of a GenICam camera through its latch feature or the registers of GigE Vision.

Readings are in nanoseconds, like libaravis' buffer timestamps.
"""

from typing import Protocol

from foveacam_hardware.contract import Clock
from foveacam_hardware.drivers.cameras.device import ClockReading

LATCH, LATCHED_HIGH, LATCHED_LOW = 0x0944, 0x0948, 0x094C
TICKS_HIGH, TICKS_LOW = 0x093C, 0x0940
"""GigE Vision bootstrap registers: latch command, latched time, ticks per second."""
LATCH_NOW = 2
LATCH_FEATURE, LATCHED_FEATURE = "TimestampLatch", "TimestampLatchValue"
"""Standard feature names (SFNC); USB3 Vision cameras have them, in nanoseconds."""


class ClockAccess(Protocol):
    """Access to the features and registers of an open camera."""

    @property
    def has_registers(self) -> bool:
        """Whether it is a GigE Vision camera."""
        ...

    def has(self, feature: str) -> bool:
        """Return whether the camera has a feature."""
        ...

    def execute(self, command: str) -> None:
        """Execute a command feature."""
        ...

    def integer(self, feature: str) -> int:
        """Return the value of an integer feature."""
        ...

    def read_register(self, address: int) -> int:
        """Return a 32-bit register."""
        ...

    def write_register(self, address: int, value: int) -> None:
        """Write a 32-bit register."""
        ...


class AravisClock:
    """The clock of one open camera."""

    def __init__(self, camera: ClockAccess, *, clock: Clock) -> None:
        self._camera = camera
        self._clock = clock
        self._latches = camera.has(LATCH_FEATURE) and camera.has(LATCHED_FEATURE)
        self._tick_ns = 0.0
        if not self._latches and camera.has_registers:
            per_s = camera.read_register(TICKS_HIGH) << 32 | camera.read_register(TICKS_LOW)
            self._tick_ns = 1e9 / per_s if per_s else 0.0

    def read(self) -> ClockReading | None:
        """Latch the clock and read it; None when the camera has no readable clock."""
        if self._latches:
            return self._reading(*self._latch_feature())
        if self._tick_ns == 0.0:
            return None
        return self._reading(*self._latch_registers())

    def _latch_feature(self) -> tuple[int, int, int]:
        t_before_ns = self._clock.now_ns()
        self._camera.execute(LATCH_FEATURE)
        t_after_ns = self._clock.now_ns()
        return self._camera.integer(LATCHED_FEATURE), t_before_ns, t_after_ns

    def _latch_registers(self) -> tuple[int, int, int]:
        t_before_ns = self._clock.now_ns()
        self._camera.write_register(LATCH, LATCH_NOW)
        t_after_ns = self._clock.now_ns()
        ticks = self._camera.read_register(LATCHED_HIGH) << 32 | self._camera.read_register(LATCHED_LOW)
        return round(ticks * self._tick_ns), t_before_ns, t_after_ns

    def _reading(self, t_device_ns: int, t_before_ns: int, t_after_ns: int) -> ClockReading | None:
        if t_device_ns == 0:
            return None
        return ClockReading(t_device_ns=t_device_ns, t_before_ns=t_before_ns, t_after_ns=t_after_ns)
