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
from foveacam_hardware.drivers.positioners.grbl_session import GrblSession, LineRefused, SentLine
from foveacam_hardware.drivers.positioners.grbl_start import MOVING, READY, greet
from foveacam_hardware.wire.grbl import HOME, JOG_CANCEL, RESET, GrblAlarm, GrblOk, GrblStatusReport, jog
from foveacam_hardware.wire.link import LinkFactory

HOMING_S = 90.0
"""Deadline of homing, during which the board is silent; the full travel takes a fraction of this."""
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
        self.has_switches = has_switches
        self.version = ""
        self._users: set[str] = set()
        self._lock = threading.RLock()
        self._session: GrblSession | None = None
        self._restarts = 0
        self._dealt_with: GrblAlarm | None = None
        self._homed = False
        self._moving = False
        self._position: tuple[float, ...] | None = None
        self._fault: str | None = None
        self._homing: SentLine | None = None
        self._homing_ends_ns = 0
        self._move = AxesMove(self._axes)
        self._pause_ends_ns: int | None = None
        self._held = threading.Event()

    def state(self, user: str) -> BoardState:
        """Query the board and return its state; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._update(self._session)
                except NotConnected as failure:
                    self._lose(str(failure))
                except FoveaError as failure:  # the waiting move was refused
                    self._moving, self._fault = False, str(failure)
            used = self._session is not None and user in self._users
            return BoardState(
                connected=used,
                moving=used and self._moving,
                homed=used and self._homed,
                position=self._position if used and self._homed else None,
                fault=self._fault,
                awaits_zero=used and not (self.has_switches or self._homed),
            )

    def connect(self, user: str) -> None:
        """Open the link, identify the board and check that its travel covers the limits."""
        with self._lock:
            self._users.add(user)
            if self._session is not None and self.state(user).connected:
                return
            began_ns = self._clock.now_ns()
            if self._pause_ends_ns is not None and began_ns < self._pause_ends_ns:
                raise NotConnected(self._fault or f"{self._name}: it said nothing; connect it again")
            session = GrblSession(self._link_factory(), self._clock, name=self._name)
            try:
                self.version = greet(
                    session, list(self._axes.values()), name=self._name, has_switches=self.has_switches
                )
            except FoveaError as failure:
                session.close()
                now_ns = self._clock.now_ns()
                self._pause_ends_ns = now_ns + PAUSE_NS if now_ns - began_ns > LONG_NS else None
                self._reset_state(str(failure))
                raise
            self._pause_ends_ns = None
            self._reset_state(None)
            self._session, self._restarts = session, session.restarts
            self._homed = not self.has_switches
            self._held.clear()

    def close(self, user: str) -> None:
        """Stop, and release the board when it has no other user; do nothing when closed."""
        with self._lock:
            self._users.discard(user)
            session = self._session
            if session is not None:
                with suppress(NotConnected):
                    session.realtime(JOG_CANCEL if self._homing is None else RESET)
            if self._users:
                self._held.set()
                return
            self._session = self._pause_ends_ns = None
            if session is not None:
                session.close()
            self._reset_state(None)

    def home(self, user: str) -> None:
        """Begin to search for the reference switches; when found, every axis moves to its rest position."""
        with self._lock:
            session = self._updated_session(user)
            if self._moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            if not self.has_switches:
                raise DeviceFault(
                    f"{self._name}: asked to home, but it has no reference switches; move it to its zero"
                )
            self._clear_alarm(session)
            self._reset_state(None)
            self._homing = session.begin(HOME)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)
            self._moving = True

    def confirm_zero(self, user: str) -> None:
        """Accept the operator's confirmation that every axis is at its zero."""
        with self._lock:
            session = self._updated_session(user)
            if self.has_switches:
                raise InvalidInput(
                    f"{self._name}: asked to take where it stands for its zero, but it has reference"
                    " switches; home it"
                )
            if self._moving:
                raise Busy(
                    f"{self._name}: asked to take where it stands for its zero while it moves; hold it"
                )
            position = self._position_at_zero(session)
            self._reset_state(None)
            self._homed, self._position = True, position

    def move_to(self, user: str, goals: Mapping[str, float]) -> None:
        """Begin to move axes, by their letters; the other axes keep their goals."""
        with self._lock:
            session = self._updated_session(user)
            if self._homing is not None:
                raise Busy(
                    f"{self._name}: asked to move while it looks for its switches; wait until it rests"
                )
            if not self._homed:
                found = self._fault or f"{self._name}: it does not know where it stands; home it first"
                raise DeviceFault(f"{found} (asked to move)")
            self._fault = None
            self._move.plan(goals)
            if self._moving:
                session.realtime(JOG_CANCEL)
            else:
                self._begin(session)
            self._moving = True

    def hold(self, user: str) -> None:
        """Stop moving now; an interrupted homing has to be repeated."""
        session = self._session
        if session is None or user not in self._users:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._held.set()
        session.realtime(JOG_CANCEL if self._homing is None else RESET)

    def _updated_session(self, user: str) -> GrblSession:
        """Update the state and return the session; raise `NotConnected` when it is gone."""
        if self._session is None or user not in self._users:
            why = self._fault or f"{self._name}: it is not connected"
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
        if (
            report.state not in READY | MOVING
            or report.state == "Alarm"
            or session.restarts != self._restarts
        ):
            self._lose_position(session, report)
            return
        if self._held.is_set():
            self._held.clear()
            self._move.end()
        self._position = session.position(report)
        if self._move.waits and report.state not in MOVING:
            self._begin(session)
            report = session.report()
            self._position = session.position(report)
        moving = report.state in MOVING
        trouble = self._move.trouble(self._position, moving=moving, t_ns=self._clock.now_ns())
        if trouble is not None:
            self._fault = f"{self._name}: {trouble}"
            session.realtime(JOG_CANCEL)
        self._moving = self._move.ahead or moving

    def _check_homing(self, session: GrblSession, sent: SentLine) -> bool:
        """Return whether homing has succeeded; record the reason when it failed."""
        session.listen()
        if sent.answer is None and not sent.lost and session.alarm is None:
            if self._clock.now_ns() > self._homing_ends_ns:
                session.realtime(RESET)
                self._reset_state(
                    f"{self._name}: no switch was found within {HOMING_S:g} s; look at it, home again"
                )
            return False
        held = self._held.is_set()
        self._held.clear()
        found = isinstance(sent.answer, GrblOk) and not held  # with a hold, a reset has been sent
        why = session.alarm or sent.answer or "it restarted"
        self._reset_state(
            None if found or held else f"{self._name}: homing failed ({why}); look at it, home again"
        )
        self._restarts, self._dealt_with = session.restarts, session.alarm
        if found:
            self._homed = True
            self._move.plan({axis.letter: axis.rest for axis in self._axes.values()})
        return found

    def _position_at_zero(self, session: GrblSession) -> tuple[float, ...]:
        """Return the position of a board at rest that counts zero; raise `DeviceFault` otherwise."""
        report = session.report()
        position = session.position(report)
        counted = {axis.letter: position[axis.index] for axis in self._axes.values()}
        away = any(abs(at) > self._axes[letter].arrived for letter, at in counted.items())
        if report.state == "Idle" and not away:
            return position
        counts = ", ".join(f"{letter} {at:g}" for letter, at in counted.items())
        raise DeviceFault(
            f"{self._name}: asked to take where it stands for its zero, but it is in state {report.state} and"
            f" counts {counts}; bring it to its zero, switch the board off and on, then confirm again"
        )

    def _lose_position(self, session: GrblSession, report: GrblStatusReport) -> None:
        """Mark the position as lost and record why."""
        restarted, self._restarts = session.restarts != self._restarts and self._homed, session.restarts
        why: object = None if session.alarm is self._dealt_with else session.alarm
        if report.state not in READY | MOVING:
            why = f"it is in state {report.state}: release it at the board"
        elif why is None and restarted:
            why = "it restarted by itself"
        elif why is None and self._homed:
            why = "it is in alarm"
        again = "home it again"
        if not self.has_switches:
            first = (
                "bring it to its zero" if restarted else "bring it to its zero, switch the board off and on"
            )
            again = f"{first}, then confirm that it stands there"
        self._dealt_with = session.alarm
        self._reset_state(self._fault if why is None else f"{self._name}: {why}; {again}")

    def _begin(self, session: GrblSession) -> None:
        """Send the waiting move; repeat it once when the line was damaged."""
        goals = self._move.goals
        line = jog(goals, feed_per_min=feed_per_min(self._axes, goals, position=self._position))
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

    def _clear_alarm(self, session: GrblSession) -> None:
        """Clear an alarm by a reset, which some alarms require."""
        if session.alarm is not None or session.report().state == "Alarm":
            session.reset()
            session.report()
            self._restarts = session.restarts

    def _reset_state(self, fault: str | None) -> None:
        """Reset the state to an unknown position, with an optional fault."""
        self._homed = self._moving = False
        self._homing = self._position = None
        self._move.end()
        self._fault = fault

    def _lose(self, fault: str) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._reset_state(fault)
