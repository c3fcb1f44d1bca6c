"""Exposure times of frames on the host's clock, from the camera's clock where it has one, else from arrival.

The smallest latency gives the offset between the clocks, the lower envelope of all latencies the drift. Pure
computation: reading a clock is left to the devices.
"""

from collections import deque
from itertools import pairwise

from foveacam_hardware.drivers.cameras.device import ClockReading, Grab

BUCKET_NS = 1_000_000_000
BUCKETS = 64
"""Seconds remembered, with one pair each: the one with the smallest latency."""
LARGEST_DRIFT = 200e-6
"""Largest drift between two quartz clocks; a steeper line is noise of the first seconds."""

READINGS_NS = 1_000_000_000
"""Period of reading the camera's clock, where it can be read."""

Pair = tuple[int, int]
"""A time on the camera's clock, and the host's time minus it, ns."""


class CameraClock:
    """Maps the camera's time to the host's from pairs whose host time may be late but never early."""

    def __init__(self) -> None:
        self._minima: deque[Pair] = deque(maxlen=BUCKETS)
        self._origin: Pair = (0, 0)
        self._drift = 0.0

    def reset(self) -> None:
        """Discard all pairs: the camera's clock was reset."""
        self._minima.clear()
        self._drift = 0.0

    def observe(self, t_device_ns: int, t_host_ns: int) -> None:
        """Add a pair: the camera's time of an event, and the host's time of learning of it."""
        pair = (t_device_ns, t_host_ns - t_device_ns)
        if not self._minima:
            self._minima.append(pair)
            self._origin = pair
        elif t_device_ns // BUCKET_NS != self._minima[-1][0] // BUCKET_NS:
            self._fit()
            self._minima.append(pair)
            self._lower(pair)
        elif pair[1] < self._minima[-1][1]:
            self._minima[-1] = pair
            self._lower(pair)

    def host_ns(self, t_device_ns: int) -> int:
        """Return the host's time of a camera time, with zero latency."""
        since_ns = t_device_ns - self._origin[0]
        return t_device_ns + self._origin[1] + round(self._drift * since_ns)

    def _lower(self, pair: Pair) -> None:
        """Lower the line until no latency is negative."""
        if pair[0] + pair[1] < self.host_ns(pair[0]):
            self._origin = pair

    def _fit(self) -> None:
        """Fit the nearest line below all pairs, its slope limited to `LARGEST_DRIFT`."""
        drift = max(-LARGEST_DRIFT, min(LARGEST_DRIFT, _slope_below(list(self._minima))))
        first_ns = self._minima[0][0]
        self._drift = drift
        self._origin = min(self._minima, key=lambda pair: pair[1] - drift * (pair[0] - first_ns))


def _slope_below(pairs: list[Pair]) -> float:
    """Return the slope of the lower hull's edge over the mean of all pairs, the line nearest to them."""
    hull: list[Pair] = []
    for pair in pairs:
        while len(hull) > 1 and _cross_product(hull[-2], hull[-1], pair) <= 0:
            hull.pop()
        hull.append(pair)
    middle_ns = sum(pair[0] for pair in pairs) // len(pairs)
    for begin, end in pairwise(hull):
        if begin[0] <= middle_ns <= end[0]:
            return (end[1] - begin[1]) / (end[0] - begin[0])
    return 0.0


def _cross_product(a: Pair, b: Pair, c: Pair) -> int:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


class ExposureTimes:
    """Exposure times of the frames of one opening of a camera.

    Without readings of the camera's clock, the frame with the smallest latency is assumed to have arrived at
    the end of its readout: the error is then that of `readout_ns` plus the unknown transfer time.
    """

    def __init__(self, *, readout_ns: int = 0) -> None:
        self._clock = CameraClock()
        self._readout_ns = readout_ns
        self._least_ns: int | None = None
        self._last_device_ns: int | None = None
        self._read_ns: int | None = None
        self._readable = True

    def reading_due(self, now_ns: int) -> bool:
        """Return whether the camera's clock should be read again."""
        if not self._readable:
            return False
        return self._read_ns is None or now_ns - self._read_ns >= READINGS_NS

    def add_reading(self, reading: ClockReading | None) -> None:
        """Add a reading of the camera's clock (None: it has none); long round trips have little effect."""
        if reading is None:
            self._readable = False
            return
        took_ns = reading.t_after_ns - reading.t_before_ns
        if self._read_ns is None:
            self._clock.reset()
        self._read_ns = reading.t_after_ns
        self._least_ns = took_ns if self._least_ns is None else min(took_ns, self._least_ns)
        # Read at an unknown time in between: assume the middle for the quickest trip, later for slower ones.
        self._clock.observe(reading.t_device_ns, reading.t_before_ns + took_ns - self._least_ns // 2)

    def middle_ns(self, grab: Grab, *, exposure_ns: int) -> int:
        """Return the middle of a frame's exposure."""
        after_ns = exposure_ns + self._readout_ns
        if grab.t_device_ns is None:
            return grab.t_host_ns - after_ns + exposure_ns // 2
        if self._last_device_ns is not None and grab.t_device_ns < self._last_device_ns:
            self._clock.reset()
            self._read_ns = None
        self._last_device_ns = grab.t_device_ns
        if self._read_ns is None:
            self._clock.observe(grab.t_device_ns, grab.t_host_ns - after_ns)
        # An exposure cannot have ended after the frame arrived, whatever the clocks say.
        start_ns = min(self._clock.host_ns(grab.t_device_ns), grab.t_host_ns - exposure_ns)
        return start_ns + exposure_ns // 2
