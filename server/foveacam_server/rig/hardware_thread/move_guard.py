"""Refuses what the rig cannot do now: the stop, a missing device, a switch or another job forbids it."""

from collections.abc import Callable

from foveacam_server.rig import refusals
from foveacam_server.rig.device_reconnector import FOVEAE, DeviceReconnector, MirrorLinkMonitor
from foveacam_server.rig.hardware_thread.exclusive_use import ExclusiveUse
from foveacam_server.rig.hardware_thread.moves import RigMoves
from foveacam_server.rig.ports import AssembledRig


class MoveGuard:
    """Checks each look and move before it is made; callable from any thread."""

    def __init__(
        self,
        rig: Callable[[], AssembledRig | None],
        *,
        moves: RigMoves,
        mirrors: MirrorLinkMonitor,
        reconnector: DeviceReconnector,
        use: ExclusiveUse,
    ) -> None:
        self._rig = rig
        self._moves = moves
        self._mirrors = mirrors
        self._reconnector = reconnector
        self._use = use

    def opened_rig(self) -> AssembledRig:
        """Return the rig; raise `NotConnected` while none is open."""
        rig = self._rig()
        if rig is None:
            raise refusals.not_open(self._reconnector.problems)
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
