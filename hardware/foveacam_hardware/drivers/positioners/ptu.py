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
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD, check_bearing
from foveacam_hardware.drivers.positioners.ptu_axes import PtuAxes, PtuMounting, Steps
from foveacam_hardware.drivers.positioners.ptu_session import PtuSession, SentCommand
from foveacam_hardware.drivers.positioners.ptu_start import greet, prepare
from foveacam_hardware.wire.link import LinkFactory
from foveacam_hardware.wire.ptu import HALT, RESET, PtuAxis, PtuDone, PtuQuery, move

HOMING_S = 90.0
"""Deadline of homing, during which the unit is silent; the slowest unit needs half of this."""
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
        """State and pose, queried from the unit; never raises."""
        with self._lock:
            if self._session is not None:
                try:
                    self._update(self._session)
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
                self._reset_state(str(failure))
                raise
            self.info = DeviceInfo(vendor="FLIR", model="pan-tilt unit", serial=self._name, version=version)
            self._reset_state(None)
            session.limits_hit.clear()
            self._session, self._restarts = session, session.restarts
            self._held.clear()

    def close(self) -> None:
        """Stop and release; do nothing when closed."""
        with self._lock:
            session, self._session = self._session, None
            if session is not None:
                with suppress(NotConnected):
                    session.begin(HALT)
                session.close()
            self._reset_state(None)

    def home(self) -> None:
        """Begin to search for the limits; when found, the rig turns straight ahead."""
        with self._lock:
            session = self._updated_session()
            if self._moving:
                raise Busy(f"{self._name}: asked to home while it moves; hold it first, or wait")
            self._axes = prepare(
                session, self._mounting, self.limits, name=self._name
            )  # it may have restarted
            session.limits_hit.clear()
            self._restarts = session.restarts
            self._reset_state(None)
            self._homing = session.begin(RESET)
            self._homing_ends_ns = self._clock.now_ns() + round(HOMING_S * 1e9)
            self._moving = True

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
            if self._homing is not None:
                raise Busy(f"{self._name}: asked to move while it looks for its limits; wait until it rests")
            if not self._homed or self._axes is None:
                found = self._fault or f"{self._name}: it does not know where it stands; home it first"
                raise DeviceFault(f"{found} (asked to move)")
            self._fault = None
            self._send_goal(session, self._axes.steps(pose))

    def hold(self) -> None:
        """Stop moving now. Homing cannot be interrupted: the unit accepts no command before its end."""
        session = self._session
        if session is None:
            raise NotConnected(f"{self._name}: asked to hold, but it is not connected; connect it first")
        self._held.set()
        session.begin(HALT)

    def _updated_session(self) -> PtuSession:
        """Update the state and return the session; raise when it is gone."""
        if self._session is None:
            why = self._fault or f"{self._name}: it is not connected"
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
        if self._held.is_set():
            self._held.clear()
            self._goal, self._slowing, self._still_since_ns = None, True, now_ns
        self._judge_motion(at, still=now_ns - self._still_since_ns >= STILL_NS)

    def _judge_motion(self, at: Steps, *, still: bool) -> None:
        """Update whether it moves; record a fault when a move has ended elsewhere."""
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

    def _check_homing(self, session: PtuSession, sent: SentCommand) -> bool:
        """Return whether homing has succeeded; record the reason when it failed."""
        session.listen()
        restarted = sent.lost or session.restarts != self._restarts
        if sent.reply is None and not restarted:
            if self._clock.now_ns() > self._homing_ends_ns:
                self._reset_state(
                    f"{self._name}: its limits were not found within {HOMING_S:g} s; look at it, home again"
                )
            return False
        found = isinstance(sent.reply, PtuDone) and not restarted
        self._restarts = session.restarts
        session.limits_hit.clear()  # homing runs into the limits deliberately
        self._reset_state(None if found else f"{self._name}: homing failed; look at it, home again")
        self._homed = found
        if found and self._axes is not None and not self._held.is_set():
            self._send_goal(session, self._axes.steps(STRAIGHT_AHEAD))
        self._held.clear()
        return found

    def _send_goal(self, session: PtuSession, goal: Steps) -> None:
        """Send both axes to a goal; a hold issued meanwhile takes effect."""
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

    def _lose_position(self, session: PtuSession) -> None:
        """Mark the position as lost and record why."""
        restarted, self._restarts = session.restarts != self._restarts, session.restarts
        why = "it restarted by itself"
        if not restarted:
            axes = " and ".join(sorted({axis.name.lower() for axis in session.limits_hit}))
            why = f"{axes} ran into a limit and lost count of its steps"
        session.limits_hit.clear()
        self._reset_state(f"{self._name}: {why}; home it again")

    def _reset_state(self, fault: str | None) -> None:
        """Reset the state to an unknown position, with an optional fault."""
        self._homed = self._moving = self._slowing = False
        self._homing = self._goal = self._at = None
        self._fault = fault

    def _lose(self, fault: str) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self._reset_state(fault)
