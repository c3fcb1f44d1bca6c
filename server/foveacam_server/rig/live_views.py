"""Paces the live views: decides when a wide frame and a look are due, and publishes their frames."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import Clock, Frame, Role, Sighting, StereoVolts
from foveacam_server.rig.ports import AssembledRig, PictureSink
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.status import FrameRate, RigStatus
from foveacam_server.rig.stream_messages import wire_seq
from foveacam_server.rig.view_pace import expected_rate

SESSION_WIDE_HZ = 4.0
"""Rate of wide frames while a job runs; its looks deliver further ones."""
IDLE_WIDE_HZ = 2.0
IDLE_FOVEA_HZ = 1.0
"""Rates without a viewer: enough to notice a lost device soon, at little cost."""
QUIET_AFTER_NS = 20_000_000_000
QUIET_WIDE_HZ = 0.2
QUIET_FOVEA_HZ = 0.02
"""Rates without viewers or use of the rig for `QUIET_AFTER_NS`, to avoid rendering a simulated rig for
nobody."""
EVERY_WIDE_HZ = 120.0
EVERY_FOVEA_HZ = 1000.0
"""Limits during a recording: looks follow each other without pause, and all wide frames between them are
read."""
LIVE_AGE_MS = 500.0
"""Largest age of a live wide frame; after it a new one is awaited, as the camera may have stalled."""
LONGEST_WAIT_S = 0.1
LONGEST_QUIET_WAIT_S = 0.25
"""Longest interval between two checks for new viewers."""
RECENT_FRAMES, RECENT_APART_NS = 12, 50_000_000
"""Number and least spacing of the wide frames kept for late clicks: 0.6 s or more."""
NEWEST_NS = 500_000_000
"""Largest age of the newest frame to which a click without a number refers: a moving target has moved
since."""

OverlayOf = Callable[[StereoVolts | None], OverlayDocument | None]
"""Returns the overlay of the wide view for a gaze; None: the gaze is unknown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveRates:
    """Upper limits of the live views, Hz."""

    wide_hz: float = 15.0
    fovea_hz: float = 15.0


