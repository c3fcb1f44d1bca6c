"""Which job has the rig for itself: one at a time; who gives way is asked for it and waited for."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from foveacam_server.rig import refusals

GIVEN_AWAY_S = 5.0
"""So long a job waits for the rig: who follows targets gives it away after the look under way."""


class ExclusiveUse:
    """The holder of the rig, and how many wait for it; callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holder: str | None = None
        self._gives_way = False
        self._waiting = 0
        self._counting = threading.Lock()

    @property
    def holder(self) -> str | None:
        """Name of the work that has the rig; None when nobody has it."""
        return self._holder

    @property
    def by_one_who_stays(self) -> bool:
        """Whether a job that gives no way has the rig."""
        return self._holder is not None and not self._gives_way

    @property
    def wanted(self) -> bool:
        """Whether a job waits for the rig."""
        return self._waiting > 0

    @contextmanager
    def by(self, holder: str, *, gives_way: bool) -> Iterator[None]:
        """Hold the rig during the block; raise `Busy` when a job has it that does not give way."""
        if not self._acquire():
            raise refusals.in_use(f"give the rig to {holder}", self._holder or "somebody")
        self._gives_way = gives_way
        self._holder = holder
        try:
            yield
        finally:
            self._holder = None
            self._lock.release()

    def _acquire(self) -> bool:
        """Take the rig, or return False; one who gives way is waited for."""
        if self._lock.acquire(blocking=False):
            return True
        if not self._gives_way:
            return False
        with self._counting:
            self._waiting += 1
        try:
            return self._lock.acquire(timeout=GIVEN_AWAY_S)
        finally:
            with self._counting:
                self._waiting -= 1
