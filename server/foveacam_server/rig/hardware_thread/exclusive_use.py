"""Who uses the rig exclusively: one at a time; only one who gives way is waited for."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from foveacam_server.rig import refusals

GIVEN_AWAY_S = 5.0
"""So long a job waits for the rig: who follows targets gives it away after the look under way."""


class ExclusiveUse:
    """The exclusive use of one rig; callable from any thread."""

    def __init__(self) -> None:
        self._taken = threading.Lock()
        self._counting = threading.Lock()
        self._holder: str | None = None
        self._gives_way = False
        self._waiting = 0

    @property
    def holder(self) -> str | None:
        """Name of the work that has the rig."""
        return self._holder

    @property
    def firm(self) -> bool:
        """Whether work that gives no way has the rig."""
        return self._holder is not None and not self._gives_way

    @property
    def wanted(self) -> bool:
        """Whether somebody waits for the rig."""
        return self._waiting > 0

    def check_free(self, asked: str) -> None:
        """Raise `Busy` while work has the rig."""
        if (holder := self._holder) is not None:
            raise refusals.in_use(asked, holder)

    @contextmanager
    def hold(self, holder: str, *, asked: str, gives_way: bool = False) -> Iterator[None]:
        """Have the rig; raise `Busy` when somebody has it who does not give way."""
        if not self._acquire():
            raise refusals.in_use(asked, self._holder or "somebody")
        self._gives_way = gives_way
        self._holder = holder
        try:
            yield
        finally:
            self._holder = None
            self._taken.release()

    def _acquire(self) -> bool:
        if self._taken.acquire(blocking=False):
            return True
        if not self._gives_way:
            return False
        with self._counting:
            self._waiting += 1
        try:
            return self._taken.acquire(timeout=GIVEN_AWAY_S)
        finally:
            with self._counting:
                self._waiting -= 1
