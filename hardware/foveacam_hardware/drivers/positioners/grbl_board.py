"""A Grbl board with one to three axes: homing, jogs, holds, alarms, restarts.

Moves are jogs, which stop cleanly. There is no thread: events are processed when `state` is read, and a move
that waits for another to stop begins then. Bearings and rail positions are left to `grbl` and `grbl_rail`,
which may share a board (a hold then stops both), lines and answers to `grbl_session`.
"""

import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from foveacam_hardware.contract import (
    Busy,
    Clock,
    DeviceFault,
    FoveaError,
    InvalidInput,
    NotConnected,
    Timeout,
)
from foveacam_hardware.drivers.positioners.grbl_axes import AxesMove, GrblAxis, feed_per_min
from foveacam_hardware.drivers.positioners.grbl_continuity import has_mark, mark_at, write_mark
from foveacam_hardware.drivers.positioners.grbl_session import GrblSession, LineRefused, SentLine
from foveacam_hardware.drivers.positioners.grbl_start import MOVING, READY, greet
from foveacam_hardware.drivers.positioners.life import Event, Phase, PositionerLife
from foveacam_hardware.wire.grbl import (
    HOME,
    JOG_CANCEL,
    RESET,
    UNLOCK,
    UNLOCKED,
    GrblAlarm,
    GrblOk,
    GrblStatusReport,
    jog,
)
from foveacam_hardware.wire.link import LinkFactory

