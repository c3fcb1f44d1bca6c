"""Reads the status of every device, four times a second in use, and emits events of the rig's state."""

from collections.abc import Callable
from dataclasses import replace

from foveacam_hardware.contract import Clock
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.rig.device_reconnector import DeviceReconnector
from foveacam_server.rig.hardware_thread.moves import RigMoves
from foveacam_server.rig.live_views import LiveViews
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.schema import RigStateChange
from foveacam_server.rig.status import RigState, RigStatus, rig_status

STATUS_PERIOD_NS, QUIET_PERIOD_NS = 250_000_000, 1_000_000_000


class StatusReading:
    """The rig's last status; readable from any thread, refreshed only by the hardware thread."""

    def __init__(
        self,
        *,
        clock: Clock,
        events: EventLog,
        reconnector: DeviceReconnector,
        live: LiveViews,
        moves: RigMoves,
        is_open: Callable[[], bool],
    ) -> None:
        self._clock = clock
        self._events = events
        self._reconnector = reconnector
        self._live = live
        self._moves = moves
        self._is_open = is_open
        self._status = RigStatus()
        self._due_ns = 0

    @property
    def status(self) -> RigStatus:
        """The last status, with the state and the problems of this moment."""
        opened, problems = self._is_open(), self._reconnector.problems
        return replace(self._status, state=self._state(), problems=problems, opened=opened)

    @property
    def mirrors_connected(self) -> bool:
        """Whether the mirrors' controller answered the last time."""
        return (state := self._status.mirrors) is not None and state.connected

    def is_due(self) -> bool:
        """Return whether it is time to read the status again."""
        return self._clock.now_ns() >= self._due_ns

    def refresh(self, rig: AssembledRig) -> None:
        """Read the status of every device now."""
        period_ns = QUIET_PERIOD_NS if self._live.quiet else STATUS_PERIOD_NS
        self._due_ns = self._clock.now_ns() + period_ns
        before, state = self._status.state, self._state()
        problems, rates, gaze = self._reconnector.problems, self._live.rates, self._moves.gaze
        self._status = rig_status(rig, state=state, problems=problems, rates=rates, gaze=gaze)
        self._reconnector.update(rig, self._status)
        self._live.expect(self._status)
        if state is not before:
            self._emit(state)

    def forget(self) -> None:
        """Forget a rig that was closed: another one may be opened."""
        self._status = RigStatus()
        self._emit(self._state())

    def emit_not_open(self) -> None:
        """Emit the event that no rig could be opened."""
        self._emit(RigState.DEGRADED)

    def _state(self) -> RigState:
        if self._moves.halted:
            return RigState.STOPPED
        if self._reconnector.problems:
            return RigState.DEGRADED
        return RigState.READY if self._is_open() else RigState.OPENING

    def _emit(self, state: RigState) -> None:
        level = EventLevel.INFO if state is RigState.READY else EventLevel.WARNING
        devices = [problem.device for problem in self._reconnector.problems]
        data = RigStateChange(state=state.value, devices=devices)
        self._events.emit("rig.state", f"the rig is {state.value}", level=level, data=data)
