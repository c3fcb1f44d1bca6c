"""The thread that owns every device: it runs commands, then live views, then reconnects missing devices.

All other threads enqueue work and await its result. Two bypass the queue: the stop, to park, and steering by
hand, whose updates no look may delay.
"""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from typing import TypeVar

from foveacam_hardware.contract import (
    PARKED,
    AheadHead,
    Binning,
    Busy,
    Clock,
    Frame,
    LookOptions,
    NotConnected,
    StereoVolts,
)
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.watching.flows import HARDWARE
from foveacam_server.rig import refusals
from foveacam_server.rig.device_reconnector import WIDE, DeviceReconnector, MirrorLinkMonitor
from foveacam_server.rig.hand_steering import HandSteering
from foveacam_server.rig.hardware_commands import CommandQueue, ExclusiveHead, answer_of
from foveacam_server.rig.hardware_thread.binning import RigBinning
from foveacam_server.rig.hardware_thread.kernel_preparation import Preparation
from foveacam_server.rig.hardware_thread.move_guard import ExclusiveUse, MoveGuard
from foveacam_server.rig.hardware_thread.moves import RigMoves, without_failing
from foveacam_server.rig.hardware_thread.opening_steps import RigOpening
from foveacam_server.rig.hardware_thread.status_reading import StatusReading
from foveacam_server.rig.live_views import LIVE_AGE_MS, LiveRates, LiveViews, OverlayOf
from foveacam_server.rig.loop_lag import never_blocked
from foveacam_server.rig.ports import AssembledRig, CameraKeeper, PictureSink
from foveacam_server.rig.status import RigStatus
from foveacam_server.rig.stop import bring_to_rest

T = TypeVar("T")

REOPENED_S = 60.0
"""Timeout of opening another rig; each missing device takes seconds."""
REOPEN_POLL_S = 0.1
LIVE_LOOK = LookOptions(one_eyed=True)
SWITCHED_S = 10.0
"""Timeout of changing the cameras' binning: stop, set, start."""


