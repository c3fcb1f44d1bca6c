"""Checks whether the rig may be used: exclusive sessions, and conditions that forbid a look or a move.

One session holds the rig at a time; others wait only for a holder that yields.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from foveacam_server.rig import refusals
from foveacam_server.rig.device_reconnector import FOVEAE, DeviceReconnector, MirrorLinkMonitor
from foveacam_server.rig.hardware_thread.moves import RigMoves
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.status import RigStatus

GIVEN_AWAY_S = 5.0
"""Timeout of acquiring the rig: following yields it after the look under way."""


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
        """Whether work that does not yield has the rig."""
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
        """Acquire the rig; raise `Busy` if its holder does not yield."""
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


class MoveGuard:
    """Checks each look and move before it is made; callable from any thread."""

    def __init__(
        self,
        rig: Callable[[], AssembledRig | None],
        *,
        status: Callable[[], RigStatus],
        moves: RigMoves,
        mirrors: MirrorLinkMonitor,
        reconnector: DeviceReconnector,
        use: ExclusiveUse,
    ) -> None:
        self._rig = rig
        self._status = status
        self._moves = moves
        self._mirrors = mirrors
        self._reconnector = reconnector
        self._use = use

    def opened_rig(self) -> AssembledRig:
        """Return the rig; raise `NotConnected` while none is open."""
        rig = self._rig()
        if rig is None:
            raise refusals.not_open(self._status())
        return rig

    def check(self, *, one_eyed: bool = False) -> None:
        """Raise `Stopped` or `NotConnected` when the mirrors cannot move now.

        `one_eyed`: whether the camera of one fovea may be missing.
        """
        if self._moves.halted:
            raise refusals.stopped()
        rig = self.opened_rig()
        self._mirrors.check()
        missing = self._reconnector.problem_of(*(self._reconnector.needed(rig) if one_eyed else FOVEAE))
        if missing is not None:
            raise refusals.missing(missing)

    def check_free(self, asked: str, *, one_eyed: bool = False) -> None:
        """Raise as `check`, and `Busy` while a job has the rig."""
        self.check(one_eyed=one_eyed)
        self._use.check_free(asked)
