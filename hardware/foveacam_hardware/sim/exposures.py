"""When a simulated camera exposes: at the slots of its frame rate, or at the edges of its trigger line.

Both kinds keep a short queue for the reader, drop the oldest when it is full, and count what they drop.
"""

import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import CameraSettings
from foveacam_hardware.sim.sensor_limits import readout_ns
from foveacam_hardware.sim.world import Interval

QUEUE_FRAMES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Exposure:
    """One exposure, begun or still to come, with the settings of its moment."""

    seq: int
    interval: Interval
    settings: CameraSettings

    @property
    def ready_ns(self) -> int:
        """When its frame can be read."""
        return self.interval.end_ns + readout_ns(self.settings.pixel_format)


class Schedule(Protocol):
    """The exposures of a camera, in order; one reader takes them."""

    def first(self, now_ns: int) -> Exposure | None:
        """Return the oldest exposure not taken (it may still be running); None when none is known."""
        ...

    def newest(self, now_ns: int) -> Exposure | None:
        """Return the newest exposure that can be read and was not taken."""
        ...

    def take(self, exposure: Exposure) -> int:
        """Consume the queue up to `exposure`; return how many others were lost with it or before it."""
        ...

    @property
    def next_seq(self) -> int:
        """The number that follows everything taken."""
        ...


class FreeRun:
    """Exposures at a fixed rate from `start_ns` on."""

    def __init__(self, settings: CameraSettings, *, start_ns: int, first_seq: int) -> None:
        self._settings = settings
        self._start_ns = start_ns
        self._period_ns = round(1e9 / settings.frame_rate_hz)
        self._first_seq = first_seq
        self._untaken = 0  # slot

    @property
    def next_seq(self) -> int:
        """The number that follows everything taken."""
        return self._first_seq + self._untaken

    def first(self, now_ns: int) -> Exposure | None:
        """Return the oldest slot still kept."""
        return self._exposure(max(self._untaken, self._newest_slot(now_ns) - QUEUE_FRAMES + 1))

    def newest(self, now_ns: int) -> Exposure | None:
        """Return the newest slot that can be read."""
        slot = self._newest_slot(now_ns)
        return self._exposure(slot) if slot >= self._untaken else None

    def take(self, exposure: Exposure) -> int:
        """Go on behind the slot of `exposure`."""
        slot = exposure.seq - self._first_seq
        lost, self._untaken = slot - self._untaken, slot + 1
        return lost

    def _newest_slot(self, now_ns: int) -> int:
        latency_ns = self._settings.exposure_ns + readout_ns(self._settings.pixel_format)
        return (now_ns - self._start_ns - latency_ns) // self._period_ns

    def _exposure(self, slot: int) -> Exposure:
        start_ns = self._start_ns + slot * self._period_ns
        interval = Interval(start_ns=start_ns, length_ns=self._settings.exposure_ns)
        return Exposure(seq=self._first_seq + slot, interval=interval, settings=self._settings)


class Triggered:
    """One exposure a trigger edge; `edge` is called from the controller's side, the rest by the reader."""

    def __init__(self, settings: CameraSettings, *, first_seq: int) -> None:
        self._settings = settings
        self._queue: deque[Exposure] = deque()
        self._lock = threading.Lock()
        self._next_edge_seq = first_seq
        self._free_ns = 0
        self._lost = 0

    @property
    def next_seq(self) -> int:
        """The number of the next edge."""
        return self._next_edge_seq

    def edge(self, t_ns: int) -> None:
        """Begin an exposure, unless the sensor is still busy with the last one."""
        with self._lock:
            if t_ns < self._free_ns:
                self._lost += 1
                return
            interval = Interval(start_ns=t_ns, length_ns=self._settings.exposure_ns)
            self._queue.append(Exposure(seq=self._next_edge_seq, interval=interval, settings=self._settings))
            self._next_edge_seq += 1
            self._free_ns = t_ns + max(interval.length_ns, readout_ns(self._settings.pixel_format))
            if len(self._queue) > QUEUE_FRAMES:
                self._queue.popleft()
                self._lost += 1

    def first(self, now_ns: int) -> Exposure | None:
        """Return the oldest edge's exposure; `now_ns` does not matter."""
        with self._lock:
            return self._queue[0] if self._queue else None

    def newest(self, now_ns: int) -> Exposure | None:
        """Return the newest exposure that can be read."""
        with self._lock:
            return next((held for held in reversed(self._queue) if held.ready_ns <= now_ns), None)

    def take(self, exposure: Exposure) -> int:
        """Remove the queue's head up to `exposure`."""
        with self._lock:
            lost, self._lost = self._lost, 0
            while self._queue and self._queue[0].seq <= exposure.seq:
                lost += self._queue.popleft().seq != exposure.seq
            return lost
