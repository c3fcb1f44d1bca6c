"""Keeps the views alive while nobody works with the rig: when the next wide frame and the next look are due."""

from foveacam_hardware.contract import Clock, Frame, Role, Sighting, StereoVolts

from foveacam_server.runtime.ports import PictureSink, Rig
from foveacam_server.runtime.rig_status import FrameRate

SESSION_WIDE_HZ = 4.0
"""Wide frames while a job works: its own looks bring more."""
LIVE_AGE_MS = 500.0
"""Older than this, a live wide frame is waited for: the camera has stalled."""
LONGEST_WAIT_S = 0.1


class LiveViews:
    """Paces the live views and counts what they show."""

    def __init__(self, *, sink: PictureSink, clock: Clock, wide_hz: float, fovea_hz: float) -> None:
        self.rates = {role: FrameRate() for role in Role}
        self._sink = sink
        self._clock = clock
        self._wide_hz = wide_hz
        self._fovea_hz = fovea_hz
        self._wide_due_ns = 0
        self._look_due_ns = 0

    def show(self, frame: Frame) -> None:
        """Publish a frame unless it was shown before."""
        if self.rates[frame.role].add(frame):
            self._sink.publish_frame(frame)

    def show_sighting(self, sighting: Sighting) -> None:
        """Publish what one look saw."""
        for frame in (sighting.wide, sighting.left, sighting.right):
            self.show(frame)

    def wide_due(self) -> bool:
        """Tell whether a wide frame is due."""
        return self._clock.now_ns() >= self._wide_due_ns

    def look_due(self) -> bool:
        """Tell whether a look for the live fovea views is due."""
        return self._clock.now_ns() >= self._look_due_ns

    def take_wide(self, rig: Rig, *, max_age_ms: float | None, in_session: bool) -> Frame:
        """Show and return the newest wide frame; the next is due one period after this began."""
        rate_hz = min(self._wide_hz, SESSION_WIDE_HZ) if in_session else self._wide_hz
        self._wide_due_ns = self._clock.now_ns() + round(1e9 / rate_hz)
        frame = rig.wide.latest(max_age_ms=LIVE_AGE_MS if max_age_ms is None else max_age_ms)
        self.show(frame)
        return frame

    def look_begins(self) -> None:
        """Begin a new period of the live fovea views."""
        self._look_due_ns = self._clock.now_ns() + round(1e9 / self._fovea_hz)

    def wait_s(self, *, looks: bool) -> float:
        """Return how long nothing is due."""
        due_ns = min(self._wide_due_ns, self._look_due_ns) if looks else self._wide_due_ns
        return min(LONGEST_WAIT_S, max(0.0, (due_ns - self._clock.now_ns()) / 1e9))
