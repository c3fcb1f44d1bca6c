"""A Grbl board with one to three axes, whatever they move: homing, jogs, holds, alarms, restarts.

Moves are jogs, which stop cleanly. Nothing here has a thread: what goes on is noticed when `state` is read,
and a move that has to wait for another to stop begins then. What the axes stand for is `grbl`'s and
`grbl_rail`'s; they may share a board, and then a hold stops both. Lines and answers are `grbl_session`'s.
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
"""While homing it says nothing at all; the way from end to end takes a fraction of this."""
LONG_NS, PAUSE_NS = 1_000_000_000, 10_000_000_000
"""A connect that took so long in vain is not tried again for a while: whoever waits has other devices."""
GARBLED = frozenset({1, 2, 3, 11, 15, 16, 20, 22})
"""Refusals that a damaged line draws."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardState:
    """What is known of a board. `place`: one axis after the other, in its own units; None: nobody can say."""

    connected: bool
    moving: bool
    homed: bool
    place: tuple[float, ...] | None
    fault: str | None
    awaits_zero: bool
    """Whether the operator's word that it stands at its zero is wanted."""


class GrblBoard:
    """Moves its axes; `hold` and `state` may be called from any thread, the rest from one at a time.

    Whoever uses it connects and closes it under a name of its own: the last to close it releases the link.
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
        self._place: tuple[float, ...] | None = None
        self._fault: str | None = None
        self._homing: SentLine | None = None
        self._homing_ends_ns = 0
        self._journey = AxesMove(self._axes)
        self._pause_ends_ns: int | None = None
        self._held = threading.Event()

    def state(self, user: str) -> BoardState:
        """Ask where it stands; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._look(self._session)
                except NotConnected as failure:
                    self._lose(str(failure))
                except FoveaError as failure:  # the move that waited was refused
                    self._moving, self._fault = False, str(failure)
            used = self._session is not None and user in self._users
            return BoardState(
                connected=used,
                moving=used and self._moving,
                homed=used and self._homed,
                place=self._place if used and self._homed else None,
                fault=self._fault,
                awaits_zero=used and not (self.has_switches or self._homed),
            )

    def connect(self, user: str) -> None:
        """Open the link, check who answers and whether it can move as far as the limits say."""
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
                self._forget(str(failure))
                raise
            self._pause_ends_ns = None
            self._forget(None)
            self._session, self._restarts = session, session.restarts
            self._homed = not self.has_switches
            self._held.clear()

    def close(self, user: str) -> None:
        """Stop, and release it when nobody else uses it; harmless when closed."""
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
            self._forget(None)

    def home(self, user: str) -> None:
        """Begin to look for the reference switches; when they are found, every axis goes to its rest."""
        with self._lock:
            session = self._looked(user)
            if self._moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            if not self.has_switches:
                raise DeviceFault(
                    f"{self._name}: asked to home, but it has no reference switches; move it to its zero"
                )
            self._clear_alarm(session)
            self._forget(None)
            self._homing = session.begin(HOME)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)
            self._moving = True

    def confirm_zero(self, user: str) -> None:
        """Take the operator's word that every axis stands at its zero, where the board counts from."""
        with self._lock:
            session = self._looked(user)
            if self.has_switches:
                raise InvalidInput(
                    f"{self._name}: asked to take where it stands for its zero, but it has reference"
                    " switches; home it"
                )
            if self._moving:
                raise Busy(
                    f"{self._name}: asked to take where it stands for its zero while it moves; hold it"
                )
            place = self._place_at_zero(session)
            self._forget(None)
            self._homed, self._place = True, place

    def move_to(self, user: str, goals: Mapping[str, float]) -> None:
        """Begin to move axes, by their letters; what the others were on their way to stays their goal."""
        with self._lock:
            session = self._looked(user)
            if self._homing is not None:
                raise Busy(
                    f"{self._name}: asked to move while it looks for its switches; wait until it rests"
                )
            if not self._homed:
                found = self._fault or f"{self._name}: it does not know where it stands; home it first"
                raise DeviceFault(f"{found} (asked to move)")
            self._fault = None
            self._journey.plan(goals)
            if self._moving:
                session.realtime(JOG_CANCEL)
            else:
                self._begin(session)
            self._moving = True

    def hold(self, user: str) -> None:
        """Stop moving now; a search for the switches is broken off, and has to be done again."""
        session = self._session
        if session is None or user not in self._users:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._held.set()
        session.realtime(JOG_CANCEL if self._homing is None else RESET)

    def _looked(self, user: str) -> GrblSession:
        """Return the session after a look at how things stand; raise when it is gone."""
        if self._session is None or user not in self._users:
            why = self._fault or f"{self._name}: it is not connected"
            raise NotConnected(f"{why}; connect it again")
        try:
            self._look(self._session)
        except NotConnected as failure:
            self._lose(str(failure))
            raise
        return self._session

    def _look(self, session: GrblSession) -> None:
        """Take in what has happened since the last look, and begin the move that waits."""
        if self._homing is not None and not self._home_found(session, self._homing):
            return
        report = session.report()
        if (
            report.state not in READY | MOVING
            or report.state == "Alarm"
            or session.restarts != self._restarts
        ):
            self._lose_place(session, report)
            return
        if self._held.is_set():
            self._held.clear()
            self._journey.end()
        self._place = session.place(report)
        if self._journey.waits and report.state not in MOVING:
            self._begin(session)
            report = session.report()
            self._place = session.place(report)
        moving = report.state in MOVING
        trouble = self._journey.trouble(self._place, moving=moving, t_ns=self._clock.now_ns())
        if trouble is not None:
            self._fault = f"{self._name}: {trouble}"
            session.realtime(JOG_CANCEL)
        self._moving = self._journey.ahead or moving

    def _home_found(self, session: GrblSession, sent: SentLine) -> bool:
        """Return whether the search has ended well; when it ended badly, say why."""
        session.listen()
        if sent.answer is None and not sent.lost and session.alarm is None:
            if self._clock.now_ns() > self._homing_ends_ns:
                session.realtime(RESET)
                self._forget(
                    f"{self._name}: no switch was found within {HOMING_S:g} s; look at it, home again"
                )
            return False
        held = self._held.is_set()
        self._held.clear()
        found = isinstance(sent.answer, GrblOk) and not held  # a reset is on its way
        why = session.alarm or sent.answer or "it restarted"
        self._forget(
            None if found or held else f"{self._name}: homing failed ({why}); look at it, home again"
        )
        self._restarts, self._dealt_with = session.restarts, session.alarm
        if found:
            self._homed = True
            self._journey.plan({axis.letter: axis.rest for axis in self._axes.values()})
        return found

    def _place_at_zero(self, session: GrblSession) -> tuple[float, ...]:
        """Return the place of a board that rests and counts zero; raise `DeviceFault` for any other."""
        report = session.report()
        place = session.place(report)
        counted = {axis.letter: place[axis.index] for axis in self._axes.values()}
        away = any(abs(at) > self._axes[letter].arrived for letter, at in counted.items())
        if report.state == "Idle" and not away:
            return place
        counts = ", ".join(f"{letter} {at:g}" for letter, at in counted.items())
        raise DeviceFault(
            f"{self._name}: asked to take where it stands for its zero, but it is in state {report.state} and"
            f" counts {counts}; bring it to its zero, switch the board off and on, then confirm again"
        )

    def _lose_place(self, session: GrblSession, report: GrblStatusReport) -> None:
        """Say why it does not know where it stands any more, if there is anything to say."""
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
        self._forget(self._fault if why is None else f"{self._name}: {why}; {again}")

    def _begin(self, session: GrblSession) -> None:
        """Send the move that waits; once more when the line was damaged on its way."""
        goals = self._journey.goals
        line = jog(goals, feed_per_min=feed_per_min(self._axes, goals, place=self._place))
        self._journey.end()
        try:
            session.ask(line)
        except LineRefused as refusal:
            if refusal.reason.code not in GARBLED:
                raise
            session.ask(line)
        except Timeout:
            if session.report().state not in MOVING:  # else it was taken, and the answer got lost
                session.end_line()
                session.ask(line)
        self._journey.begin(goals, t_ns=self._clock.now_ns())

    def _clear_alarm(self, session: GrblSession) -> None:
        """Leave an alarm: some hear nothing but a reset."""
        if session.alarm is not None or session.report().state == "Alarm":
            session.alarm = None
            session.realtime(RESET)
            session.report()
            self._restarts = session.restarts

    def _forget(self, fault: str | None) -> None:
        """Begin anew, knowing nothing of the place, for a reason or for none."""
        self._homed = self._moving = False
        self._homing = self._place = None
        self._journey.end()
        self._fault = fault

    def _lose(self, fault: str) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._forget(fault)
