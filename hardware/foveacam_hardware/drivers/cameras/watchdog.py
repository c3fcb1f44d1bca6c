"""Judges silence and broken frames: when a camera is degraded, when asked, when lost.

Pure: it is told what was heard and when. A triggered camera may be silent for as long as it likes.
"""

from collections import deque
from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import AutoMode, CameraSettings

PERIODS = 5
"""Frames in a row that may be missing before a free-running camera counts as lost."""
BAD_FRAMES = 3
BAD_WINDOW_NS = 2_000_000_000
"""So many broken or missing frames within this time make a camera degraded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchdogTimeouts:
    """How long each thing may take; the defaults suit cameras on a network.

    `silence_*`: limits of the time without frames of a free-running camera. `ask`: how often a silent
    triggered camera is asked for a register. The rest: deadlines of calls into the vendor's library; `alive`
    is that of all short ones while it streams, so that a camera that stops in the middle of one is noticed.
    """

    silence_least_ns: int = 500_000_000
    silence_most_ns: int = 1_000_000_000
    first_ns: int = 2_000_000_000
    """How long the first frame of a run may take: cameras have to start, and so have threads."""
    ask_ns: int = 300_000_000
    open_ns: int = 10_000_000_000
    call_ns: int = 5_000_000_000
    run_ns: int = 2_000_000_000
    """To start or to stop."""
    alive_ns: int = 500_000_000
    abandon_ns: int = 3_000_000_000
    """How long after its deadline a call that does not return is given up with its thread."""
    reconnect_ns: int = 500_000_000
    """How long `connect` waits for the next attempt on a camera that is known to be lost."""
    backoff_first_ns: int = 250_000_000
    backoff_most_ns: int = 2_000_000_000


class WatchdogAdvice(StrEnum):
    """What is to be done about silence."""

    WAIT = "wait"
    ASK = "ask"
    LOST = "lost"


class Watchdog:
    """Watches one run of a camera."""

    def __init__(self, settings: CameraSettings, *, patience: WatchdogTimeouts, now_ns: int) -> None:
        self._triggered = settings.triggered
        self._patience = patience
        self._heard_ns = self._answered_ns = now_ns
        self._begun = False
        self._bad: deque[int] = deque(maxlen=BAD_FRAMES)
        self.limit_ns = _limit_ns(settings, patience)
        """A camera slower than the limits is given a frame and a half."""

    def adjust(self, settings: CameraSettings) -> None:
        """Go on with what the camera has set itself to."""
        self.limit_ns = _limit_ns(settings, self._patience)

    def heard(self, now_ns: int) -> None:
        """A buffer came, good or bad."""
        self._heard_ns = self._answered_ns = now_ns
        self._begun = True

    def answered(self, now_ns: int) -> None:
        """A register was read."""
        self._answered_ns = now_ns

    def bad(self, now_ns: int) -> None:
        """A frame was broken or missing."""
        self._bad.append(now_ns)

    def silent_ns(self, now_ns: int) -> int:
        """Return how long no buffer has come."""
        return now_ns - self._heard_ns

    def unsound(self, now_ns: int) -> bool:
        """Tell whether too many frames of late were broken or missing."""
        return len(self._bad) == BAD_FRAMES and now_ns - self._bad[0] <= BAD_WINDOW_NS

    def advice(self, now_ns: int) -> WatchdogAdvice:
        """Say what to do when no buffer came just now."""
        if self._triggered:
            return (
                WatchdogAdvice.ASK
                if now_ns - self._answered_ns >= self._patience.ask_ns
                else WatchdogAdvice.WAIT
            )
        return WatchdogAdvice.LOST if self.silent_ns(now_ns) >= self._allowed_ns else WatchdogAdvice.WAIT

    def worry(self, now_ns: int) -> str | None:
        """Return that a free-running camera has been silent for half of what it may be, in words."""
        silent_ns = self.silent_ns(now_ns)
        if self._triggered or 2 * silent_ns < self._allowed_ns:
            return None
        return f"no frame for {silent_ns / 1e9:.1f} s"

    @property
    def _allowed_ns(self) -> int:
        return self.limit_ns if self._begun else max(self.limit_ns, self._patience.first_ns)


def _limit_ns(settings: CameraSettings, patience: WatchdogTimeouts) -> int:
    """Return how long a free-running camera may be silent; longest where it may choose to expose longer."""
    period_ns = round(1e9 / settings.frame_rate_hz)
    by_hand = settings.exposure_auto is AutoMode.OFF
    least_ns = patience.silence_least_ns if by_hand else patience.silence_most_ns
    wanted_ns = max(least_ns, min(patience.silence_most_ns, PERIODS * period_ns))
    return max(wanted_ns, settings.exposure_ns + 3 * period_ns // 2)
