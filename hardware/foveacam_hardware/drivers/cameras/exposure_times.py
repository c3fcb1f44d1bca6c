"""When a frame was exposed, on the host's clock: by the camera's clock, or by its arrival."""

from foveacam_hardware.drivers.cameras.clock import CameraClock
from foveacam_hardware.drivers.cameras.device import ClockReading, Grab

READINGS_NS = 1_000_000_000
"""How often the camera's clock is read, where it can be."""


class ExposureTimes:
    """Times of one opening of a camera.

    Without readings of its clock, the frame that travelled fastest is taken to have arrived when its readout
    ended: a wrong `readout_ns` and the way through the cable, which nobody tells, are then the error.
    """

    def __init__(self, *, readout_ns: int = 0) -> None:
        self._clock = CameraClock()
        self._readout_ns = readout_ns
        self._least_ns: int | None = None
        self._last_device_ns: int | None = None
        self._read_ns: int | None = None
        self._readable = True

    def reading_due(self, now_ns: int) -> bool:
        """Tell whether the camera's clock should be read again."""
        if not self._readable:
            return False
        return self._read_ns is None or now_ns - self._read_ns >= READINGS_NS

    def read(self, reading: ClockReading | None) -> None:
        """Take a reading of the camera's clock (None: it has none); long round trips hardly count."""
        if reading is None:
            self._readable = False
            return
        took_ns = reading.t_after_ns - reading.t_before_ns
        if self._read_ns is None:
            self._clock.forget()
        self._read_ns = reading.t_after_ns
        self._least_ns = took_ns if self._least_ns is None else min(took_ns, self._least_ns)
        # The register was read somewhere in between: at the earliest of these moments with the quickest trip.
        self._clock.observe(reading.t_device_ns, reading.t_before_ns + took_ns - self._least_ns // 2)

    def middle_ns(self, grab: Grab, *, exposure_ns: int) -> int:
        """Return the middle of a frame's exposure."""
        after_ns = exposure_ns + self._readout_ns
        if grab.t_device_ns is None:
            return grab.t_host_ns - after_ns + exposure_ns // 2
        if self._last_device_ns is not None and grab.t_device_ns < self._last_device_ns:
            self._clock.forget()
            self._read_ns = None
        self._last_device_ns = grab.t_device_ns
        if self._read_ns is None:
            self._clock.observe(grab.t_device_ns, grab.t_host_ns - after_ns)
        # No exposure lies in the future, whatever the clocks say.
        start_ns = min(self._clock.host_ns(grab.t_device_ns), grab.t_host_ns - exposure_ns)
        return start_ns + exposure_ns // 2
