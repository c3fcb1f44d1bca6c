"""When a simulated camera exposes, and for how long.

It exposes in the slots of its frame rate or on its trigger edges; both schedules keep a short queue for the
reader, drop the oldest exposure when it is full, and count the drops. The automatic exposure steps the
logarithm of the exposure time towards a target brightness.
"""

import math
import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import CameraSettings, Image
from foveacam_hardware.sim.sensor import readout_ns

QUEUE_FRAMES = 8
TARGET_MEAN = 0.5
"""Target for the mean of an image, as a share of full scale."""
HIGHLIGHT_LIMIT, HIGHLIGHT_PERCENT = 0.92, 98.0
"""Limit (share of full scale) for this percentile of the values; it overrides the target mean."""
CLIPPED_SHARE = 0.995
CLIPPED_STEP_LOG2 = -0.5
"""Least step for a clipped image, whose true brightness is unknown: half a stop down."""
STEP_LIMITS_LOG2 = (-2.0, 1.0)
"""Limits of the step after one image, stops."""
TOLERANCE_LOG2 = 0.07
"""Tolerance (5 %): a smaller error is not corrected, as noise would move the exposure for ever."""
SAMPLE_STRIDE = 8
"""Step between measured pixels, along columns and rows."""
AUTO_LIMITS_NS = (30_000, 100_000_000)
"""Limits of the automatic exposure; longer ones would blur moving objects."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureInterval:
    """The time interval of an exposure on the rig's clock."""

    start_ns: int
    length_ns: int

    @property
    def middle_ns(self) -> int:
        """The middle of the exposure, its time stamp."""
        return self.start_ns + self.length_ns // 2

    @property
    def end_ns(self) -> int:
        """The end of the exposure."""
        return self.start_ns + self.length_ns

    def middles_ns(self, parts: int) -> list[int]:
        """Return the middles of `parts` equal parts."""
        return [self.start_ns + self.length_ns * (2 * k + 1) // (2 * parts) for k in range(parts)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraExposure:
    """One exposure, begun or still to come, and its settings."""

    seq: int
    interval: ExposureInterval
    settings: CameraSettings

    @property
    def ready_ns(self) -> int:
        """The time from which its frame can be read."""
        return self.interval.end_ns + readout_ns(self.settings)


class ExposureSchedule(Protocol):
    """The exposures of a camera in order, consumed by one reader."""

    missed: int
    """Trigger edges that came while the sensor was busy and caused no exposure."""

    def oldest(self, now_ns: int) -> CameraExposure | None:
        """Return the oldest exposure not consumed (it may still be running); None when there is none."""
        ...

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest exposure that can be read and was not consumed."""
        ...

    def consume(self, exposure: CameraExposure) -> int:
        """Consume the queue up to `exposure`; return how many other exposures were lost."""
        ...

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Use other settings from the next exposure on; an exposure that has begun is not changed."""
        ...

    @property
    def next_seq(self) -> int:
        """The sequence number after everything consumed."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SlotRange:
    """Slots of one frame rate and exposure, from `first_slot` at `start_ns` on."""

    first_slot: int
    start_ns: int
    settings: CameraSettings

    @property
    def period_ns(self) -> int:
        """The time from slot to slot."""
        return round(1e9 / self.settings.frame_rate_hz)

    def start_of_ns(self, slot: int) -> int:
        """Return the time at which a slot begins."""
        return self.start_ns + (slot - self.first_slot) * self.period_ns

    def begun(self, now_ns: int) -> int:
        """Return the newest slot that has begun, if all slots were of this range."""
        return self.first_slot + (now_ns - self.start_ns) // self.period_ns

    def readable(self, now_ns: int) -> int:
        """Return the newest slot that can be read, if all slots were of this range."""
        return self.begun(now_ns - self.settings.exposure_ns - readout_ns(self.settings))


class FreeRunningSchedule:
    """Exposures at a fixed rate from `start_ns` on; each `adjust` may change the rate."""

    def __init__(self, settings: CameraSettings, *, start_ns: int, first_seq: int) -> None:
        self._ranges = [SlotRange(first_slot=0, start_ns=start_ns, settings=settings)]
        self._first_seq = first_seq
        self._next_slot = 0
        self.missed = 0

    @property
    def next_seq(self) -> int:
        """The sequence number after everything consumed."""
        return self._first_seq + self._next_slot

    def oldest(self, now_ns: int) -> CameraExposure | None:
        """Return the oldest exposure still in the queue."""
        return self._exposure(max(self._next_slot, self._newest_slot(now_ns) - QUEUE_FRAMES + 1))

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest exposure that can be read."""
        slot = self._newest_slot(now_ns)
        return self._exposure(slot) if slot >= self._next_slot else None

    def consume(self, exposure: CameraExposure) -> int:
        """Consume every slot up to that of `exposure`; return how many were lost."""
        slot = exposure.seq - self._first_seq
        lost, self._next_slot = slot - self._next_slot, slot + 1
        while len(self._ranges) > 1 and self._ranges[1].first_slot <= self._next_slot:
            del self._ranges[0]
        return lost

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Apply settings from the first slot that has not begun; its start time does not move."""
        last = self._ranges[-1]
        slot = max(last.first_slot, last.begun(now_ns) + 1)
        slot_range = SlotRange(first_slot=slot, start_ns=last.start_of_ns(slot), settings=settings)
        if slot == last.first_slot:
            self._ranges[-1] = slot_range
        else:
            self._ranges.append(slot_range)

    def _newest_slot(self, now_ns: int) -> int:
        end = None
        for slot_range in reversed(self._ranges):
            slot = slot_range.readable(now_ns)
            if slot >= slot_range.first_slot:
                return slot if end is None else min(slot, end)
            end = slot_range.first_slot - 1
        return self._ranges[0].readable(now_ns)

    def _exposure(self, slot: int) -> CameraExposure:
        slot_range = next(
            (found for found in reversed(self._ranges) if found.first_slot <= slot), self._ranges[0]
        )
        settings = slot_range.settings
        interval = ExposureInterval(start_ns=slot_range.start_of_ns(slot), length_ns=settings.exposure_ns)
        return CameraExposure(seq=self._first_seq + slot, interval=interval, settings=settings)


class TriggeredSchedule:
    """One exposure per trigger edge; `trigger` is called by the controller, the rest by the reader."""

    def __init__(self, settings: CameraSettings, *, first_seq: int) -> None:
        self._settings = settings
        self._queue: deque[CameraExposure] = deque()
        self._lock = threading.Lock()
        self._next_seq = first_seq
        self._free_ns = 0
        self._lost = 0
        self.missed = 0

    @property
    def next_seq(self) -> int:
        """The sequence number of the next trigger edge."""
        return self._next_seq

    def trigger(self, t_ns: int) -> None:
        """Begin an exposure at `t_ns`, unless the sensor is busy with the last one."""
        with self._lock:
            if t_ns < self._free_ns:
                self.missed += 1
                return
            interval = ExposureInterval(start_ns=t_ns, length_ns=self._settings.exposure_ns)
            self._queue.append(CameraExposure(seq=self._next_seq, interval=interval, settings=self._settings))
            self._next_seq += 1
            self._free_ns = t_ns + max(interval.length_ns, readout_ns(self._settings))
            if len(self._queue) > QUEUE_FRAMES:
                self._queue.popleft()
                self._lost += 1

    def adjust(self, settings: CameraSettings, *, now_ns: int) -> None:
        """Use other settings from the next trigger edge on."""
        with self._lock:
            self._settings = settings

    def oldest(self, now_ns: int) -> CameraExposure | None:
        """Return the exposure of the oldest trigger edge, whatever `now_ns`."""
        with self._lock:
            return self._queue[0] if self._queue else None

    def newest(self, now_ns: int) -> CameraExposure | None:
        """Return the newest exposure that can be read."""
        with self._lock:
            return next((held for held in reversed(self._queue) if held.ready_ns <= now_ns), None)

    def consume(self, exposure: CameraExposure) -> int:
        """Remove the exposures up to `exposure`; return how many others were lost."""
        with self._lock:
            lost, self._lost = self._lost, 0
            while self._queue and self._queue[0].seq <= exposure.seq:
                lost += self._queue.popleft().seq != exposure.seq
            return lost


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureStep:
    """The exposure for the next image, and whether no further step would improve it."""

    exposure_ns: int
    settled: bool


def overexposure_log2(image: Image, *, bits: int, black_level: float) -> float:
    """Return by how many stops an image is too bright.

    `image`: (h, w) or (h, w, 3) of `bits`; `black_level`: the offset in it, grey levels of 8 bits.
    """
    white = float(2**bits - 1)
    black = black_level * 2.0 ** (bits - 8)
    values = image[::SAMPLE_STRIDE, ::SAMPLE_STRIDE].astype(np.float64)
    mean = max(float(values.mean()) - black, 1.0) / (white - black)
    bright = float(np.percentile(values, HIGHLIGHT_PERCENT))
    excess = max(mean / TARGET_MEAN, (bright - black) / (white - black) / HIGHLIGHT_LIMIT)
    stops = math.log2(excess)
    return max(stops, -CLIPPED_STEP_LOG2) if bright >= CLIPPED_SHARE * white else stops


def next_exposure(exposure_ns: int, stops: float, *, longest_ns: int) -> ExposureStep:
    """Return the next exposure after an image `stops` too bright; `longest_ns`: limit of the frame rate."""
    low_ns, high_ns = AUTO_LIMITS_NS[0], min(AUTO_LIMITS_NS[1], longest_ns)
    if abs(stops) <= TOLERANCE_LOG2:
        return ExposureStep(exposure_ns=exposure_ns, settled=True)
    step = min(max(-stops, STEP_LIMITS_LOG2[0]), STEP_LIMITS_LOG2[1])
    next_ns = round(min(max(exposure_ns * 2.0**step, low_ns), high_ns))
    at_end = abs(next_ns - exposure_ns) < TOLERANCE_LOG2 * exposure_ns and next_ns in (low_ns, high_ns)
    return ExposureStep(exposure_ns=next_ns, settled=at_end)
