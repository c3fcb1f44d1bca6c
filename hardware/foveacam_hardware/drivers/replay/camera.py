"""A camera that plays a recording. There is no thread: the reader loads a frame from the file when due."""

import threading
from collections.abc import Iterator
from dataclasses import replace

from foveacam_hardware.contract import (
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceInfo,
    Frame,
    Image,
    InvalidInput,
    MirrorVolts,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Role,
    Timeout,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.host_binning import average_2x2
from foveacam_hardware.drivers.cameras.ranges import refuse_binning, refuse_outside
from foveacam_hardware.drivers.replay.source import RecordedCamera
from foveacam_hardware.drivers.replay.timeline import PlaybackTimeline

BACKLOG = 8
"""Frames buffered for a slow reader; older ones are skipped and counted."""
LATEST_TIMEOUT_MS = 1000.0
ENDED = "the recording is at its end; play it again, or in a loop"


class ReplayCamera:
    """One camera of a recording as the contract's Camera; any thread may read, each frame goes to one reader.

    Times are the clock's; images, volts and exposures are the recorded ones. Nothing can be set but binning 2
    of what was recorded at 1. A frame states its own binning, also where the recording changes it.
    """

    def __init__(
        self, role: Role, recorded: RecordedCamera, timeline: PlaybackTimeline, *, clock: Clock
    ) -> None:
        self._role = role
        self._recorded = recorded
        self._timeline = timeline
        self._clock = clock
        self._lock = threading.RLock()
        self._times_ns = recorded.t_ns
        self._settings = _settings_of(recorded, speed=timeline.speed)
        self._recorded_binning = self._settings.binning
        self._connected = self._started = False
        self._epoch = 0
        self._next = 0
        self._delivered = self._skipped = 0
        self._last: Frame | None = None

    @property
    def role(self) -> Role:
        """Role of the camera in the rig."""
        return self._role

    @property
    def info(self) -> DeviceInfo:
        """Identity of the recorded camera."""
        return self._recorded.info

    @property
    def settings(self) -> CameraSettings:
        """The recorded settings, with the playback rate."""
        return self._settings

    @property
    def counters(self) -> CameraCounters:
        """Frames delivered and skipped since `start`."""
        return CameraCounters(delivered=self._delivered, skipped=self._skipped)

    @property
    def waiting(self) -> int:
        """Number of due frames not yet read, `BACKLOG` at most."""
        with self._lock:
            newest = self._newest(self._clock.now_ns())
            return min(max(0, newest - self._next + 1), BACKLOG) if self._started else 0

    @property
    def ranges(self) -> CameraRanges:
        """Ranges that contain only the recorded values."""
        now = self._settings
        return CameraRanges(
            exposure_ns=ValueRange(low=now.exposure_ns, high=now.exposure_ns),
            gain_db=ValueRange(low=now.gain_db, high=now.gain_db),
            frame_rate_hz=ValueRange(low=now.frame_rate_hz, high=now.frame_rate_hz),
            black_level=ValueRange(low=now.black_level, high=now.black_level),
            pixel_formats=(now.pixel_format,),
            binnings=(1, 2) if self._recorded_binning == 1 else (2,),
        )

    @property
    def link(self) -> CameraLink:
        """Closed, ready or streaming; lost once the recording is over."""
        if not self._connected:
            return CameraLink(phase=CameraPhase.CLOSED, epoch=self._epoch)
        if not self._started:
            return CameraLink(phase=CameraPhase.READY, epoch=self._epoch)
        if self._moment_ns(self._next) is None:
            return CameraLink(phase=CameraPhase.LOST, reason=ENDED, epoch=self._epoch)
        return CameraLink(phase=CameraPhase.STREAMING, epoch=self._epoch)

    def connect(self) -> None:
        """Mark as connected."""
        if not self._connected:
            self._epoch += 1
        self._connected = True

    def close(self) -> None:
        """Stop; do nothing when closed. The recording itself is closed by the rig."""
        self.stop()
        self._connected = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Accept the recorded settings and binning 2; raise `OutOfRange` or `InvalidInput` for others."""
        self._require_connected("configure")
        refuse_binning(f"camera {self._role}", settings, self.ranges)
        try:
            refuse_outside(settings, self.ranges)
        except OutOfRange as error:
            raise OutOfRange(f"camera {self._role}: {error}; it plays a recording") from error
        if settings.triggered:
            raise OutOfRange(
                f"camera {self._role}: asked to wait for a trigger, but it plays a recording;"
                " let it run freely"
            )
        with self._lock:
            if settings.binning != self._settings.binning:
                self._settings = replace(self._settings, binning=settings.binning)
                self._last = None
        return self._settings

    def start(self) -> None:
        """Start delivering frames exposed from now on, and reset the counters."""
        self._require_connected("start")
        with self._lock:
            if not self._started:
                self._timeline.begin()
                self._delivered = self._skipped = 0
                self._next = max(
                    self._next, self._timeline.newest(self._times_ns, self._clock.now_ns() - 1) + 1
                )
                self._started = True

    def stop(self) -> None:
        """Stop delivering; the recording keeps running."""
        with self._lock:
            self._started = False
            self._last = None

    def software_trigger(self) -> None:
        """Raise `InvalidInput`: a recording cannot be triggered."""
        raise InvalidInput(
            f"camera {self._role}: asked to expose, but it plays a recording; take a live camera, and"
            " configure it as triggered by software"
        )

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Return the oldest frame not yet read; raise `Timeout` at once at the recording's end."""
        deadline_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while True:
            now_ns = self._clock.now_ns()
            with self._lock:
                self._require_started()
                self._skip_old(now_ns)
                ready_ns = self._ready_ns(self._next)
                if ready_ns is not None and ready_ns <= now_ns:
                    return self._deliver(self._next)
            if ready_ns is None:
                raise Timeout(f"camera {self._role}: {ENDED}")
            if now_ns >= deadline_ns:
                raise Timeout(
                    f"camera {self._role}: no frame in time; the recording has its next one"
                    f" {(ready_ns - now_ns) / 1e6:.0f} ms later; allow more"
                )
            self._clock.sleep_until_ns(min(ready_ns, deadline_ns))

    def latest(self, *, max_age_ms: float) -> Frame:
        """Return the newest frame, waiting for one when it is older than `max_age_ms`."""
        with self._lock:
            self._require_started()
            now_ns = self._clock.now_ns()
            oldest_ns = now_ns - round(max_age_ms * 1e6)
            newest = self._newest(now_ns)
            if newest >= self._next:
                self._skipped += newest - self._next
                self._next = newest
                if (self._moment_ns(newest) or 0) >= oldest_ns:
                    return self._deliver(newest)
                self._skipped, self._next = self._skipped + 1, newest + 1
            elif self._last is not None and self._last.t_ns >= oldest_ns:
                return self._last
        return self.read(timeout_ms=LATEST_TIMEOUT_MS)

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Yield the next `n` frames in order."""
        for _ in range(n):
            yield self.read(timeout_ms=timeout_ms)

    def volts_at(self, now_ns: int) -> MirrorVolts | None:
        """Return the recorded drive of this fovea's mirror at a time of the clock."""
        number = max(0, self._timeline.newest(self._times_ns, now_ns))
        return self._recorded.volts(number % len(self._times_ns))

    def _deliver(self, number: int) -> Frame:
        recorded = self._recorded.frame(number % len(self._times_ns))
        self._next = number + 1
        self._delivered += 1
        exposure_ns = recorded.exposure_ns
        averages = recorded.binning < self._settings.binning
        self._last = Frame(
            image=average_2x2(recorded.image) if averages else recorded.image,
            role=self._role,
            seq=number,
            t_ns=self._moment_ns(number) or 0,
            exposure_ns=self._settings.exposure_ns if exposure_ns is None else exposure_ns,
            bits=recorded.bits,
            volts=recorded.volts,
            frame_id=recorded.frame_id,
            epoch=self._epoch,
            binning=self._settings.binning if averages else recorded.binning,
        )
        return self._last

    def _moment_ns(self, number: int) -> int | None:
        return self._timeline.moment_ns(self._times_ns, number)

    def _ready_ns(self, number: int) -> int | None:
        """Return the end of a frame's exposure; None when there is no such frame."""
        moment_ns = self._moment_ns(number)
        return None if moment_ns is None else moment_ns + self._settings.exposure_ns // 2

    def _newest(self, now_ns: int) -> int:
        return self._timeline.newest(self._times_ns, now_ns - self._settings.exposure_ns // 2)

    def _skip_old(self, now_ns: int) -> None:
        oldest = self._newest(now_ns) - BACKLOG + 1
        if oldest > self._next:
            self._skipped += oldest - self._next
            self._next = oldest

    def _require_started(self) -> None:
        self._require_connected("read")
        if not self._started:
            raise InvalidInput(f"camera {self._role}: asked for a frame, but it is stopped; start it first")

    def _require_connected(self, action: str) -> None:
        if not self._connected:
            raise NotConnected(f"camera {self._role}: asked to {action}, but it is closed; connect it first")


def _settings_of(recorded: RecordedCamera, *, speed: float) -> CameraSettings:
    """Return the settings of the recording, from its first frame."""
    first, times_ns = recorded.frame(0), recorded.t_ns
    span_ns = int(times_ns[-1] - times_ns[0])
    rate_hz = (len(times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 1.0
    return CameraSettings(
        exposure_ns=first.exposure_ns or 0,
        frame_rate_hz=rate_hz * speed,
        pixel_format=_format_of(first.image),
        binning=first.binning,
    )


def _format_of(image: Image) -> PixelFormat:
    """Return the pixel format that yields such an image."""
    deep = image.dtype.itemsize > 1
    if image.ndim == 3:
        return PixelFormat.BAYER_RG12P if deep else PixelFormat.RGB8
    return PixelFormat.MONO12 if deep else PixelFormat.MONO8