class RecentFrames:
    """The newest wide frames, to one of which a viewer's click refers. Callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[Frame] = deque(maxlen=RECENT_FRAMES)

    def add(self, frame: Frame) -> None:
        """Keep a frame, unless one was kept shortly before."""
        with self._lock:
            if not self._frames or frame.t_ns - self._frames[-1].t_ns >= RECENT_APART_NS:
                self._frames.append(frame)

    def find(self, seq: int) -> Frame | None:
        """Return the frame with this number of the WebSocket, or the last one before it; else None."""
        with self._lock:
            older = [frame for frame in self._frames if wire_seq(frame.seq) <= seq]
        return older[-1] if older else None

    def newest(self) -> Frame | None:
        """Return the newest frame, if any."""
        with self._lock:
            return self._frames[-1] if self._frames else None

    def chosen(self, seq: int | None, *, now_ns: int) -> Frame | None:
        """Return the frame on which a target was chosen, as far as it is kept.

        `seq`: its sequence number; None: the newest frame, unless it is older than `NEWEST_NS`.
        """
        if seq is not None:
            return self.find(seq)
        newest = self.newest()
        return newest if newest is not None and now_ns - newest.t_ns <= NEWEST_NS else None

    def since(self, t_ns: int) -> list[Frame]:
        """Return the frames from a time on, oldest first."""
        with self._lock:
            return [frame for frame in self._frames if frame.t_ns >= t_ns]


class LiveViews:
    """Paces the live views and measures their rates. Called by the hardware thread only."""

    def __init__(self, *, sink: PictureSink, clock: Clock, limits: LiveRates, overlay: OverlayOf) -> None:
        self.rates = {role: FrameRate() for role in Role}
        self.recent_wide = RecentFrames()
        self._sink = sink
        self._clock = clock
        self._limits = limits
        self._overlay = overlay
        self._wide_began_ns: int | None = None
        self._look_began_ns: int | None = None
        self._in_session = False
        self._allowed = {Role.WIDE: False, Role.LEFT: False, Role.RIGHT: False}
        self._used_ns = clock.now_ns()

    def show_sighting(self, sighting: Sighting, *, in_session: bool) -> None:
        """Publish the frames of one look; its wide frame counts as a live one.

        In a session the next look follows soon, and a live frame before it would only delay it.
        """
        self.start_wide_period(in_session=in_session)
        overlay = self._overlay(sighting.volts)
        for frame in sighting.wide_before if self._sink.wants_every(Role.WIDE.value) else ():
            self._show(frame, meta=overlay)
        self._show(sighting.wide, meta=overlay)
        for frame in (sighting.left, sighting.right):
            if frame.role is not sighting.missing:
                self._show(frame)

    def note_use(self) -> None:
        """Record that the rig is used, or must be monitored closely."""
        self._used_ns = self._clock.now_ns()

    def wide_due(self) -> bool:
        """Return whether a wide frame is due."""
        return self._clock.now_ns() >= self._wide_due_ns()

    def look_due(self) -> bool:
        """Return whether a look for the live fovea views is due."""
        return self._clock.now_ns() >= self._look_due_ns()

    def start_wide_period(self, *, in_session: bool) -> None:
        """Start a period of the wide view."""
        self._in_session = in_session
        self._wide_began_ns = self._clock.now_ns()

    def show_wide(
        self, rig: AssembledRig, *, gaze: StereoVolts | None, max_age_ms: float = LIVE_AGE_MS
    ) -> Frame:
        """Publish and return the newest wide frame; during a recording also those that wait before it."""
        overlay = self._overlay(gaze)
        for _ in range(rig.wide.waiting if self._sink.wants_every(Role.WIDE.value) else 0):
            self._show(rig.wide.read(), meta=overlay)
        frame = rig.wide.latest(max_age_ms=max_age_ms)
        self._show(frame, meta=overlay)
        return frame

    def start_look_period(self) -> None:
        """Start a period of the live fovea views."""
        self._look_began_ns = self._clock.now_ns()

    def wait_s(self, *, wide: bool, looks: bool) -> float:
        """Return the time until a wide frame or a look is due, of those that are enabled."""
        now_ns = self._clock.now_ns()
        self._allowed = {Role.WIDE: wide, Role.LEFT: looks, Role.RIGHT: looks}
        wanted = [(self._wide_due_ns(), wide), (self._look_due_ns(), looks)]
        waits_s = [(due_ns - now_ns) / 1e9 for due_ns, is_wanted in wanted if is_wanted]
        return max(0.0, min([*waits_s, LONGEST_QUIET_WAIT_S if self.quiet else LONGEST_WAIT_S]))

    def expect(self, status: RigStatus) -> None:
        """Tell the sink the rate at which each camera's view should come: that of a view that is watched."""
        for camera in status.cameras:
            role = camera.role
            delivers = camera.connected and camera.settings.frame_rate_hz > 0.0  # an absent one has no rate
            promised = delivers and self._allowed[role] and self._sink.watched(role.value)
            if not promised:
                self._sink.expect(role.value, None)
                continue
            limit_hz = self._limits.fovea_hz
            if role is Role.WIDE:
                limit_hz = min(self._limits.wide_hz, SESSION_WIDE_HZ if self._in_session else EVERY_WIDE_HZ)
            expected = expected_rate(limit_hz, camera.settings, link=camera.link, simulated=status.simulated)
            self._sink.expect(role.value, expected)

    def _wide_due_ns(self) -> int:
        """Return when a wide frame is due at the present rate, so that a new viewer need not wait."""
        view = Role.WIDE.value
        rate_hz = self._limits.wide_hz
        if self._sink.wants_every(view):
            rate_hz = EVERY_WIDE_HZ
        elif not self._watched(view):
            rate_hz = min(rate_hz, QUIET_WIDE_HZ if self.quiet else IDLE_WIDE_HZ)
        if self._in_session:
            rate_hz = min(rate_hz, SESSION_WIDE_HZ)
        return 0 if self._wide_began_ns is None else self._wide_began_ns + round(1e9 / rate_hz)

    def _look_due_ns(self) -> int:
        rate_hz = self._limits.fovea_hz
        if self._for_a_fovea(self._sink.wants_every):
            rate_hz = EVERY_FOVEA_HZ
        elif not self._for_a_fovea(self._watched):
            rate_hz = min(rate_hz, QUIET_FOVEA_HZ if self.quiet else IDLE_FOVEA_HZ)
        return 0 if self._look_began_ns is None else self._look_began_ns + round(1e9 / rate_hz)

    @property
    def quiet(self) -> bool:
        """Whether there were no viewers and no use of the rig for long."""
        return self._clock.now_ns() - self._used_ns >= QUIET_AFTER_NS

    def _watched(self, view: str) -> bool:
        watched = self._sink.watched(view)
        if watched:
            self.note_use()
        return watched

    def _for_a_fovea(self, asks: Callable[[str], bool]) -> bool:
        return asks(Role.LEFT.value) or asks(Role.RIGHT.value)

    def _show(self, frame: Frame, *, meta: OverlayDocument | None = None) -> None:
        if frame.role is Role.WIDE:
            self.recent_wide.add(frame)
        if self.rates[frame.role].add(frame):
            self._sink.publish_frame(frame, meta=meta)
