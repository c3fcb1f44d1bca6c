"""One run of a camera, from start to stop: checks, times, numbers and counts its buffers."""

from foveacam_hardware.contract import CameraSettings, Frame, Role, TriggerSource
from foveacam_hardware.drivers.cameras.device import Grab
from foveacam_hardware.drivers.cameras.frame_checks import BufferAction, FrameChecks
from foveacam_hardware.drivers.cameras.frame_times import ExposureTimes
from foveacam_hardware.drivers.cameras.host_binning import average_2x2
from foveacam_hardware.drivers.cameras.shared_state import CameraSharedState
from foveacam_hardware.drivers.cameras.watchdog import Watchdog, WatchdogTimeouts

UNDERRUNS_NS = 1_000_000_000
"""Period of reading the library's underrun count."""
LATE_NS = 50_000_000
"""Latency, or one frame period if longer, above which a frame counts as late."""
EXPOSES_NS = 1_000_000_000
"""Time after a software trigger, beyond the exposure, within which its frame must arrive."""


class CameraRun:
    """Turns the buffers of one run into frames; used by one thread."""

    def __init__(
        self,
        role: Role,
        settings: CameraSettings,
        *,
        shared: CameraSharedState,
        times: ExposureTimes,
        timeouts: WatchdogTimeouts,
        first_seq: int,
        now_ns: int,
        host_averages: bool = False,
    ) -> None:
        self._role = role
        self._settings = settings
        self._host_averages = host_averages
        self._shared = shared
        self._times = times
        self._epoch = shared.state.link.epoch
        self._checks = FrameChecks(settings.pixel_format, first_seq=first_seq)
        self.watchdog = Watchdog(settings, timeouts=timeouts, now_ns=now_ns)
        self._by_command = settings.triggered and settings.trigger_source is TriggerSource.SOFTWARE
        self._awaited_until_ns = now_ns
        self._awaited = 0
        self._late_ns = _late_after_ns(settings)
        self._underruns = 0
        self._underruns_ns = now_ns
        self._last_fault = ""

    @property
    def next_seq(self) -> int:
        """Number of the next frame; the next run continues with it."""
        return self._checks.next_seq

    def adjust(self, settings: CameraSettings) -> None:
        """Use the settings that the camera has chosen by itself."""
        self._settings = settings
        self._late_ns = _late_after_ns(settings)
        self.watchdog.adjust(settings)

    @property
    def waits_for_command(self) -> bool:
        """Whether no frame can arrive before a software trigger."""
        return self._by_command and self._awaited == 0

    def await_exposure(self, now_ns: int) -> None:
        """Expect a frame: a software trigger was sent."""
        self._awaited += 1
        self._awaited_until_ns = now_ns + self._settings.exposure_ns + EXPOSES_NS

    def make_frame(self, grab: Grab, *, now_ns: int) -> Frame | None:
        """Check and count a buffer; return its frame when it is good."""
        self._awaited = max(0, self._awaited - 1)
        self.watchdog.note_buffer(now_ns)
        verdict = self._checks.judge(grab)
        good = verdict.action is BufferAction.GOOD
        image = grab.image
        if verdict.missing or not good:
            self.watchdog.note_bad_frame(now_ns)
            self._last_fault = verdict.reason or f"{verdict.missing} frames are missing"
            self._shared.count(
                dropped=verdict.missing,
                incomplete=verdict.action is BufferAction.INCOMPLETE,
                late=verdict.action is BufferAction.LATE,
            )
        if not good or image is None:
            return None
        exposure_ns = self._settings.exposure_ns
        t_ns = self._times.middle_ns(grab, exposure_ns=exposure_ns)
        if grab.t_host_ns - t_ns - exposure_ns // 2 > self._late_ns:
            self._shared.count(late=1)
        return Frame(
            image=average_2x2(image) if self._host_averages else image,
            role=self._role,
            seq=verdict.seq,
            t_ns=t_ns,
            exposure_ns=exposure_ns,
            bits=grab.bits,
            epoch=self._epoch,
            binning=self._settings.binning,
        )

    def expire_triggers(self, now_ns: int) -> None:
        """Count software triggers whose frames did not arrive in time as dropped."""
        if self._awaited and now_ns > self._awaited_until_ns:
            self._shared.count(dropped=self._awaited)
            self.watchdog.note_bad_frame(now_ns)
            self._last_fault = f"{self._awaited} exposures were asked for and gave no frame"
            self._awaited = 0

    def underruns_due(self, now_ns: int) -> bool:
        """Return whether the library's underrun count should be read."""
        return now_ns - self._underruns_ns >= UNDERRUNS_NS

    def count_underruns(self, underruns: int, *, now_ns: int) -> None:
        """Update the underrun counter from the library's count since the start."""
        self._underruns_ns = now_ns
        if underruns != self._underruns:
            self.watchdog.note_bad_frame(now_ns)
            self._last_fault = (
                f"{underruns - self._underruns} frames found no buffer: this machine is too busy"
            )
            self._underruns = underruns
            self._shared.count(underrun=underruns)

    def degradation(self, now_ns: int) -> str | None:
        """Return why the camera is degraded; None when it is not."""
        if self.watchdog.has_many_bad_frames(now_ns):
            return self._last_fault
        return self.watchdog.describe_silence(now_ns)


def _late_after_ns(settings: CameraSettings) -> int:
    return max(LATE_NS, round(1e9 / settings.frame_rate_hz))
