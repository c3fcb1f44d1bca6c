"""Steers both mirrors by hand on a separate thread, update after update towards the newest target.

The thread calls `Mirrors.steer`, which is thread-safe. Targets and permission are left to others; the driver
drops an update that a parking overtakes.
"""

import logging
import math
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import Busy, Clock, FoveaError, Mirrors, MirrorVolts, StereoVolts, Stopped
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.watching.flows import MIRRORS, count_flow, this_part
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.loop_lag import never_blocked

_log = logging.getLogger(__name__)

TAU_S = 0.008
"""Time constant of the approach to a target, as in the authors' application."""
UPDATE_NS = 2_000_000
"""Period of the updates, a quarter of the time constant; the link's governor makes it longer. With half of it
targets were reached later on a busy machine, and a drive filter of 120 Hz removes the difference."""
SLEW_SHARE = 0.99
"""Share of the driver's slew limit that an update uses: the driver counts from rounded volts."""
ARRIVED_V = 0.01
"""Distance per axis at which a target counts as reached: three steps of the DACs."""
EXPOSURE_HOLD_S = 0.018
"""Pause of the updates for an exposure, from its request: it usually settles for 14 ms and exposes for 8, and
the drive's filter keeps the mirrors still for some 4 ms more. A longer exposure is blurred."""
SILENT_S = 0.25
"""Time without a message after which a held course is silent: the mirrors hold."""
PARK_S = 3.0
"""Further silence after which a course ends: the mirrors are parked."""
EXCUSED_NS = 10_000_000_000
"""Largest blocked time of the event loop that is subtracted from a silence."""
REST_S = 0.05
"""Interval at which a resting course checks whether the mirrors were parked or moved by a look."""
LINGER_NS = 100_000_000
"""Time for which a released course checks that no look moves the mirrors back."""
PARKED_WITHIN_S = 10.0


class SteeringStatus(StrEnum):
    """State of a steering course."""

    STEERING = "steering"
    SILENT = "silent"
    """Held, but without messages: the mirrors hold, and are parked unless the client answers again."""
    RELEASED = "released"
    """The mirrors go to the last target and stay there."""
    ENDED = "ended"
    """It has ended; the next one begins with a new press."""


def slewed(pose: StereoVolts, target: StereoVolts, *, dt_s: float, most_v: float) -> StereoVolts:
    """Return the next volts of the exponential approach to a target, at most `most_v` further per axis."""
    share = -math.expm1(-dt_s / TAU_S)

    def eye(now: MirrorVolts, wanted: MirrorVolts) -> MirrorVolts:
        return MirrorVolts(
            x_v=_next_v(now.x_v, wanted.x_v, share=share, most_v=most_v),
            y_v=_next_v(now.y_v, wanted.y_v, share=share, most_v=most_v),
        )

    return StereoVolts(left=eye(pose.left, target.left), right=eye(pose.right, target.right))


def _next_v(now_v: float, wanted_v: float, *, share: float, most_v: float) -> float:
    gap_v = wanted_v - now_v
    if abs(gap_v) <= min(ARRIVED_V, most_v):
        return wanted_v
    return now_v + max(-most_v, min(most_v, share * gap_v))


@dataclass(slots=True, kw_only=True, eq=False)
class SteeringCourse:
    """One press of one client, from its first target to its end; changed only by `HandSteering`."""

    by: str
    target: StereoVolts
    pose: StereoVolts
    """Volts of the last update, not rounded."""
    parks: int
    held: bool
    message_ns: int
    blocked_ns: int
    """Total blocked time of the event loop at its client's last message."""
    sent: StereoVolts | None = None
    sent_ns: int = 0
    moving: bool = False
    blurring: bool = False
    """Whether updates have been paused long enough for the exposure under way."""
    lost: bool = False
    """Whether its client was disconnected without releasing."""
    over: str | None = None
    """Why it has ended."""

    def status(self, now_ns: int, *, blocked_ns: int) -> SteeringStatus:
        """Return its state; `blocked_ns`: as for `silent_s`."""
        if self.over is not None:
            return SteeringStatus.ENDED
        if not self.held:
            return SteeringStatus.RELEASED
        return (
            SteeringStatus.SILENT
            if self.silent_s(now_ns, blocked_ns=blocked_ns) >= SILENT_S
            else SteeringStatus.STEERING
        )

    def silent_s(self, now_ns: int, *, blocked_ns: int) -> float:
        """Return the time since its client's last message, s.

        `blocked_ns`: total blocked time of the event loop, in which it could read no message.
        """
        excused_ns = min(EXCUSED_NS, max(0, blocked_ns - self.blocked_ns))
        silent_s = (now_ns - self.message_ns - excused_ns) / 1e9
        return max(silent_s, SILENT_S) if self.lost else silent_s


