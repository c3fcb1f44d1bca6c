"""Maps the times of a recording to the clock, for playback once or in a loop."""

import math
import threading
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, InvalidInput

SLOWEST, FASTEST = 0.25, 4.0
"""Limits of the playback speed, relative to the recorded one."""


class EndOfPlayback(StrEnum):
    """Behaviour after the last frame."""

    LOOP = "loop"
    """Playback restarts."""
    STOP = "stop"
    """No more frames are delivered; the cameras report the end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Playback:
    """Playback options. `speed`: relative to the recorded one; a slow machine skips frames to keep it."""

    speed: float = 1.0
    at_end: EndOfPlayback = EndOfPlayback.LOOP

    def __post_init__(self) -> None:
        if not (math.isfinite(self.speed) and SLOWEST <= self.speed <= FASTEST):
            raise InvalidInput(
                f"replay: speed {self.speed:g} is outside {SLOWEST:g} to {FASTEST:g}; choose one inside"
            )


class PlaybackTimeline:
    """Recorded time on the clock, common to all cameras; runs from the first `begin` on.

    `first_ns`, `last_ns`: the recording's first and last exposure; `gap_ns`: from the last one to the first
    one of the next lap.
    """

    def __init__(self, clock: Clock, playback: Playback, *, first_ns: int, last_ns: int, gap_ns: int) -> None:
        self._clock = clock
        self._playback = playback
        self._first_ns = first_ns
        self._lap_ns = last_ns - first_ns + max(1, gap_ns)
        self._lock = threading.Lock()
        self._start_ns: int | None = None

    @property
    def speed(self) -> float:
        """Playback speed relative to the recorded one."""
        return self._playback.speed

    @property
    def loops(self) -> bool:
        """Whether playback restarts at its end."""
        return self._playback.at_end is EndOfPlayback.LOOP

    def begin(self) -> None:
        """Start the timeline; later calls have no effect."""
        with self._lock:
            if self._start_ns is None:
                self._start_ns = self._clock.now_ns()

    def moment_ns(self, times_ns: NDArray[np.int64], number: int) -> int | None:
        """Return the clock's time of exposure `number`, counted over all laps; None when it never happens."""
        lap, index = divmod(number, len(times_ns))
        if self._start_ns is None or (lap > 0 and not self.loops):
            return None
        recorded_ns = lap * self._lap_ns + int(times_ns[index]) - self._first_ns
        return self._start_ns + round(recorded_ns / self.speed)

    def newest(self, times_ns: NDArray[np.int64], now_ns: int) -> int:
        """Return the number of the last exposure up to `now_ns`, counted over all laps; -1 for none yet."""
        if self._start_ns is None:
            return -1
        recorded_ns = math.floor((now_ns - self._start_ns) * self.speed)
        lap, within_ns = divmod(recorded_ns, self._lap_ns) if self.loops else (0, recorded_ns)
        index = int(np.searchsorted(times_ns, self._first_ns + within_ns, side="right")) - 1
        return max(-1, lap * len(times_ns) + index)
