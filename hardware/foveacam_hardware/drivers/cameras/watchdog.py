"""Decides from missing and corrupt frames whether a camera is degraded, should be polled, or is lost.

Pure: events and times are passed in. A triggered camera may be silent for any time.
"""

from collections import deque
from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import AutoMode, CameraSettings

PERIODS = 5
"""Consecutive missing frames after which a free-running camera counts as lost."""
BAD_FRAMES = 3
BAD_WINDOW_NS = 2_000_000_000
"""`BAD_FRAMES` corrupt or missing frames within this time make a camera degraded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchdogTimeouts:
    """Timeouts of a supervised camera; the defaults suit cameras on a network.

    `silence_*`: limits of the time without frames of a free-running camera. `ask`: period of reading a
    register of a silent triggered camera. The rest: deadlines of calls into the vendor's library; `alive` is
    that of all short calls while streaming, so that a camera that stops during one is noticed.
    """

    silence_least_ns: int = 500_000_000
    silence_most_ns: int = 1_000_000_000
    first_ns: int = 2_000_000_000
    """Limit for the first frame of a run, in which camera and threads have to start."""
    ask_ns: int = 300_000_000
    open_ns: int = 10_000_000_000
    call_ns: int = 5_000_000_000
    run_ns: int = 2_000_000_000
    """Deadline of starting and stopping."""
    alive_ns: int = 500_000_000
    abandon_ns: int = 3_000_000_000
    """Time after its deadline at which a hanging call is abandoned with its thread."""
    reconnect_ns: int = 500_000_000
    """Wait of `connect` for a camera that is known to be lost."""
    backoff_first_ns: int = 250_000_000
    backoff_most_ns: int = 2_000_000_000


class WatchdogAdvice(StrEnum):
    """Action to take on silence."""

    WAIT = "wait"
    ASK = "ask"
    LOST = "lost"


class Watchdog:
    """Monitors one run of a camera."""

    def __init__(self, settings: CameraSettings, *, timeouts: WatchdogTimeouts, now_ns: int) -> None:
        self._triggered = settings.triggered
        self._timeouts = timeouts
        self._buffer_ns = self._answered_ns = now_ns
        self._streaming = False
        self._bad: deque[int] = deque(maxlen=BAD_FRAMES)
        self.limit_ns = _limit_ns(settings, timeouts)
        """Allowed silence; at least the exposure and one and a half frame periods."""

    def adjust(self, settings: CameraSettings) -> None:
        """Use the settings that the camera has chosen by itself."""
        self.limit_ns = _limit_ns(settings, self._timeouts)

    def note_buffer(self, now_ns: int) -> None:
        """Record that a buffer arrived, good or bad."""
        self._buffer_ns = self._answered_ns = now_ns
        self._streaming = True

    def note_answer(self, now_ns: int) -> None:
        """Record that a register was read."""
        self._answered_ns = now_ns

    def note_bad_frame(self, now_ns: int) -> None:
        """Record that a frame was corrupt or missing."""
        self._bad.append(now_ns)

    def silent_ns(self, now_ns: int) -> int:
        """Return the time since the last buffer."""
        return now_ns - self._buffer_ns

    def has_many_bad_frames(self, now_ns: int) -> bool:
        """Return whether too many recent frames were corrupt or missing."""
        return len(self._bad) == BAD_FRAMES and now_ns - self._bad[0] <= BAD_WINDOW_NS

    def advice(self, now_ns: int) -> WatchdogAdvice:
        """Return what to do when no buffer has arrived."""
        if self._triggered:
            return (
                WatchdogAdvice.ASK
                if now_ns - self._answered_ns >= self._timeouts.ask_ns
                else WatchdogAdvice.WAIT
            )
        return WatchdogAdvice.LOST if self.silent_ns(now_ns) >= self._allowed_ns else WatchdogAdvice.WAIT

    def describe_silence(self, now_ns: int) -> str | None:
        """Return a message when a free-running camera has been silent for half of the allowed time."""
        silent_ns = self.silent_ns(now_ns)
        if self._triggered or 2 * silent_ns < self._allowed_ns:
            return None
        return f"no frame for {silent_ns / 1e9:.1f} s"

    @property
    def _allowed_ns(self) -> int:
        return self.limit_ns if self._streaming else max(self.limit_ns, self._timeouts.first_ns)


def _limit_ns(settings: CameraSettings, timeouts: WatchdogTimeouts) -> int:
    """Return the allowed silence of a free-running camera, the upper limit when its exposure is automatic."""
    period_ns = round(1e9 / settings.frame_rate_hz)
    manual = settings.exposure_auto is AutoMode.OFF
    least_ns = timeouts.silence_least_ns if manual else timeouts.silence_most_ns
    wanted_ns = max(least_ns, min(timeouts.silence_most_ns, PERIODS * period_ns))
    return max(wanted_ns, settings.exposure_ns + 3 * period_ns // 2)
