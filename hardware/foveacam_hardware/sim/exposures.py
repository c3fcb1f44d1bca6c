"""When a simulated camera exposes: at the slots of its frame rate, or at the edges of its trigger line.

Both kinds keep a short queue for the reader, drop the oldest when it is full, and count what they drop.
"""

import math
import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import CameraSettings, Image
from foveacam_hardware.sim.sensor import readout_ns


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureInterval:
    """One exposure's span of time on the rig's clock."""

    start_ns: int
    length_ns: int

    @property
    def middle_ns(self) -> int:
        """The moment that stands for the exposure."""
        return self.start_ns + self.length_ns // 2

    @property
    def end_ns(self) -> int:
        """The end of the exposure."""
        return self.start_ns + self.length_ns

    def middles_ns(self, parts: int) -> list[int]:
        """Return the middles of equal parts."""
        return [self.start_ns + self.length_ns * (2 * k + 1) // (2 * parts) for k in range(parts)]


QUEUE_FRAMES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraExposure:
    """One exposure, begun or still to come, with the settings of its moment."""

    seq: int
    interval: ExposureInterval
    settings: CameraSettings

    @property
    def ready_ns(self) -> int:
        """When its frame can be read."""
        return self.interval.end_ns + readout_ns(self.settings.pixel_format)


class ExposureSchedule(Protocol):
    """The exposures of a camera, in order; one reader takes them."""

    missed: int
    """Edges that came while the sensor was busy: they exposed nothing."""

    def first(self, now_ns: int) -> CameraExposure | None:
        """Return the oldest exposure not taken (it may still be running); None when none is known."""
        ...

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest exposure that can be read and was not taken."""
        ...

    def take(self, exposure: CameraExposure) -> int:
        """Consume the queue up to `exposure`; return how many others were lost with it or before it."""
        ...

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Expose with other settings from the next exposure on; what has begun goes on as it is."""
        ...

    @property
    def next_seq(self) -> int:
        """The number that follows everything taken."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SlotRange:
    """Slots of one rate and exposure, from `first_slot` at `start_ns` on."""

    first_slot: int
    start_ns: int
    settings: CameraSettings

    @property
    def period_ns(self) -> int:
        """From slot to slot."""
        return round(1e9 / self.settings.frame_rate_hz)

    def start_of_ns(self, slot: int) -> int:
        """Return when a slot begins."""
        return self.start_ns + (slot - self.first_slot) * self.period_ns

    def begun(self, now_ns: int) -> int:
        """Return the newest slot that has begun, as if all were of this stretch."""
        return self.first_slot + (now_ns - self.start_ns) // self.period_ns

    def readable(self, now_ns: int) -> int:
        """Return the newest slot that can be read, as if all were of this stretch."""
        return self.begun(now_ns - self.settings.exposure_ns - readout_ns(self.settings.pixel_format))


class FreeRunningSchedule:
    """Exposures at a fixed rate from `start_ns` on; at another one after each `adjust`."""

    def __init__(self, settings: CameraSettings, *, start_ns: int, first_seq: int) -> None:
        self._stretches = [SlotRange(first_slot=0, start_ns=start_ns, settings=settings)]
        self._first_seq = first_seq
        self._untaken = 0  # slot
        self.missed = 0

    @property
    def next_seq(self) -> int:
        """The number that follows everything taken."""
        return self._first_seq + self._untaken

    def first(self, now_ns: int) -> CameraExposure | None:
        """Return the oldest slot still kept."""
        return self._exposure(max(self._untaken, self._newest_slot(now_ns) - QUEUE_FRAMES + 1))

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest slot that can be read."""
        slot = self._newest_slot(now_ns)
        return self._exposure(slot) if slot >= self._untaken else None

    def take(self, exposure: CameraExposure) -> int:
        """Go on behind the slot of `exposure`."""
        slot = exposure.seq - self._first_seq
        lost, self._untaken = slot - self._untaken, slot + 1
        while len(self._stretches) > 1 and self._stretches[1].first_slot <= self._untaken:
            del self._stretches[0]
        return lost

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Begin a stretch with the first slot that has not begun; none begins before its turn."""
        last = self._stretches[-1]
        slot = max(last.first_slot, last.begun(now_ns) + 1)
        stretch = SlotRange(first_slot=slot, start_ns=last.start_of_ns(slot), settings=settings)
        if slot == last.first_slot:
            self._stretches[-1] = stretch
        else:
            self._stretches.append(stretch)

    def _newest_slot(self, now_ns: int) -> int:
        end = None
        for stretch in reversed(self._stretches):
            slot = stretch.readable(now_ns)
            if slot >= stretch.first_slot:
                return slot if end is None else min(slot, end)
            end = stretch.first_slot - 1
        return self._stretches[0].readable(now_ns)

    def _exposure(self, slot: int) -> CameraExposure:
        stretch = next(
            (found for found in reversed(self._stretches) if found.first_slot <= slot), self._stretches[0]
        )
        settings = stretch.settings
        interval = ExposureInterval(start_ns=stretch.start_of_ns(slot), length_ns=settings.exposure_ns)
        return CameraExposure(seq=self._first_seq + slot, interval=interval, settings=settings)


class TriggeredSchedule:
    """One exposure a trigger edge; `edge` is called from the controller's side, the rest by the reader."""

    def __init__(self, settings: CameraSettings, *, first_seq: int) -> None:
        self._settings = settings
        self._queue: deque[CameraExposure] = deque()
        self._lock = threading.Lock()
        self._next_edge_seq = first_seq
        self._free_ns = 0
        self._lost = 0
        self.missed = 0

    @property
    def next_seq(self) -> int:
        """The number of the next edge."""
        return self._next_edge_seq

    def edge(self, t_ns: int) -> None:
        """Begin an exposure at `t_ns`, unless the sensor is still busy with the last one."""
        with self._lock:
            if t_ns < self._free_ns:
                self.missed += 1
                return
            interval = ExposureInterval(start_ns=t_ns, length_ns=self._settings.exposure_ns)
            self._queue.append(
                CameraExposure(seq=self._next_edge_seq, interval=interval, settings=self._settings)
            )
            self._next_edge_seq += 1
            self._free_ns = t_ns + max(interval.length_ns, readout_ns(self._settings.pixel_format))
            if len(self._queue) > QUEUE_FRAMES:
                self._queue.popleft()
                self._lost += 1

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Expose otherwise from the next edge on."""
        with self._lock:
            self._settings = settings

    def first(self, now_ns: int) -> CameraExposure | None:
        """Return the oldest edge's exposure; `now_ns` does not matter."""
        with self._lock:
            return self._queue[0] if self._queue else None

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest exposure that can be read."""
        with self._lock:
            return next((held for held in reversed(self._queue) if held.ready_ns <= now_ns), None)

    def take(self, exposure: CameraExposure) -> int:
        """Remove the queue's head up to `exposure`."""
        with self._lock:
            lost, self._lost = self._lost, 0
            while self._queue and self._queue[0].seq <= exposure.seq:
                lost += self._queue.popleft().seq != exposure.seq
            return lost


MEAN = 0.5
"""Of full scale: where the mean of a picture is brought to."""
HIGHLIGHT, HIGHLIGHT_PERCENT = 0.92, 98.0
"""Unless so many of its values would then be brighter than this."""
CLIPPED = 0.995
CLIPPED_STEP_LOG2 = -0.5
"""What is at its end may be any amount brighter: at least half a stop down."""
STEP_LOG2 = (-2.0, 1.0)
"""Of one picture, stops."""
GOOD_LOG2 = 0.07
"""5 %: nearer is left alone, or noise would move it for ever."""
STRIDE = 8
"""Every so many pixels of every so many rows are measured."""
LIMITS_NS = (30_000, 100_000_000)
"""It goes no further; slower, it would smear what moves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureStep:
    """What one picture says: the exposure for the next, and whether this one was as good as it gets."""

    exposure_ns: int
    settled: bool


def too_bright_log2(image: Image, *, bits: int, black_level: float) -> float:
    """Return by how many stops a picture is too bright.

    `image`: (h, w) or (h, w, 3) of `bits`; `black_level`: what was added to it, grey levels of 8 bits.
    """
    white = float(2**bits - 1)
    black = black_level * 2.0 ** (bits - 8)
    values = image[::STRIDE, ::STRIDE].astype(np.float64)
    mean = max(float(values.mean()) - black, 1.0) / (white - black)
    bright = float(np.percentile(values, HIGHLIGHT_PERCENT))
    excess = max(mean / MEAN, (bright - black) / (white - black) / HIGHLIGHT)
    stops = math.log2(excess)
    return max(stops, -CLIPPED_STEP_LOG2) if bright >= CLIPPED * white else stops


def aim(exposure_ns: int, stops: float, *, longest_ns: int) -> ExposureStep:
    """Return the next exposure after a picture that was `stops` too bright; `longest_ns`: of its rate."""
    low_ns, high_ns = LIMITS_NS[0], min(LIMITS_NS[1], longest_ns)
    if abs(stops) <= GOOD_LOG2:
        return ExposureStep(exposure_ns=exposure_ns, settled=True)
    step = min(max(-stops, STEP_LOG2[0]), STEP_LOG2[1])
    next_ns = round(min(max(exposure_ns * 2.0**step, low_ns), high_ns))
    at_end = abs(next_ns - exposure_ns) < GOOD_LOG2 * exposure_ns and next_ns in (low_ns, high_ns)
    return ExposureStep(exposure_ns=next_ns, settled=at_end)
