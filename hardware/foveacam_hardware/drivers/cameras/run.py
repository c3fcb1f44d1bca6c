"""One run of a camera, from start to stop: buffers are checked, timed, numbered and counted."""

from foveacam_hardware.contract import CameraSettings, Frame, Role, TriggerSource
from foveacam_hardware.drivers.cameras.device import Grab
from foveacam_hardware.drivers.cameras.frame_checks import BufferAction, FrameChecks
from foveacam_hardware.drivers.cameras.frame_times import ExposureTimes
from foveacam_hardware.drivers.cameras.shared_state import CameraSharedState
from foveacam_hardware.drivers.cameras.watchdog import Watchdog, WatchdogTimeouts

UNDERRUNS_NS = 1_000_000_000
"""How often the library is asked for its count."""
LATE_NS = 50_000_000
"""A frame that took this much longer than the quickest, or a frame period, is late."""
EXPOSES_NS = 1_000_000_000
"""How long after a command its frame is waited for, beyond the exposure."""


class CameraRun:
    """The frames of one run; one thread only."""

    def __init__(
        self,
        role: Role,
        settings: CameraSettings,
        *,
        desk: CameraSharedState,
        times: ExposureTimes,
        patience: WatchdogTimeouts,
        first_seq: int,
        now_ns: int,
    ) -> None:
        self._role = role
        self._settings = settings
        self._desk = desk
        self._times = times
        self._epoch = desk.state.link.epoch
        self._checks = FrameChecks(settings.pixel_format, first_seq=first_seq)
        self.watchdog = Watchdog(settings, patience=patience, now_ns=now_ns)
        self._by_command = settings.triggered and settings.trigger_source is TriggerSource.SOFTWARE
        self._awaited_until_ns = now_ns
        self._awaited = 0
        self._late_ns = _late_after_ns(settings)
        self._underruns = 0
        self._underruns_ns = now_ns
        self._last_fault = ""

    @property
    def next_seq(self) -> int:
        """The number of the next frame; another run goes on with it."""
        return self._checks.next_seq

    def adjust(self, settings: CameraSettings) -> None:
        """Go on with what the camera has set itself to."""
        self._settings = settings
        self._late_ns = _late_after_ns(settings)
        self.watchdog.adjust(settings)

    @property
    def waits_for_command(self) -> bool:
        """Whether no frame can come before somebody asks for one."""
        return self._by_command and self._awaited == 0

    def await_exposure(self, now_ns: int) -> None:
        """Expect a frame: the camera was told to expose."""
        self._awaited += 1
        self._awaited_until_ns = now_ns + self._settings.exposure_ns + EXPOSES_NS

    def take(self, grab: Grab, *, now_ns: int) -> Frame | None:
        """Judge a buffer; return its frame when it is good."""
        self._awaited = max(0, self._awaited - 1)
        self.watchdog.heard(now_ns)
        verdict = self._checks.judge(grab)
        good = verdict.fate is BufferAction.GOOD
        image = grab.image
        if verdict.missing or not good:
            self.watchdog.bad(now_ns)
            self._last_fault = verdict.reason or f"{verdict.missing} frames are missing"
            self._desk.count(
                dropped=verdict.missing,
                incomplete=verdict.fate is BufferAction.INCOMPLETE,
                late=verdict.fate is BufferAction.LATE,
            )
        if not good or image is None:
            return None
        exposure_ns = self._settings.exposure_ns
        t_ns = self._times.middle_ns(grab, exposure_ns=exposure_ns)
        if grab.t_host_ns - t_ns - exposure_ns // 2 > self._late_ns:
            self._desk.count(late=1)
        return Frame(
            image=image,
            role=self._role,
            seq=verdict.seq,
            t_ns=t_ns,
            exposure_ns=exposure_ns,
            bits=grab.bits,
            epoch=self._epoch,
        )

    def silent(self, now_ns: int) -> None:
        """Give up waiting for an exposure that was told and never came."""
        if self._awaited and now_ns > self._awaited_until_ns:
            self._desk.count(dropped=self._awaited)
            self.watchdog.bad(now_ns)
            self._last_fault = f"{self._awaited} exposures were asked for and gave no frame"
            self._awaited = 0

    def underruns_due(self, now_ns: int) -> bool:
        """Tell whether the library should be asked how many frames found no buffer."""
        return now_ns - self._underruns_ns >= UNDERRUNS_NS

    def count_underruns(self, underruns: int, *, now_ns: int) -> None:
        """Take the library's count since the start."""
        self._underruns_ns = now_ns
        if underruns != self._underruns:
            self.watchdog.bad(now_ns)
            self._last_fault = (
                f"{underruns - self._underruns} frames found no buffer: this machine is too busy"
            )
            self._underruns = underruns
            self._desk.count(underrun=underruns)

    def trouble(self, now_ns: int) -> str | None:
        """Return why the camera is degraded; None when it is sound."""
        if self.watchdog.unsound(now_ns):
            return self._last_fault
        return self.watchdog.worry(now_ns)


def _late_after_ns(settings: CameraSettings) -> int:
    return max(LATE_NS, round(1e9 / settings.frame_rate_hz))