class HardwareThread:
    """The thread that owns the rig.

    `start` returns at once; the thread then opens the rig with the devices that answer.
    """

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
        prepare: Preparation | None = None,
        blocked_ns: Callable[[], int] = never_blocked,
    ) -> None:
        """`prepare`: as for `RigOpening`; `blocked_ns`: as for `HandSteering`."""
        self._closing = threading.Event()
        self._live = LiveViews(sink=sink, clock=clock, limits=limits, overlay=overlay)
        self.recent_wide = self._live.recent_wide
        """The wide frames that viewers may see at the moment."""
        self._reconnector = DeviceReconnector(clock=clock, events=events, keeper=keeper)
        self.mirrors = MirrorLinkMonitor(clock=clock, reconnector=self._reconnector)
        """Pings the mirrors' controller and switches their supply rail."""
        self.opening = RigOpening(
            opener, self._reconnector, clock=clock, prepare=prepare, cancelled=self._closing.is_set
        )
        """Opens the rig step by step."""
        self.commands = CommandQueue()
        """Commands queued for the thread, and its idle time."""
        self.use = ExclusiveUse()
        """The job that has the rig; one that follows targets yields it when another wants it."""
        self.binning = RigBinning()
        """The binning of the cameras: the rig's own, a session's or a recording's."""
        self._rig: AssembledRig | None = None
        self._opened = threading.Event()
        self._reopening = threading.Event()
        self._moves = RigMoves(
            live=self._live, reconnector=self._reconnector, in_session=lambda: self.use.holder is not None
        )
        self._reading = StatusReading(
            clock=clock,
            events=events,
            reconnector=self._reconnector,
            live=self._live,
            moves=self._moves,
            is_open=lambda: self._opened.is_set(),
        )
        self._guard = MoveGuard(
            lambda: self._rig,
            status=lambda: self.status,
            moves=self._moves,
            mirrors=self.mirrors,
            reconnector=self._reconnector,
            use=self.use,
        )
        self.hand = HandSteering(
            clock=clock,
            mirrors=lambda: self._guard.opened_rig().mirrors,
            check=lambda: self._guard.check_free("steer by hand", one_eyed=True),
            park=self._park_if,
            on_pose=self._moves.keep_gaze,
            events=events,
            blocked_ns=blocked_ns,
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
        return self._reading.status

    @property
    def gaze(self) -> StereoVolts:
        """The mirrors' last commanded volts."""
        return self._moves.gaze

    @property
    def pose(self) -> StereoVolts | None:
        """The mirrors' volts; None while they are unknown because the controller is not connected."""
        return self._moves.gaze if self._reading.mirrors_connected else None

    @property
    def halted(self) -> bool:
        """Whether the stop is engaged."""
        return self._moves.halted

    def wait_open(self, timeout_s: float) -> bool:
        """Wait until the rig has been opened with all devices that answer."""
        return self._opened.wait(timeout_s)

    def reopen(self, holder: str) -> None:
        """Close the rig, open the one that the opener returns now, and wait until it is open.

        Raise `Busy` while a job has the rig or somebody steers it, or while it is still opening.
        """
        with self.use.hold(holder, asked="open another rig"):
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
            raise refusals.not_open(self.status)
        return self.commands.put(work)

    def expose(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue work that steers and exposes by itself; raise as `check_may_move`."""
        self._guard.check()
        return self.submit(lambda rig: self._moves.expose(rig, work))

    def wide_frame(self, *, max_age_ms: float) -> "Future[Frame]":
        """Enqueue one wide frame."""
        return self.submit(lambda rig: self._wide(rig, max_age_ms))

    def steer(self, volts: StereoVolts) -> "Future[StereoVolts]":
        """Enqueue a move of both mirrors; raise `Stopped`, or `Busy` while a job or steering uses them."""
        self._guard.check_free("steer")
        self.hand.take_over("steer")
        return self.submit(lambda rig: self._steer(rig, volts))

    def park(self) -> "Future[None]":
        """Enqueue parking of both mirrors; raise `Busy` while a job or steering uses them."""
        self.use.check_free("park the mirrors")
        self.hand.take_over("park the mirrors")
        return self._park_if(lambda: True)

    def check_open(self) -> None:
        """Raise `NotConnected` while no rig is open."""
        self._guard.opened_rig()

    def check_may_move(self, *, one_eyed: bool = False) -> None:
        """Raise `Stopped` or `NotConnected` when the mirrors cannot move now.

        `one_eyed`: whether the camera of one fovea may be missing.
        """
        self._guard.check(one_eyed=one_eyed)

    @contextmanager
    def session(
        self,
        holder: str,
        *,
        cancelled: Callable[[], bool],
        one_eyed: bool = False,
        gives_way: bool = False,
        binning: Binning | None = None,
    ) -> Iterator[AheadHead]:
        """Give one job the rig exclusively: live looks pause, the job's own looks feed the views.

        Raise `Busy` if its holder does not yield. `one_eyed`: whether the camera of one fovea may be missing.
        `gives_way`: it ends soon when `use.wanted`. `binning`: of its frames, by default the rig's working
        binning at its start; the cameras are switched before its first look and back after its end. Raise a
        camera's error that refuses a requested binning, and `Busy` while a recording keeps another one.
        """
        with (
            self.use.hold(holder, asked=f"give the rig to {holder}", gives_way=gives_way),
            self.binning.session(binning),
        ):
            self.hand.make_way(f"{holder} uses the rig")
            if binning is not None:
                self._switch()
            yield ExclusiveHead(self, self._moves, cancelled=cancelled, one_eyed=one_eyed)

    @contextmanager
    def recorded_at(self, binning: Binning) -> Iterator[None]:
        """Keep one binning while a recording runs, whatever sessions request."""
        with self.binning.recorded(binning):
            self._switch()
            yield

    def choose_binning(self, binning: Binning) -> None:
        """Change the rig's working binning; on a camera's refusal raise its error, and change nothing.

        Following yields the cameras for the switch; another session, or a recording, keeps its own binning
        until it ends.
        """
        with ExitStack() as held:
            if self.use.holder is not None and not self.use.firm:
                with suppress(Busy):  # following has ended, or another job was faster
                    asked = "change the binning"
                    held.enter_context(self.use.hold("the change of the binning", asked=asked))
            answer_of(self.submit(self._choose_binning(binning)), asked="the binning", within_s=SWITCHED_S)

    def _choose_binning(self, binning: Binning) -> Callable[[AssembledRig], None]:
        def work(rig: AssembledRig) -> None:
            self.binning.choose_working(rig, binning)
            self.refresh(rig)

        return work

    def _switch(self) -> None:
        """Switch the cameras to the wanted binning through the thread, and wait for it."""
        if self._rig is not None:
            answer_of(self.submit(self.binning.apply), asked="the binning", within_s=SWITCHED_S)

    # The stop: from any thread, without the queue ----------------------------------------------------------

    def halt(self) -> bool:
        """Refuse all moves from now on, hold and park at once; return whether the mirrors confirmed."""
        self._moves.halt()
        rig = self._rig
        return rig is not None and bring_to_rest(rig)

    def hold_pan_tilt(self) -> None:
        """Stop the pan-tilt now, if there is one."""
        if (rig := self._rig) is not None and rig.pan_tilt is not None:
            rig.pan_tilt.hold()

    def resume(self) -> None:
        """Allow moves again; the mirrors stay where they are."""
        self._moves.resume()

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
        self.binning.forget()
        self._moves.keep_gaze(PARKED)
        self.opening.steps.begin()
        self._reading.forget()

    def _open(self) -> AssembledRig | None:
        rig = self.opening.open()
        if rig is None:
            self._opened.set()
            self._reading.emit_not_open()
            return None
        self._rig = rig
        self.binning.keep(rig)  # before any frame of another size
        self.refresh(rig)  # before others are notified
        self._opened.set()
        self.refresh(rig)
        return rig

    def _run_cycle(self, rig: AssembledRig) -> None:
        looks, wide = self._looks_allowed(rig), self._reconnector.problem_of(WIDE) is None
        command = self.commands.take(timeout_s=self._live.wait_s(wide=wide, looks=looks))
        self.binning.keep(rig)  # changes requested while it waited
        if command is not None:
            self._live.note_use()
            command.run(rig)
        elif looks and self._live.look_due():
            self._run_live("live look", lambda: self._moves.look(rig, self.gaze, options=LIVE_LOOK))
        if wide and self._live.wide_due():
            self._run_live("live wide frame", lambda: self._wide(rig, LIVE_AGE_MS))
        self.mirrors.ping_if_due(rig)
        if self._reconnector.cameras_lost(rig):
            self._moves.park(rig)
        if self._reconnector.retry_due():
            self._reconnect(rig)
        if self._reading.is_due():
            self.refresh(rig)

    def _run_live(self, what: str, work: Callable[[], object]) -> None:
        if not without_failing(what, work):
            self._live.note_use()  # so that the next ones are due soon, and show whether a device is lost

    def _looks_allowed(self, rig: AssembledRig) -> bool:
        idle = not self._moves.halted and self.use.holder is None and self.mirrors.rail_wanted
        return idle and self._reconnector.problem_of(*self._reconnector.needed(rig)) is None

    def _wide(self, rig: AssembledRig, max_age_ms: float) -> Frame:
        return self._moves.wide(rig, gaze=self.pose, max_age_ms=max_age_ms)

    def _steer(self, rig: AssembledRig, volts: StereoVolts) -> StereoVolts:
        self._guard.check()
        return self._moves.steer(rig, volts)

    def _park_if(self, wanted: Callable[[], bool]) -> "Future[None]":
        return self.submit(lambda rig: self._moves.park(rig) if wanted() else None)

    def _reconnect(self, rig: AssembledRig) -> None:
        if self._reconnector.connect(rig):  # and parked
            self._moves.keep_gaze(PARKED)
        self.refresh(rig)

    def refresh(self, rig: AssembledRig) -> None:
        """Read the status of every device now; hardware thread only."""
        self._reading.refresh(rig)
