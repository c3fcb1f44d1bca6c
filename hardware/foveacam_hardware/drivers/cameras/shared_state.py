"""State shared between a camera's thread and its readers: a bounded frame buffer, counters, link state.

The newest frames win; frames not read in time are skipped and counted. Also the link's state machine and the
back-off between attempts to open a camera.
"""

import threading
from collections import deque
from dataclasses import replace

from foveacam_hardware.contract import (
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    Frame,
    ValueRange,
)

OUTAGE = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)
"""Phases of an outage, during which `since_ns` and `reason` remain those of the loss."""
NEXT = {
    CameraPhase.CLOSED: (CameraPhase.OPENING,),
    CameraPhase.OPENING: (CameraPhase.READY, CameraPhase.BACKOFF, CameraPhase.LOST),
    CameraPhase.READY: (CameraPhase.STREAMING, CameraPhase.LOST),
    CameraPhase.STREAMING: (CameraPhase.READY, CameraPhase.DEGRADED, CameraPhase.LOST),
    CameraPhase.DEGRADED: (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.LOST),
    CameraPhase.LOST: (CameraPhase.BACKOFF, CameraPhase.OPENING),
    CameraPhase.BACKOFF: (CameraPhase.OPENING, CameraPhase.LOST),
}
"""Allowed transitions; every phase may also go to closed."""
_NOTHING = ValueRange(low=0.0, high=0.0)
NO_RANGES = CameraRanges(
    exposure_ns=_NOTHING, gain_db=_NOTHING, frame_rate_hz=_NOTHING, black_level=_NOTHING, pixel_formats=()
)


class LinkState:
    """State machine of a camera's link; raises `ValueError` for a transition that is not allowed."""

    def __init__(self) -> None:
        self._link = CameraLink(phase=CameraPhase.CLOSED, reason="not connected yet")

    @property
    def link(self) -> CameraLink:
        """The current phase, since when, and why."""
        return self._link

    def go(self, phase: CameraPhase, *, now_ns: int, reason: str = "") -> None:
        """Change the phase; the change from opening to ready increments the epoch."""
        before = self._link
        if phase is before.phase:
            if reason and reason != before.reason:
                self._link = CameraLink(
                    phase=phase, since_ns=before.since_ns, reason=reason, epoch=before.epoch
                )
            return
        if phase is not CameraPhase.CLOSED and phase not in NEXT[before.phase]:
            raise ValueError(f"a camera's link does not go from {before.phase} to {phase}")
        same_outage = phase in OUTAGE and before.phase in OUTAGE
        opened = before.phase is CameraPhase.OPENING and phase is CameraPhase.READY
        self._link = CameraLink(
            phase=phase,
            since_ns=before.since_ns if same_outage else now_ns,
            reason=reason or (before.reason if same_outage else ""),
            epoch=before.epoch + opened,
        )


class BackOff:
    """Pauses between attempts, doubled each time up to a limit."""

    def __init__(self, *, first_ns: int, most_ns: int) -> None:
        self._first_ns = self._next_ns = first_ns
        self._most_ns = most_ns

    def pause_ns(self) -> int:
        """Return the next pause."""
        pause_ns, self._next_ns = self._next_ns, min(self._most_ns, 2 * self._next_ns)
        return pause_ns

    def reset(self) -> None:
        """Start with the first pause again: the camera has delivered a frame."""
        self._next_ns = self._first_ns


class CameraSharedState:
    """Frame buffer, counters and link of one camera; `changed` is notified of every frame and phase change.

    Methods are called with `changed` held, unless stated otherwise.
    """

    def __init__(self, *, frames: int) -> None:
        self.changed = threading.Condition()
        self.state = LinkState()
        self.ranges = NO_RANGES
        self.counters = CameraCounters()
        self.newest: Frame | None = None
        """The last frame delivered to a reader; None after a gap."""
        self._waiting: deque[Frame] = deque()
        self._frames = frames

    def go(self, phase: CameraPhase, *, now_ns: int, reason: str = "") -> None:
        """Change the link's phase and wake the readers; acquires the lock itself."""
        if phase is self.state.link.phase and not reason:
            return
        with self.changed:
            self.state.go(phase, now_ns=now_ns, reason=reason)
            self.changed.notify_all()

    def count(
        self, *, dropped: int = 0, incomplete: int = 0, late: int = 0, underrun: int | None = None
    ) -> None:
        """Add to the counters; `underrun` is the new total. Acquires the lock itself."""
        with self.changed:
            now = self.counters
            self.counters = replace(
                now,
                dropped=now.dropped + dropped,
                incomplete=now.incomplete + incomplete,
                late=now.late + late,
                underrun=now.underrun if underrun is None else underrun,
            )

    def put(self, frame: Frame) -> None:
        """Add a frame; a full buffer drops its oldest. Acquires the lock itself."""
        with self.changed:
            if len(self._waiting) >= self._frames:
                self._waiting.popleft()
                self.counters = replace(self.counters, skipped=self.counters.skipped + 1)
            self._waiting.append(frame)
            self.changed.notify_all()

    def clear(self, *, counters: bool = False) -> None:
        """Discard the buffered frames, which precede a change of settings. Acquires the lock itself."""
        with self.changed:
            lost = len(self._waiting)
            self._waiting.clear()
            self.newest = None
            if counters:
                self.counters = CameraCounters()
            else:
                self.counters = replace(self.counters, skipped=self.counters.skipped + lost)

    @property
    def waiting(self) -> int:
        """Number of unread frames."""
        return len(self._waiting)

    def take_oldest(self) -> Frame | None:
        """Remove and return the oldest unread frame; None when there is none."""
        return self._deliver(self._waiting.popleft()) if self._waiting else None

    def take_newest(self, *, oldest_ns: int) -> Frame | None:
        """Return the newest frame if it is from `oldest_ns` or later; discard all older ones."""
        if self._waiting:
            newest = self._waiting.pop()
            lost = len(self._waiting)
            self._waiting.clear()
            fresh = newest.t_ns >= oldest_ns
            self.counters = replace(self.counters, skipped=self.counters.skipped + lost + (0 if fresh else 1))
            return self._deliver(newest) if fresh else None
        if self.newest is not None and self.newest.t_ns >= oldest_ns:
            return self.newest
        return None

    def _deliver(self, frame: Frame) -> Frame:
        self.newest = frame
        self.counters = replace(self.counters, delivered=self.counters.delivered + 1)
        return frame
