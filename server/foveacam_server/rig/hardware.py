"""The thread that owns every device: it runs commands, then live views, then reconnects missing devices.

All other threads enqueue work and await its result. Two bypass the queue: the stop, to park, and steering by
hand, whose updates no look may delay.
"""

import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TypeVar

from foveacam_hardware.contract import (
    PARKED,
    Clock,
    FoveaError,
    Frame,
    Head,
    NotConnected,
    OneEyedHead,
    Role,
    Sighting,
    StereoVolts,
)
from foveacam_hardware.contract.spans import span
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import HARDWARE, MIRRORS, count_flow
from foveacam_server.rig import refusals
from foveacam_server.rig.device_reconnector import FOVEAE, WIDE, DeviceReconnector, MirrorLinkMonitor
from foveacam_server.rig.exclusive_use import ExclusiveUse
from foveacam_server.rig.hand_steering import HandSteering
from foveacam_server.rig.hardware_commands import CommandQueue, ExclusiveHead
from foveacam_server.rig.live_views import LIVE_AGE_MS, LiveRates, LiveViews, OverlayOf
from foveacam_server.rig.opening_steps import RigOpening
from foveacam_server.rig.ports import AssembledRig, CameraKeeper, PictureSink
from foveacam_server.rig.schema import RigStateChange
from foveacam_server.rig.status import RigState, RigStatus, rig_status
from foveacam_server.rig.stop import bring_to_rest

_log = logging.getLogger(__name__)
T = TypeVar("T")

STATUS_PERIOD_NS = 250_000_000
REOPENED_S = 60.0
"""Longest that somebody waits for another rig to open; its devices that are missing take seconds each."""
REOPEN_POLL_S = 0.1


