"""A FLIR (Directed Perception) pan-tilt unit as `contract.PanTilt`.

There is no thread: events are processed when `state` is read. The unit's `A` (await) would block it until it
rests, so a move ends when both positions are the requested ones. There is no checksum: a move that ends
elsewhere is a fault. Matching replies to commands is left to `ptu_session`.
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
from foveacam_hardware.drivers.positioners.life import Event, Phase, PositionerLife
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD, check_bearing
from foveacam_hardware.drivers.positioners.ptu_axes import PtuAxes, PtuMounting, Steps
from foveacam_hardware.drivers.positioners.ptu_session import PtuSession, SentCommand
from foveacam_hardware.drivers.positioners.ptu_start import greet, prepare
from foveacam_hardware.wire.link import LinkFactory
from foveacam_hardware.wire.ptu import HALT, RESET, PtuAxis, PtuDone, PtuQuery, move

HOMING_S = 90.0
"""Deadline of homing, during which the unit is silent; the slowest unit needs half of this."""
NEAR_STEPS = 2
"""A homing ends at 0/0; farther away, the success was another command's."""
STILL_NS = 250_000_000
"""Time without a change of position after which the unit counts as at rest."""


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
        self._life = PositionerLife()
        self._hold_sent = threading.Event()  # until an update has dealt with it
        self._slowing = False
        self._homing: SentCommand | None = None
        self._homing_ends_ns = 0
        self._goal: Steps | None = None
        self._at: Steps | None = None
        self._still_since_ns = 0

    @property
    def state(self) -> PanTiltState:
        """State and pose, queried from the unit; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._update(self._session)
                except (NotConnected, Timeout) as failure:
                    self._lose(str(failure))
                except FoveaError as failure:  # the turn straight ahead was refused
                    self._life.fault = str(failure)
            return PanTiltState(
                connected=self._life.connected,
                moving=self._is_moving,
                homed=self._life.homed,
                pose=self._axes.bearing(self._at) if self._life.homed and self._axes and self._at else None,
                fault=self._life.fault,
            )

    @property
    def _is_moving(self) -> bool:
        return self._life.is_homing or self._goal is not None or self._slowing

    def connect(self) -> None:
        """Open the link, identify the unit and check its range and speed."""
        with self._lock:
            if self._session is not None and self.state.connected:
                return
            session = PtuSession(self._link_factory(), self._clock, name=self._name)
            try:
                version = greet(session, self._name)
                self._axes = prepare(session, self._mounting, self.limits, name=self._name)
            except FoveaError as failure:
                session.close()
                self._life.fault = str(failure)
                raise
            self.info = DeviceInfo(vendor="FLIR", model="pan-tilt unit", serial=self._name, version=version)
            session.limits_hit.clear()
            self._session, self._restarts = session, session.restarts
            self._hold_sent.clear()
            self._apply(Event.CONNECTED)

    def close(self) -> None:
        """Stop and release; do nothing when closed."""
        with self._lock:
            if self._session is not None:
                with suppress(NotConnected):
                    self._session.begin(HALT)
            self._lose(None)

    def home(self) -> None:
        """Begin to search for the limits; when found, the rig turns straight ahead."""
        with self._lock:
            session = self._updated_session()
            if self._is_moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            self._hold_sent.clear()  # it was at rest
            self._axes = prepare(
                session, self._mounting, self.limits, name=self._name
            )  # it may have restarted
            session.limits_hit.clear()
            self._restarts = session.restarts
            self._apply(Event.HOMING_BEGUN)
            self._homing = session.begin(RESET)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)

    def confirm_zero(self) -> None:
        """Raise `InvalidInput`: the unit finds its limits by itself."""
        raise InvalidInput(
            f"{self._name}: asked to take where it stands for its zero, but it finds its limits; home it"
        )

    def move_to(self, pose: PanTiltPose) -> None:
        """Begin to move, replacing a move in progress."""
        check_bearing(pose, self.limits, name=self._name)
        with self._lock:
            session = self._updated_session()
            if self._life.is_homing:
                raise Busy(f"{self._name}: asked to move while it looks for its limits; wait until it rests")
            if not self._life.homed or self._axes is None:
                found = self._life.fault or f"{self._name}: it does not know where it stands; home it first"
                raise DeviceFault(f"{found} (asked to move)")
            self._life.fault = None
            self._send_goal(session, self._axes.steps(pose))

    def hold(self) -> None:
        """Stop moving now. Homing cannot be interrupted: the unit accepts no command before its end."""
        session = self._session
        if session is None:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._hold_sent.set()
        session.begin(HALT)

    def _updated_session(self) -> PtuSession:
        """Update the state and return the session; raise when it is gone."""
        if self._session is None:
            why = self._life.fault or f"{self._name}: it is not connected"
            raise NotConnected(f"{why}; connect it again")
        try:
            self._update(self._session)
        except (NotConnected, Timeout) as failure:
            self._lose(str(failure))
            raise
        return self._session

    def _update(self, session: PtuSession) -> None:
        """Process the events since the last update."""
        if self._homing is not None and not self._check_homing(session, self._homing):
            return
        at = self._positions(session)
        if session.limits_hit or session.restarts != self._restarts:
            self._lose_position(session)
            return
        now_ns = self._clock.now_ns()
        if at != self._at:
            self._at, self._still_since_ns = at, now_ns
        if self._hold_sent.is_set():
            self._hold_sent.clear()
            self._goal, self._slowing, self._still_since_ns = None, True, now_ns
        self._judge_motion(at, still=now_ns - self._still_since_ns >= STILL_NS)

    def _judge_motion(self, at: Steps, *, still: bool) -> None:
        """Update whether it moves; record a fault when a move has ended elsewhere."""
        if self._goal == at:
            self._goal = None
        elif self._goal is not None and still:
            self._goal = None
            self._life.fault = (
                f"{self._name}: it came to rest elsewhere than it was sent to: stopped on its way, or"
                " misheard; move it again"
            )
        self._slowing = self._slowing and not still

    def _positions(self, session: PtuSession) -> Steps:
        return (
            round(session.number(PtuAxis.PAN, PtuQuery.POSITION)),
            round(session.number(PtuAxis.TILT, PtuQuery.POSITION)),
        )

    def _check_homing(self, session: PtuSession, sent: SentCommand) -> bool:
        """Return whether homing has succeeded; record the reason when it failed."""
        session.listen()
        if self._hold_sent.is_set():
            self._hold_sent.clear()
            self._life.apply(Event.HOLD)
        restarted = sent.lost or session.restarts != self._restarts
        if sent.reply is None and not restarted and self._clock.now_ns() <= self._homing_ends_ns:
            return False
        why = self._homing_failure(session, sent)
        held = self._life.phase is Phase.HELD
        self._restarts = session.restarts
        session.limits_hit.clear()  # homing runs into the limits deliberately
        if why:
            self._apply(Event.HOMING_FAILED, fault=f"{self._name}: {why}; look at it, home again")
            return False
        self._apply(Event.HOMING_DONE)
        if self._axes is not None and not held:
            self._send_goal(session, self._axes.steps(STRAIGHT_AHEAD))
        return True

    def _homing_failure(self, session: PtuSession, sent: SentCommand) -> str:
        """Return why a homing that has ended failed; "" when it succeeded."""
        away = False
        if isinstance(sent.reply, PtuDone):
            session.doubt_order()  # a success is the same for every command
            away = any(abs(steps) > NEAR_STEPS for steps in self._positions(session))
        if sent.lost or session.restarts != self._restarts:
            return "homing failed (it restarted)"
        if sent.reply is None:
            return f"its limits were not found within {HOMING_S:g} s"
        if away:
            return "homing failed (it does not count zero at its end)"
        return "" if isinstance(sent.reply, PtuDone) else "homing failed"

    def _send_goal(self, session: PtuSession, goal: Steps) -> None:
        """Send both axes to a goal; a hold issued meanwhile takes effect."""
        try:
            session.ask(move(PtuAxis.PAN, goal[0]))
            session.ask(move(PtuAxis.TILT, goal[1]))
        except DeviceFault:
            session.begin(HALT)
            self._goal, self._slowing = None, True
            raise
        if self._hold_sent.is_set():
            session.begin(HALT)
        self._goal, self._still_since_ns = goal, self._clock.now_ns()

    def _lose_position(self, session: PtuSession) -> None:
        """Mark the position as lost, if it was known, and record why."""
        restarted, self._restarts = session.restarts != self._restarts, session.restarts
        axes = " and ".join(sorted({axis.name.lower() for axis in session.limits_hit}))
        session.limits_hit.clear()
        if not restarted:
            why = f"{axes} ran into a limit and lost count of its steps"
            self._apply(Event.ALARMED, fault=f"{self._name}: {why}; home it again")
        elif self._life.homed:
            self._apply(Event.RESTARTED, fault=f"{self._name}: it restarted by itself; home it again")

    def _apply(self, event: Event, *, fault: str | None = None) -> None:
        """Go to the phase after an event; forget what is no longer so."""
        self._life.apply(event, fault=fault)
        self._slowing, self._goal, self._at = False, None, None
        if not self._life.is_homing:
            self._homing = None

    def _lose(self, fault: str | None) -> None:
        """Release the link."""
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._apply(Event.LINK_LOST, fault=fault)