class HandSteering:
    """Steers one course at a time; callable from any thread."""

    def __init__(
        self,
        *,
        clock: Clock,
        mirrors: Callable[[], Mirrors],
        check: Callable[[], None],
        park: Callable[[Callable[[], bool]], "Future[None]"],
        on_pose: Callable[[StereoVolts], None],
        events: EventLog,
        blocked_ns: Callable[[], int] = never_blocked,
    ) -> None:
        """`check` raises while steering is not allowed; `park` parks if its argument returns true by then.

        `blocked_ns`: returns the total blocked time of the event loop, which reads the clients' messages.
        """
        self._clock = clock
        self._mirrors = mirrors
        self._check = check
        self._park_if = park
        self._on_pose = on_pose
        self._events = events
        self._blocked_ns = blocked_ns
        self._changed = threading.Condition()
        self._sending = threading.Lock()
        self._course: SteeringCourse | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="foveacam-steering", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; the mirrors stay where they are."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(timeout=15.0)

    @property
    def by(self) -> str | None:
        """Name of the client that holds the mirrors now."""
        course = self._course
        held = course is not None and self.status(course) is SteeringStatus.STEERING
        return course.by if course is not None and held else None

    def status(self, course: SteeringCourse) -> SteeringStatus:
        """Return the state of a course now."""
        return course.status(self._clock.now_ns(), blocked_ns=self._blocked_ns())

    # A course ----------------------------------------------------------------------------------------------

    def press(self, by: str, target: StereoVolts, *, held: bool) -> SteeringCourse:
        """Begin to steer; raise `Busy` while another holds the mirrors or a job has the rig, or `Stopped`.

        `held`: it holds the mirrors as long as its client sends messages; otherwise it ends at the target.
        """
        with self._changed:
            if (other := self.by) is not None:
                raise held_by(other, "steer by hand")
            state = self._mirrors().state
            self._check()  # after reading the count of parkings: a stop in between then ends the course
            self._replace(f"{by} steers by hand now")
            self._course = course = SteeringCourse(
                by=by,
                target=target,
                pose=state.volts,
                parks=state.parks,
                held=held,
                message_ns=self._clock.now_ns(),
                blocked_ns=self._blocked_ns(),
            )
            self._changed.notify_all()
            return course

    def record_message(self, course: SteeringCourse, target: StereoVolts | None = None) -> None:
        """Record a message of a course's client, with its newest target, if any."""
        with self._changed:
            course.message_ns, course.blocked_ns = self._clock.now_ns(), self._blocked_ns()
            course.target = target or course.target
            self._changed.notify_all()

    def release(self, course: SteeringCourse) -> None:
        """Release a course: the mirrors go to the last target and stay there."""
        with self._changed:
            course.held = False
            self._changed.notify_all()

    def lose(self, course: SteeringCourse) -> None:
        """Record that a course's client was lost: a held course holds the mirrors, and parks them later."""
        with self._changed:
            course.lost = True
            self._changed.notify_all()

    def end(self, course: SteeringCourse, reason: str) -> None:
        """End a course: the mirrors hold at once."""
        with self._changed:
            if course.over is None:
                course.over = reason
            if self._course is course:
                self._course = None

    def make_way(self, reason: str) -> None:
        """End the present course, if any; on return, none of its updates is under way."""
        with self._changed:
            self._replace(reason)
        with self._sending:
            return

    def take_over(self, asked: str) -> None:
        """End a released course; raise `Busy` while a client holds one."""
        if (by := self.by) is not None:
            raise held_by(by, asked)
        self.make_way("the mirrors were moved otherwise")

    def _replace(self, reason: str) -> None:
        course, self._course = self._course, None
        if course is not None and course.held:
            course.over = reason

    # The thread --------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._course is not None)
                course = self._course
                if self._closing:
                    return
            if course is not None:
                self._follow(course)

    def _follow(self, course: SteeringCourse) -> None:
        try:
            while self._course is course and not self._closing:
                self._step(course)
        except FoveaError as error:
            self.end(course, error.found or str(error))
        except Exception as bug:  # noqa: BLE001 - outermost frame: the next press must find the thread alive
            _log.exception("steering by hand stopped")
            self.end(course, f"steering failed: {bug}")

    def _step(self, course: SteeringCourse) -> None:
        mirrors, now_ns = self._mirrors(), self._clock.now_ns()
        state = mirrors.state
        if state.parks != course.parks:
            self._check()
            raise Stopped(found="the mirrors were parked")
        blocked_ns = self._blocked_ns()
        if course.status(now_ns, blocked_ns=blocked_ns) is SteeringStatus.SILENT:
            if course.silent_s(now_ns, blocked_ns=blocked_ns) >= SILENT_S + PARK_S:
                self._park(course)
            else:
                self._rest(course)
        elif course.pose != course.target or course.sent not in (None, state.volts):
            self._move(course, mirrors)
        elif not course.held and now_ns - course.sent_ns > LINGER_NS:
            self._finish(course)
        else:
            self._rest(course)

    def _move(self, course: SteeringCourse, mirrors: Mirrors) -> None:
        self._wait_for_exposure(course, mirrors)
        with self._sending:
            if not self._awaited(course):
                return
            now_ns = self._clock.now_ns()
            dt_ns = now_ns - course.sent_ns if course.moving else UPDATE_NS
            most_v = SLEW_SHARE * mirrors.limits.max_slew_v
            pose = slewed(course.pose, course.target, dt_s=dt_ns / 1e9, most_v=most_v)
            count_flow(this_part(), MIRRORS, "moves")
            course.sent = mirrors.steer(pose, unless_parked_since=course.parks)
            course.pose, course.sent_ns, course.moving = pose, now_ns, True
            self._on_pose(course.sent)
        self._clock.sleep_until_ns(now_ns + UPDATE_NS)

    def _wait_for_exposure(self, course: SteeringCourse, mirrors: Mirrors) -> None:
        """Pause the updates while an exposure is under way, for a limited time."""
        if not mirrors.state.exposing:
            course.blurring = False
        began_ns = self._clock.now_ns()
        while not course.blurring and mirrors.state.exposing:
            now_ns = self._clock.now_ns()
            course.moving, course.blurring = False, now_ns - began_ns >= EXPOSURE_HOLD_S * 1e9
            self._clock.sleep_until_ns(now_ns + UPDATE_NS // 2)

    def _rest(self, course: SteeringCourse) -> None:
        """Wait for another target, for a short time at most."""
        course.moving = False
        with self._changed:
            arrived = course.pose == course.target
            if self._course is course and (arrived or not self._client_responds(course)):
                self._changed.wait(REST_S)

    def _awaited(self, course: SteeringCourse) -> bool:
        """Return whether updates of a course may be sent."""
        return self._course is course and self._client_responds(course)

    def _client_responds(self, course: SteeringCourse) -> bool:
        return self.status(course) is not SteeringStatus.SILENT

    def _finish(self, course: SteeringCourse) -> None:
        with self._changed:
            if self._course is course and course.pose == course.target:
                self._course = None

    def _park(self, course: SteeringCourse) -> None:
        """Park through the hardware thread, so that no look undoes it; directly where that fails."""

        def silent() -> bool:
            return self._course is course and not self._client_responds(course)

        try:
            answer_of(self._park_if(silent), asked="a park", within_s=PARKED_WITHIN_S)
        except FoveaError:
            if silent():
                self._mirrors().park()
        if silent():
            reason = f"no message came for {SILENT_S + PARK_S:g} s: the mirrors were parked"
            self.end(course, reason)
            self._events.emit("mirrors.parked", f"{course.by}: {reason}", level=EventLevel.WARNING)


def held_by(by: str, asked: str) -> Busy:
    """Return the error for a request while somebody steers by hand."""
    return Busy(
        f"asked to {asked}: {by} steers the mirrors by hand",
        asked=asked,
        found=f"{by} steers by hand",
        remedy="wait until that ends",
    )