class HardwareThread:
    """Owns the rig. `start` returns at once; the thread then opens the rig with the devices that answer."""

    def __init__(
        self,
        opener: Callable[[], AssembledRig],
        *,
        sink: PictureSink,
        events: EventLog,
        clock: Clock,
        overlay: OverlayOf,
        limits: LiveRates,
        keeper: CameraKeeper | None = None,
    ) -> None:
        self._events = events
        self._clock = clock
        self._live = LiveViews(sink=sink, clock=clock, limits=limits, overlay=overlay)
        self._reconnector = DeviceReconnector(clock=clock, events=events, keeper=keeper)
        self.mirrors = MirrorLinkMonitor(clock=clock, reconnector=self._reconnector)
        """Pings their controller and switches their supply rail."""
        self.opening = RigOpening(opener, self._reconnector, clock=clock)
        """Opens the rig step by step."""
        self.commands = CommandQueue()
        """What waits for the thread, and how long it has had nothing to do."""
        self._rig: AssembledRig | None = None
        self._status = RigStatus()
        self._status_due_ns = 0
        self._gaze = PARKED
        self._opened = threading.Event()
        self._halted = threading.Event()
        self._closing = threading.Event()
        self._reopening = threading.Event()
        self._use = ExclusiveUse()
        self.hand = HandSteering(
            clock=clock,
            mirrors=lambda: self._opened_rig().mirrors,
            check=lambda: self._check_free("steer by hand", one_eyed=True),
            park=self._park_if,
            on_pose=self._keep_pose,
            events=events,
        )
        """Steers both mirrors by hand, update after update, while no job has the rig."""
        self._thread = threading.Thread(target=self._run, name=HARDWARE, daemon=True)

    # Called from other threads -----------------------------------------------------------------------------

    def start(self) -> None:
        """Begin to open the rig."""
        self._thread.start()
        self.hand.start()

    def close(self) -> None:
        """Park, release every device, end the thread."""
        self.hand.close()
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(timeout=15.0)

    @property
    def status(self) -> RigStatus:
        """The rig's last status, with the state and the problems of this moment."""
        return replace(self._status, state=self._state(), problems=self._reconnector.problems)

    @property
    def gaze(self) -> StereoVolts:
        """The mirrors' last commanded volts."""
        return self._gaze

    @property
    def pose(self) -> StereoVolts | None:
        """The mirrors' volts; None while they are unknown because the controller is not connected."""
        state = self._status.mirrors
        return self._gaze if state is not None and state.connected else None

    @property
    def halted(self) -> bool:
        """Whether the stop is engaged."""
        return self._halted.is_set()

    @property
    def busy_with(self) -> str | None:
        """Name of the work that has the rig exclusively."""
        return self._use.holder

    @property
    def used_exclusively(self) -> bool:
        """Whether a job that gives no way has the rig: its looks come before everything that can wait."""
        return self._use.firm

    @property
    def session_wanted(self) -> bool:
        """Whether a job waits for the rig; who follows targets gives it away then."""
        return self._use.wanted

    def wait_open(self, timeout_s: float) -> bool:
        """Wait until the rig has been opened as far as it can be."""
        return self._opened.wait(timeout_s)

    def reopen(self, holder: str) -> None:
        """Close the rig, open the one that the opener returns now, and wait until it is open.

        Raise `Busy` while a job has the rig or somebody steers it, or while it is still opening.
        """
        with self._use.hold(holder, asked="open another rig"):
            self.hand.take_over("open another rig")
            if not self._opened.is_set():
                raise refusals.in_use("open another rig", "the start")
            self._opened.clear()
            self._reopening.set()
            if not self._opened.wait(REOPENED_S):
                raise refusals.late_opening(REOPENED_S)

    def submit(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue `work`; raise `NotConnected` or `Busy` at once."""
        if self._rig is None or self._closing.is_set():
            raise refusals.not_open(self._reconnector.problems)
        return self.commands.put(work)

    def look(
        self, volts: StereoVolts, *, settle_us: int | None = None, one_eyed: bool = False
    ) -> "Future[Sighting]":
        """Enqueue one look; its frames feed the views. `one_eyed`: the camera of one fovea may be missing."""
        self.check_may_move(one_eyed=one_eyed)
        return self.submit(lambda rig: self._look(rig, volts, settle_us=settle_us, one_eyed=one_eyed))

    def expose(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue work that steers and exposes by itself; raise as `look`."""
        self.check_may_move()
        return self.submit(lambda rig: self._expose(rig, work))

    def wide_frame(self, *, max_age_ms: float) -> "Future[Frame]":
        """Enqueue one wide frame."""
        return self.submit(lambda rig: self._wide(rig, max_age_ms))

    def steer(self, volts: StereoVolts) -> "Future[StereoVolts]":
        """Enqueue a move of both mirrors; raise `Stopped`, or `Busy` while a job or a hand has them."""
        self._check_free("steer")
        self.hand.take_over("steer")
        return self.submit(lambda rig: self._steer(rig, volts))

    def park(self) -> "Future[None]":
        """Enqueue that both mirrors are brought to rest; raise `Busy` while a job or a hand has them."""
        if self._use.holder is not None:
            raise refusals.in_use("park the mirrors", self._use.holder)
        self.hand.take_over("park the mirrors")
        return self._park_if(lambda: True)

    def _check_free(self, asked: str, *, one_eyed: bool = False) -> None:
        self.check_may_move(one_eyed=one_eyed)
        if self._use.holder is not None:
            raise refusals.in_use(asked, self._use.holder)

    def _opened_rig(self) -> AssembledRig:
        if self._rig is None:
            raise refusals.not_open(self._reconnector.problems)
        return self._rig

    def check_may_move(self, *, one_eyed: bool = False) -> None:
        """Raise `Stopped` or `NotConnected` when the mirrors cannot move now.

        `one_eyed`: whether the camera of one fovea may be missing.
        """
        if self._halted.is_set():
            raise refusals.stopped()
        rig = self._opened_rig()
        self.mirrors.check()
        missing = self._reconnector.problem_of(*(self._reconnector.needed(rig) if one_eyed else FOVEAE))
        if missing is not None:
            raise refusals.missing(missing)

    def recent_wide(self, seq: int) -> Frame | None:
        """Return the wide frame that viewers know by a number, or the last before it; None if it is gone."""
        return self._live.recent_wide.find(seq)

    def wide_since(self, t_ns: int) -> list[Frame]:
        """Return the recent wide frames of a time and after it, oldest first."""
        return self._live.recent_wide.since(t_ns)

    @contextmanager
    def session(
        self,
        holder: str,
        *,
        cancelled: Callable[[], bool],
        one_eyed: bool = False,
        gives_way: bool = False,
    ) -> Iterator[Head]:
        """Give one job the rig exclusively: live looks pause, the job's own looks feed the views.

        Raise `Busy` when a job has it that does not give way. `one_eyed`: whether the camera of one fovea may
        be missing. `gives_way`: it ends soon when `session_wanted`.
        """
        with self._use.hold(holder, asked=f"give the rig to {holder}", gives_way=gives_way):
            self.hand.make_way(f"{holder} uses the rig")
            yield ExclusiveHead(self, cancelled=cancelled, one_eyed=one_eyed)

    # The stop: from any thread, without the queue ----------------------------------------------------------

    def halt(self) -> bool:
        """Refuse every move from now on, hold and park at once; return whether the mirrors confirmed."""
        self._halted.set()
        self._gaze = PARKED
        rig = self._rig
        return rig is not None and bring_to_rest(rig)

    def hold_pan_tilt(self) -> None:
        """Stop the pan-tilt now, if there is one."""
        if (rig := self._rig) is not None and rig.pan_tilt is not None:
            rig.pan_tilt.hold()

    def resume(self) -> None:
        """Allow moves again; the mirrors stay where they are."""
        self._halted.clear()

    # Inside the thread -------------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._closing.is_set():
            self._reopening.clear()
            rig = self._open()
            try:
                while not (self._closing.is_set() or self._reopening.is_set()):
                    if rig is None:
                        self._closing.wait(REOPEN_POLL_S)
                    else:
                        self._run_cycle(rig)
            finally:
                self._close_rig(rig)

    def _close_rig(self, rig: AssembledRig | None) -> None:
        self._rig = None
        self.commands.refuse_all(NotConnected("the rig is being closed; try again in a moment"))
        if rig is not None:
            rig.close()
        if self._closing.is_set():
            return
        self._reconnector.forget()
        self._status = RigStatus()
        self._gaze = PARKED
        self.opening.steps.begin()
        self._emit_state(self._state())

    def _open(self) -> AssembledRig | None:
        rig = self.opening.open()
        if rig is None:
            self._opened.set()
            self._emit_state(RigState.DEGRADED)
            return None
        self._rig = rig
        self.refresh(rig)  # before others are notified
        self._opened.set()
        self.refresh(rig)
        return rig

    def _run_cycle(self, rig: AssembledRig) -> None:
        looks, wide = self._looks_allowed(rig), self._reconnector.problem_of(WIDE) is None
        command = self.commands.take(timeout_s=self._live.wait_s(wide=wide, looks=looks))
        if command is not None:
            command.run(rig)
        elif looks and self._live.look_due():
            self._try("live look", lambda: self._look(rig, self._gaze, one_eyed=True))
        if wide and self._live.wide_due():
            self._try("live wide frame", lambda: self._wide(rig, LIVE_AGE_MS))
        self.mirrors.ping_if_due(rig)
        if self._reconnector.cameras_lost(rig):
            self._park(rig)
        if self._reconnector.retry_due():
            self._reconnect(rig)
        if self._clock.now_ns() >= self._status_due_ns:
            self.refresh(rig)

    def _looks_allowed(self, rig: AssembledRig) -> bool:
        idle = not self._halted.is_set() and self._use.holder is None and self.mirrors.rail_wanted
        return idle and self._reconnector.problem_of(*self._reconnector.needed(rig)) is None

    def _try(self, what: str, work: Callable[[], object]) -> None:
        try:
            work()
        except FoveaError as error:
            _log.debug("%s: %s", what, error)  # the reconnector has reported it

    def _look(
        self, rig: AssembledRig, volts: StereoVolts, *, settle_us: int | None = None, one_eyed: bool = False
    ) -> Sighting:
        self._live.start_look_period()
        lost = self._reconnector.fovea_lost(rig) if one_eyed else None
        look = rig.head.look
        if lost is not None and isinstance(rig.head, OneEyedHead):
            look = partial(rig.head.look_without, lost)
        with timings.LOOK.time(), span("look"):
            sighting = self._exposed(rig, lambda: look(volts, settle_us=settle_us), missing=lost)
        if not self._halted.is_set():
            self._gaze = sighting.volts if rig.replayed else rig.mirrors.state.volts
        self._live.show_sighting(sighting, in_session=self._use.holder is not None)
        return sighting

    def _expose(self, rig: AssembledRig, work: Callable[[AssembledRig], T]) -> T:
        with span("exposure"):
            found = self._exposed(rig, lambda: work(rig))
        if not self._halted.is_set():
            self._gaze = rig.mirrors.state.volts
        return found

    def _exposed(self, rig: AssembledRig, look: Callable[[], T], *, missing: Role | None = None) -> T:
        """Run a look; on an error record which device failed; park again when the stop came meanwhile."""
        count_flow(HARDWARE, MIRRORS, "moves")
        try:
            found = look()
        except FoveaError as error:
            self._reconnector.look_failed(rig, error, exposing=True)
            raise
        finally:
            self._park_again_if_halted(rig)
        self._reconnector.look_succeeded(missing=missing)
        return found

    def _wide(self, rig: AssembledRig, max_age_ms: float) -> Frame:
        self._live.start_wide_period(in_session=self._use.holder is not None)
        try:
            frame = self._live.show_wide(rig, gaze=self.pose, max_age_ms=max_age_ms)
        except FoveaError as error:
            self._reconnector.wide_failed(error)
            raise
        self._reconnector.wide_succeeded()
        return frame

    def _steer(self, rig: AssembledRig, volts: StereoVolts) -> StereoVolts:
        self.check_may_move()
        count_flow(HARDWARE, MIRRORS, "moves")
        try:
            with span("mirrors.steer"):
                self._gaze = rig.mirrors.steer(volts)
        except FoveaError as error:
            self._reconnector.look_failed(rig, error)
            raise
        finally:
            self._park_again_if_halted(rig)
        return self._gaze

    def _park_again_if_halted(self, rig: AssembledRig) -> None:
        if self._halted.is_set():  # the stop came between a move's check and its command on the wire
            self._park(rig)

    def _park_if(self, wanted: Callable[[], bool]) -> "Future[None]":
        return self.submit(lambda rig: self._park(rig) if wanted() else None)

    def _keep_pose(self, volts: StereoVolts) -> None:
        """Take over where steering by hand has sent the mirrors; a stop that comes meanwhile wins."""
        self._gaze = volts
        if self._halted.is_set():
            self._gaze = PARKED

    def _park(self, rig: AssembledRig) -> None:
        self._gaze = PARKED
        self._try("park", rig.mirrors.park)

    def _reconnect(self, rig: AssembledRig) -> None:
        if self._reconnector.connect(rig):  # and parked
            self._gaze = PARKED
        self.refresh(rig)

    def refresh(self, rig: AssembledRig) -> None:
        """Read the status of every device now; in this thread alone."""
        self._status_due_ns = self._clock.now_ns() + STATUS_PERIOD_NS
        before, state = self._status.state, self._state()
        problems, rates, gaze = self._reconnector.problems, self._live.rates, self._gaze
        self._status = rig_status(rig, state=state, problems=problems, rates=rates, gaze=gaze)
        self._reconnector.update(rig, self._status)
        if state is not before:
            self._emit_state(state)

    def _state(self) -> RigState:
        if self._halted.is_set():
            return RigState.STOPPED
        if self._reconnector.problems:
            return RigState.DEGRADED
        return RigState.READY if self._opened.is_set() else RigState.OPENING

    def _emit_state(self, state: RigState) -> None:
        level = EventLevel.INFO if state is RigState.READY else EventLevel.WARNING
        devices = [problem.device for problem in self._reconnector.problems]
        data = RigStateChange(state=state.value, devices=devices)
        self._events.emit("rig.state", f"the rig is {state.value}", level=level, data=data)