HOMING_S = 90.0
"""Deadline of homing, during which the board is silent; the full travel takes a fraction of this."""
HELD_NS = 3_000_000_000
"""Deadline of the end of a homing that is held: the board is reset, and greets again."""
RESTART_AND_CONFIRM = "bring it to its zero, switch the board off and on, then confirm that it stands there"
LONG_NS, PAUSE_NS = 1_000_000_000, 10_000_000_000
"""A failed connect longer than `LONG_NS` is not repeated for `PAUSE_NS`: the caller has other devices."""
GARBLED = frozenset({1, 2, 3, 11, 15, 16, 20, 22})
"""Error codes that a damaged line causes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardState:
    """State of a board. `position`: of each axis in order, in its own units; None when not known."""

    connected: bool
    moving: bool
    homed: bool
    position: tuple[float, ...] | None
    fault: str | None
    awaits_zero: bool
    """Whether the operator must confirm its zero."""


class GrblBoard:
    """Moves its axes; `hold` and `state` may be called from any thread, the rest from one at a time.

    Each user connects and closes it under its own name; the last one to close it releases the link.
    """

    def __init__(
        self,
        link_factory: LinkFactory,
        clock: Clock,
        *,
        axes: Sequence[GrblAxis],
        name: str,
        has_switches: bool = True,
    ) -> None:
        self._link_factory = link_factory
        self._clock = clock
        self._axes = {axis.letter: axis for axis in axes}
        self.name = self._name = name
        self.life = PositionerLife(has_switches=has_switches)
        self.version = ""
        self._users: set[str] = set()
        self._lock = threading.RLock()
        self._session: GrblSession | None = None
        self._restarts = 0
        self._dealt_with: GrblAlarm | None = None
        self._mark: int | None = None  # in the board's memory since its position is known
        self._at: tuple[float, ...] | None = None
        self._turning = False  # as last reported
        self._homing: SentLine | None = None
        self._homing_ends_ns = 0
        self._move = AxesMove(self._axes)
        self._pause_ends_ns: int | None = None
        self._hold_sent = threading.Event()  # until an update has dealt with it

    def state(self, user: str) -> BoardState:
        """Query the board and return its state; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._update(self._session)
                except NotConnected as failure:
                    self._lose(str(failure))
                except FoveaError as failure:  # the waiting move was refused
                    self._turning, self.life.fault = False, str(failure)
            used = self.life.connected and user in self._users
            return BoardState(
                connected=used,
                moving=used and self._is_moving,
                homed=used and self.life.homed,
                position=self._at if used and self.life.homed else None,
                fault=self.life.fault,
                awaits_zero=used and self.life.awaits_zero,
            )

    @property
    def _is_moving(self) -> bool:
        return self.life.is_homing or self._turning or self._move.ahead

    def connect(self, user: str) -> None:
        """Open the link, identify the board and check that its travel covers the limits."""
        with self._lock:
            self._users.add(user)
            if self._session is not None and self.state(user).connected:
                return
            began_ns = self._clock.now_ns()
            if self._pause_ends_ns is not None and began_ns < self._pause_ends_ns:
                raise NotConnected(self.life.fault or f"{self._name}: it sent no reply; connect it again")
            session = GrblSession(self._link_factory(), self._clock, name=self._name)
            try:
                self.version = greet(
                    session, list(self._axes.values()), name=self._name, has_switches=self.life.has_switches
                )
                proven = self._mark is not None and has_mark(session, self._mark)
            except FoveaError as failure:
                session.close()
                now_ns = self._clock.now_ns()
                self._pause_ends_ns = now_ns + PAUSE_NS if now_ns - began_ns > LONG_NS else None
                self.life.fault = str(failure)
                raise
            self._pause_ends_ns = None
            self._hold_sent.clear()
            self._session, self._restarts = session, session.restarts
            self._dealt_with = session.alarm
            self._apply(Event.PROVEN if proven else Event.CONNECTED)

    def close(self, user: str) -> None:
        """Stop, and release the board when it has no other user; do nothing when closed.

        A board that was closed has to be homed again: nobody watched it meanwhile.
        """
        with self._lock:
            self._users.discard(user)
            session = self._session
            if session is not None:
                with suppress(NotConnected):
                    session.realtime(RESET if self.life.is_homing else JOG_CANCEL)
            if self._users:
                self._hold_sent.set()
                return
            self._lose(None)
            self._mark = self._pause_ends_ns = None

    def home(self, user: str) -> None:
        """Begin to search for the reference switches; when found, every axis moves to its rest position."""
        with self._lock:
            session = self._updated_session(user)
            if self._is_moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            if not self.life.has_switches:
                raise DeviceFault(
                    f"{self._name}: asked to home, but it has no reference switches; {self.life.remedy}"
                )
            self._hold_sent.clear()  # it was at rest
            self._clear_alarm(session)
            self._apply(Event.HOMING_BEGUN)
            self._homing = session.begin(HOME)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)
            if self._hold_sent.is_set():  # by another thread, before the line was sent
                session.realtime(RESET)

    def confirm_zero(self, user: str) -> None:
        """Accept the operator's confirmation that every axis is at its zero."""
        with self._lock:
            session = self._updated_session(user)
            if self.life.has_switches:
                raise InvalidInput(
                    f"{self._name}: asked to take where it stands for its zero, but it has reference"
                    " switches; home it"
                )
            if self._is_moving:
                raise Busy(
                    f"{self._name}: asked to take where it stands for its zero while it moves; hold it"
                )
            position = self._position_at_zero(session)
            self._begin_mark(session)
            self._apply(Event.ZERO_CONFIRMED)
            self._at = position

    def move_to(self, user: str, goals: Mapping[str, float]) -> None:
        """Begin to move axes, by their letters; the other axes keep their goals."""
        with self._lock:
            session = self._updated_session(user)
            if self.life.is_homing:
                raise Busy(
                    f"{self._name}: asked to move while it looks for its switches; wait until it rests"
                )
            if not self.life.homed:
                unknown = f"{self._name}: it does not know where it stands; {self.life.remedy}"
                raise DeviceFault(f"{self.life.fault or unknown} (asked to move)")
            self.life.fault = None
            moving = self._is_moving
            self._move.plan(goals)
            if moving:
                session.realtime(JOG_CANCEL)
            else:
                self._begin(session)

    def hold(self, user: str) -> None:
        """Stop moving now; an interrupted homing has to be repeated."""
        session = self._session
        if session is None or user not in self._users:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._hold_sent.set()
        session.realtime(RESET if self.life.is_homing else JOG_CANCEL)

    def _updated_session(self, user: str) -> GrblSession:
        """Update the state and return the session; raise `NotConnected` when it is gone."""
        if self._session is None or user not in self._users:
            why = self.life.fault or f"{self._name}: it is not connected"
            raise NotConnected(f"{why}; connect it again")
        try:
            self._update(self._session)
        except NotConnected as failure:
            self._lose(str(failure))
            raise
        return self._session

    def _update(self, session: GrblSession) -> None:
        """Process the events since the last update, and begin a waiting move."""
        if self._homing is not None and not self._check_homing(session, self._homing):
            return
        report = session.report()
        position = session.position(report)
        if position is None or report.state not in READY | MOVING or report.state == "Alarm":
            self._lose_position(session, report)
            return
        if session.restarts != self._restarts:
            self._lose_position(session, report)
            return
        if not self._is_proven(session):
            self._lose_position(session, report, proven=False)
            return
        if self._hold_sent.is_set():
            self._hold_sent.clear()
            self._move.end()
            if report.state in MOVING:  # the hold may have come before the line of the move
                session.realtime(JOG_CANCEL)
        self._at, self._turning = position, report.state in MOVING
        if self._move.waits and not self._turning:
            self._begin(session)
            report = session.report()
            self._at, self._turning = session.position(report) or position, report.state in MOVING
        trouble = self._move.trouble(self._at, moving=self._turning, t_ns=self._clock.now_ns())
        if trouble is not None:
            self.life.fault = f"{self._name}: {trouble}"
            session.realtime(JOG_CANCEL)

    def _check_homing(self, session: GrblSession, sent: SentLine) -> bool:
        """Return whether homing has succeeded; record the reason when it failed."""
        session.listen()
        if self._hold_sent.is_set():
            self._hold_sent.clear()
            self.life.apply(Event.HOLD)
            self._homing_ends_ns = min(self._homing_ends_ns, self._clock.now_ns() + HELD_NS)
        why: object = session.alarm or sent.answer
        if why is None and not sent.lost:
            if self._clock.now_ns() <= self._homing_ends_ns:
                return False
            session.realtime(RESET)
            why = f"no switch was found within {HOMING_S:g} s"
        held = self.life.phase is Phase.HELD  # then a reset was sent
        self._restarts, self._dealt_with = session.restarts, session.alarm
        if UNLOCKED in sent.messages:  # the line was damaged
            why = "it took the command for another one"
        elif isinstance(sent.answer, GrblOk) and session.alarm is None and not held:
            self._begin_mark(session)
            self._apply(Event.HOMING_DONE)
            self._move.plan({axis.letter: axis.rest for axis in self._axes.values()})
            return True
        failed = f"{self._name}: homing failed ({why or 'it restarted'}); look at it, home again"
        self._apply(Event.HOMING_FAILED, fault=None if held else failed)
        return False

    def _begin_mark(self, session: GrblSession) -> None:
        """Store a mark in the board's memory, whose loss shows that the board has restarted."""
        mark = mark_at(self._clock.now_ns())
        write_mark(session, mark)
        self._mark = mark
        session.may_have_restarted = False

    def _is_proven(self, session: GrblSession) -> bool:
        """Return whether a board of known position has kept it; read its mark if it may have restarted."""
        if self.life.homed and session.may_have_restarted:
            if self._mark is None or not has_mark(session, self._mark):
                return False
            session.may_have_restarted = False
        return True

    def _position_at_zero(self, session: GrblSession) -> tuple[float, ...]:
        """Return the position of a board at rest that counts zero; raise `DeviceFault` otherwise."""
        report = session.report()
        position = session.position(report)
        counted = "nothing"
        if position is not None:
            counts = {axis.letter: position[axis.index] for axis in self._axes.values()}
            at_zero = all(abs(at) <= self._axes[letter].arrived for letter, at in counts.items())
            if at_zero and report.state in READY:
                if report.state == "Alarm":
                    session.ask(UNLOCK)
                return position
            counted = ", ".join(f"{letter} {at:g}" for letter, at in counts.items())
        raise DeviceFault(
            f"{self._name}: asked to take where it stands for its zero, but it is in state {report.state} and"
            f" counts {counted}; bring it to its zero, switch the board off and on, then confirm again"
        )

    def _lose_position(self, session: GrblSession, report: GrblStatusReport, *, proven: bool = True) -> None:
        """Mark the position as lost, if it was known, and record why."""
        restarted = session.restarts != self._restarts or not proven
        alarm = None if session.alarm is self._dealt_with else session.alarm
        self._restarts, self._dealt_with, self._turning = session.restarts, session.alarm, False
        event, why = Event.ALARMED, str(alarm)
        if report.state not in READY | MOVING:
            why = f"it is in state {report.state}: release it at the board"
        elif alarm is None:
            if not self.life.homed:
                return
            event = Event.RESTARTED if restarted else Event.ALARMED
            why = "it restarted by itself" if restarted else "it is in alarm"
        again = "home it again"
        if not self.life.has_switches:
            again = self.life.remedy if restarted else RESTART_AND_CONFIRM
        self._apply(event, fault=f"{self._name}: {why}; {again}")

    def _begin(self, session: GrblSession) -> None:
        """Send the waiting move; repeat it once when the line was damaged."""
        goals = self._move.goals
        line = jog(goals, feed_per_min=feed_per_min(self._axes, goals, position=self._at))
        self._move.end()
        try:
            session.ask(line)
        except LineRefused as refusal:
            if refusal.reason.code not in GARBLED:
                raise
            session.ask(line)
        except Timeout:
            if session.report().state not in MOVING:  # else it was accepted and the answer was lost
                session.end_line()
                session.ask(line)
        self._move.begin(goals, t_ns=self._clock.now_ns())
        if self._hold_sent.is_set():  # by another thread, before the line was sent
            session.realtime(JOG_CANCEL)

    def _clear_alarm(self, session: GrblSession) -> None:
        """Clear an alarm by a reset, which some alarms require; leave a hold that was set at the board."""
        state = session.report().state
        if state not in READY | MOVING:
            raise DeviceFault(f"{self._name}: asked to home in state {state}; release it at the board first")
        if session.alarm is not None or state == "Alarm":
            session.reset()
            session.report()
            self._restarts = session.restarts

    def _apply(self, event: Event, *, fault: str | None = None) -> None:
        """Go to the phase after an event; forget what is no longer so."""
        self.life.apply(event, fault=fault)
        if not self.life.is_homing:
            self._homing = None
        if not self.life.homed:
            self._at, self._turning = None, False
            self._move.end()
            if self.life.connected:  # after a lost link the mark shows whether it restarted
                self._mark = None

    def _lose(self, fault: str | None) -> None:
        """Release the link."""
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._apply(Event.LINK_LOST, fault=fault)
