"""A FLIR (Directed Perception) pan-tilt unit, as `contract.PanTilt`.

Nothing here has a thread: what goes on is noticed when `state` is read. The unit's `A` (await) would make it
deaf until it rests, so a move is over when both positions are those asked for. It has no checksum: a move
that ends elsewhere is a fault. How its replies find their commands is `ptu_session`'s.
"""

import threading
from contextlib import suppress

from foveacam_hardware.contract import (
    Busy,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    InvalidInput,
    NotConnected,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    Timeout,
)
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD, check_bearing
from foveacam_hardware.drivers.positioners.ptu_axes import PtuAxes, PtuMounting, Steps
from foveacam_hardware.drivers.positioners.ptu_session import PtuSession, SentCommand
from foveacam_hardware.drivers.positioners.ptu_start import greet, prepare
from foveacam_hardware.wire.link import LinkFactory
from foveacam_hardware.wire.ptu import HALT, RESET, PtuAxis, PtuDone, PtuQuery, move

HOMING_S = 90.0
"""While it finds its limits it answers nothing; the slowest unit needs half of this."""
STILL_NS = 250_000_000
"""Positions that do not change for this long are those of a unit at rest."""


class PtuPanTilt:
    """Turns the rig; `hold` and `state` may be called from any thread, the rest from one at a time."""

    moves_itself = True

    def __init__(
        self,
        link_factory: LinkFactory,
        clock: Clock,
        *,
        limits: PanTiltLimits,
        name: str = "pan-tilt",
        mounting: PtuMounting | None = None,
    ) -> None:
        self._link_factory = link_factory
        self._clock = clock
        self.limits = limits
        self.info = DeviceInfo(vendor="FLIR", model="pan-tilt unit", serial=name)
        self._name = name
        self._mounting = mounting or PtuMounting()
        self._axes: PtuAxes | None = None
        self._lock = threading.RLock()
        self._session: PtuSession | None = None
        self._restarts = 0
        self._held = threading.Event()
        self._homed = self._moving = self._slowing = False
        self._homing: SentCommand | None = None
        self._homing_ends_ns = 0
        self._goal: Steps | None = None
        self._at: Steps | None = None
        self._still_since_ns = 0
        self._fault: str | None = None

    @property
    def state(self) -> PanTiltState:
        """Ask where it stands; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._look(self._session)
                except (NotConnected, Timeout) as failure:
                    self._lose(str(failure))
                except FoveaError as failure:  # the turn straight ahead was refused
                    self._fault = str(failure)
            return PanTiltState(
                connected=self._session is not None,
                moving=self._moving,
                homed=self._homed,
                pose=self._axes.bearing(self._at) if self._homed and self._axes and self._at else None,
                fault=self._fault,
            )

    def connect(self) -> None:
        """Open the link, check who answers and whether it can turn as far and as fast as it should."""
        with self._lock:
            if self._session is not None and self.state.connected:
                return
            session = PtuSession(self._link_factory(), self._clock, name=self._name)
            try:
                version = greet(session, self._name)
                self._axes = prepare(session, self._mounting, self.limits, name=self._name)
            except FoveaError as failure:
                session.close()
                self._forget(str(failure))
                raise
            self.info = DeviceInfo(vendor="FLIR", model="pan-tilt unit", serial=self._name, version=version)
            self._forget(None)
            session.limits_hit.clear()
            self._session, self._restarts = session, session.restarts
            self._held.clear()

    def close(self) -> None:
        """Stop and release; harmless when closed."""
        with self._lock:
            session, self._session = self._session, None
            if session is not None:
                with suppress(NotConnected):
                    session.begin(HALT)
                session.close()
            self._forget(None)

    def home(self) -> None:
        """Begin to look for the limits; when they are found, the rig turns straight ahead."""
        with self._lock:
            session = self._looked()
            if self._moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            self._axes = prepare(
                session, self._mounting, self.limits, name=self._name
            )  # it may have restarted
            session.limits_hit.clear()
            self._restarts = session.restarts
            self._forget(None)
            self._homing = session.begin(RESET)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)
            self._moving = True

    def confirm_zero(self) -> None:
        """Refuse: it finds its limits by itself."""
        raise InvalidInput(
            f"{self._name}: asked to take where it stands for its zero, but it finds its limits; home it"
        )

    def move_to(self, pose: PanTiltPose) -> None:
        """Begin to move; a move that is under way is given up for it."""
        check_bearing(pose, self.limits, name=self._name)
        with self._lock:
            session = self._looked()
            if self._homing is not None:
                raise Busy(f"{self._name}: asked to move while it looks for its limits; wait until it rests")
            if not self._homed or self._axes is None:
                found = self._fault or f"{self._name}: it does not know where it stands; home it first"
                raise DeviceFault(f"{found} (asked to move)")
            self._fault = None
            self._go(session, self._axes.steps(pose))

    def hold(self) -> None:
        """Stop moving now. A search for the limits ends by itself: the unit hears nothing before."""
        session = self._session
        if session is None:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._held.set()
        session.begin(HALT)

    def _looked(self) -> PtuSession:
        """Return the session after a look at how things stand; raise when it is gone."""
        if self._session is None:
            why = self._fault or f"{self._name}: it is not connected"
            raise NotConnected(f"{why}; connect it again")
        try:
            self._look(self._session)
        except (NotConnected, Timeout) as failure:
            self._lose(str(failure))
            raise
        return self._session

    def _look(self, session: PtuSession) -> None:
        """Take in what has happened since the last look."""
        if self._homing is not None and not self._home_found(session, self._homing):
            return
        at = self._positions(session)
        if session.limits_hit or session.restarts != self._restarts:
            self._lose_place(session)
            return
        now_ns = self._clock.now_ns()
        if at != self._at:
            self._at, self._still_since_ns = at, now_ns
        if self._held.is_set():
            self._held.clear()
            self._goal, self._slowing, self._still_since_ns = None, True, now_ns
        self._judge(at, still=now_ns - self._still_since_ns >= STILL_NS)

    def _judge(self, at: Steps, *, still: bool) -> None:
        """Say whether it moves; notice a move that has ended elsewhere."""
        if self._goal == at:
            self._goal = None
        elif self._goal is not None and still:
            self._goal = None
            self._fault = (
                f"{self._name}: it came to rest elsewhere than it was sent to: stopped on its way, or"
                " misheard; move it again"
            )
        self._slowing = self._slowing and not still
        self._moving = self._goal is not None or self._slowing

    def _positions(self, session: PtuSession) -> Steps:
        return (
            round(session.number(PtuAxis.PAN, PtuQuery.POSITION)),
            round(session.number(PtuAxis.TILT, PtuQuery.POSITION)),
        )

    def _home_found(self, session: PtuSession, sent: SentCommand) -> bool:
        """Return whether the search has ended well; when it ended badly, say why."""
        session.listen()
        restarted = sent.lost or session.restarts != self._restarts
        if sent.reply is None and not restarted:
            if self._clock.now_ns() > self._homing_ends_ns:
                self._forget(
                    f"{self._name}: its limits were not found within {HOMING_S:g} s; look at it, home again"
                )
            return False
        found = isinstance(sent.reply, PtuDone) and not restarted
        self._restarts = session.restarts
        session.limits_hit.clear()  # it has just been looking for them
        self._forget(None if found else f"{self._name}: homing failed; look at it, home again")
        self._homed = found
        if found and self._axes is not None and not self._held.is_set():
            self._go(session, self._axes.steps(STRAIGHT_AHEAD))
        self._held.clear()
        return found

    def _go(self, session: PtuSession, goal: Steps) -> None:
        """Send both axes on their way; a hold that comes in between stands."""
        try:
            session.ask(move(PtuAxis.PAN, goal[0]))
            session.ask(move(PtuAxis.TILT, goal[1]))
        except DeviceFault:
            session.begin(HALT)
            self._goal, self._slowing, self._moving = None, True, True
            raise
        if self._held.is_set():
            session.begin(HALT)
        self._goal, self._moving, self._still_since_ns = goal, True, self._clock.now_ns()

    def _lose_place(self, session: PtuSession) -> None:
        """Say why it does not know where it stands any more."""
        restarted, self._restarts = session.restarts != self._restarts, session.restarts
        why = "it restarted by itself"
        if not restarted:
            axes = " and ".join(sorted({axis.name.lower() for axis in session.limits_hit}))
            why = f"{axes} ran into a limit and lost count of its steps"
        session.limits_hit.clear()
        self._forget(f"{self._name}: {why}; home it again")

    def _forget(self, fault: str | None) -> None:
        """Begin anew, knowing nothing of the place, for a reason or for none."""
        self._homed = self._moving = self._slowing = False
        self._homing = self._goal = self._at = None
        self._fault = fault

    def _lose(self, fault: str) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._forget(fault)
