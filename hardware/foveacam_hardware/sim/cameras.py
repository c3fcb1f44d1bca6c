"""The simulated cameras, behind the contract's `Camera`.

They run no threads: the reader renders a frame for the time of its exposure. A frame can be read once its
exposure and readout are over on the rig's clock, however long rendering takes.
"""

import threading
from collections.abc import Iterator
from dataclasses import replace

from foveacam_hardware.contract import (
    AutoMode,
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
    NotConnected,
    PixelFormat,
    Role,
    Timeout,
    TriggerSource,
)
from foveacam_hardware.sim.assembly import delivered_image, is_lost
from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.sim.exposures import (
    CameraExposure,
    ExposureSchedule,
    FreeRunningSchedule,
    TriggeredSchedule,
    next_exposure,
    overexposure_log2,
)
from foveacam_hardware.sim.sensor import (
    image_from_radiance,
    longest_exposure_ns,
    ranges_at,
    supported_settings,
)
from foveacam_hardware.sim.world import World

POLL_NS = 1_000_000
"""Interval at which a reader checks for a trigger; it costs no time on a virtual clock."""
LATEST_TIMEOUT_MS = 1000.0
DEFAULT_EXPOSURE_NS = 8_000_000  # one period of mains flicker; well exposed in the shipped scenes
CAMERA_NUMBER = {Role.WIDE: 0, Role.LEFT: 1, Role.RIGHT: 2}


def default_settings(role: Role) -> CameraSettings:
    """Return the default settings of a camera of the simulated rig."""
    return CameraSettings(
        exposure_ns=DEFAULT_EXPOSURE_NS,
        frame_rate_hz=30.0,
        pixel_format=PixelFormat.RGB8,
        triggered=role is not Role.WIDE,
    )


class SimCamera:
    """One simulated camera; any thread may read, and each frame is delivered once."""

    def __init__(self, world: World, role: Role, *, clock: Clock) -> None:
        self._world = world
        self._role = role
        self._assembly = world.assembly.camera(role)
        self._optics = world.assembly.optics_of(role)
        self._clock = clock
        self._lock = threading.RLock()
        self._connected = False
        self._settings = supported_settings(role, default_settings(role))
        self._schedule: ExposureSchedule | None = None
        self._seq = 0
        self._epoch = 0
        self._delivered = 0
        self._skipped = 0
        self._missed = 0
        """Missed triggers of earlier schedules."""
        self._last: Frame | None = None
        world.connect_shutter(role, self)

    @property
    def role(self) -> Role:
        """The camera's role on the rig."""
        return self._role

    @property
    def info(self) -> DeviceInfo:
        """Vendor, model and serial number."""
        model = "wide 10.9 mm" if self._role is Role.WIDE else "fovea 100 mm"
        number = 100 * self._world.seed + CAMERA_NUMBER[self._role]
        return DeviceInfo(
            vendor="FoveaCam Duo simulation", model=f"IMX273 {model}", serial=f"SIM-{number:06d}", version="1"
        )

    @property
    def settings(self) -> CameraSettings:
        """The settings in force; with automatic exposure, as of the last frame delivered."""
        return self._settings

    @property
    def counters(self) -> CameraCounters:
        """Frames delivered, skipped and missed since `start`; no rendered frame is incomplete or late."""
        missed = self._missed + (0 if self._schedule is None else self._schedule.missed)
        return CameraCounters(delivered=self._delivered, skipped=self._skipped, dropped=missed)

    @property
    def waiting(self) -> int:
        """Always 0: a frame is rendered when it is read."""
        return 0

    @property
    def ranges(self) -> CameraRanges:
        """The ranges of the sensor's settings, at the binning in force."""
        return ranges_at(self._settings.binning)

    @property
    def link(self) -> CameraLink:
        """The state of the connection: closed, ready or streaming; lost while unplugged."""
        if self._role in self._world.faults.unplugged:
            reason = f"serial {self.info.serial} is not on the bus"
            return CameraLink(phase=CameraPhase.LOST, reason=reason, epoch=self._epoch)
        phase = CameraPhase.STREAMING if self._schedule is not None else CameraPhase.READY
        return CameraLink(phase=phase if self._connected else CameraPhase.CLOSED, epoch=self._epoch)

    def connect(self) -> None:
        """Open the camera."""
        if self._role in self._world.faults.unplugged:
            raise NotConnected(
                f"camera {self._role}: serial {self.info.serial} is not on the bus; plug it in and reconnect"
            )
        if not self._connected:
            self._epoch += 1
        self._connected = True

    def close(self) -> None:
        """Stop and disconnect; no effect when closed."""
        self.stop()
        self._connected = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply settings from the next exposure on; return the settings in force."""
        self._require_connected("configure")
        supported = supported_settings(self._role, settings)
        with self._lock:
            if supported.binning != self._settings.binning:
                self._last = None  # `latest` returns no frame of another size
            self._settings = supported
            if self._schedule is not None:
                self._start_schedule()
        return supported

    def start(self) -> None:
        """Start to expose, and reset the counters."""
        self._require_connected("start")
        with self._lock:
            if self._schedule is None:
                self._delivered = self._skipped = self._missed = 0
                self._start_schedule()

    def stop(self) -> None:
        """Stop exposing, and discard the frames not read."""
        with self._lock:
            if self._schedule is not None:
                self._seq = self._schedule.next_seq
                self._missed += self._schedule.missed
            self._schedule = None
            self._last = None

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Return the next frame not yet read."""
        deadline_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while True:
            exposure = self._await_first(deadline_ns)
            with self._lock:
                first = self._running().oldest(self._clock.now_ns())
                if first is None or first.seq != exposure.seq:  # another reader consumed it meanwhile
                    continue
                if not self._is_lost(exposure):
                    return self._deliver(exposure)

    def latest(self, *, max_age_ms: float) -> Frame:
        """Return the newest frame, waiting for one when it is older than `max_age_ms`."""
        with self._lock:
            now_ns = self._clock.now_ns()
            oldest_ns = now_ns - round(max_age_ms * 1e6)
            exposure = self._running().newest(now_ns)
            if exposure is not None and self._is_lost(exposure):
                exposure = None
            if exposure is not None and exposure.interval.middle_ns >= oldest_ns:
                return self._deliver(exposure)
            if exposure is None and self._last is not None and self._last.t_ns >= oldest_ns:
                return self._last
            if exposure is not None:  # too old for the caller, as is everything before it
                self._skipped += 1 + self._running().consume(exposure)
        return self.read(timeout_ms=LATEST_TIMEOUT_MS)

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Yield the next `n` frames in order."""
        for _ in range(n):
            yield self.read(timeout_ms=timeout_ms)

    def software_trigger(self) -> None:
        """Expose one frame now."""
        self._require_connected("expose")
        schedule = self._schedule
        if self._settings.trigger_source is not TriggerSource.SOFTWARE or not isinstance(
            schedule, TriggeredSchedule
        ):
            raise InvalidInput(
                f"camera {self._role}: asked to expose by software, but it runs freely, waits for its line "
                "or is stopped; configure it as triggered by software and start it"
            )
        schedule.trigger(self._clock.now_ns())

    def trigger(self, t_ns: int) -> None:
        """Expose on a rising edge of the trigger line; ignored unless the camera waits for one."""
        schedule = self._schedule
        if isinstance(schedule, TriggeredSchedule) and self._waits_for_line:
            schedule.trigger(t_ns + (TRIGGER_TO_EXPOSURE_US + self._delay_us) * 1000)

    def strobe_us(self) -> int | None:
        """Return the exposure that a trigger now would start, microseconds."""
        waiting = isinstance(self._schedule, TriggeredSchedule) and self._waits_for_line
        return self._settings.exposure_ns // 1000 if waiting else None

    @property
    def _delay_us(self) -> int:
        return 0 if self._role is Role.WIDE else self._world.assembly.eye(self._role).exposure_delay_us

    def _is_lost(self, exposure: CameraExposure) -> bool:
        """Return whether a frame never arrives; then consume it and count it."""
        if not is_lost(self._assembly, self._role, exposure.seq):
            return False
        self._skipped += self._running().consume(exposure)
        self._missed += 1
        return True

    @property
    def _waits_for_line(self) -> bool:
        return self._connected and self._settings.trigger_source is TriggerSource.HARDWARE

    def _start_schedule(self) -> None:
        seq = self._seq if self._schedule is None else self._schedule.next_seq
        self._missed += 0 if self._schedule is None else self._schedule.missed
        if self._settings.triggered:
            self._schedule = TriggeredSchedule(self._settings, first_seq=seq)
        else:
            self._schedule = FreeRunningSchedule(self._settings, start_ns=self._clock.now_ns(), first_seq=seq)

    def _await_first(self, deadline_ns: int) -> CameraExposure:
        """Wait for the oldest exposure that can be read; raise `Timeout` at the deadline."""
        while True:
            now_ns = self._clock.now_ns()
            exposure = self._running().oldest(now_ns)
            wake_ns = now_ns + POLL_NS if exposure is None else exposure.ready_ns
            if exposure is not None and wake_ns <= now_ns:
                return exposure
            if now_ns >= deadline_ns:
                raise Timeout(self._timeout_text())
            self._clock.sleep_until_ns(min(wake_ns, deadline_ns))

    def _deliver(self, exposure: CameraExposure) -> Frame:
        schedule = self._running()
        self._skipped += schedule.consume(exposure)
        settings = exposure.settings
        frame = self._last = Frame(
            image=self._image(exposure),
            role=self._role,
            seq=exposure.seq,
            t_ns=exposure.interval.middle_ns,
            exposure_ns=settings.exposure_ns,
            bits=12 if settings.pixel_format is PixelFormat.MONO12 else 8,
            epoch=self._epoch,
            binning=settings.binning,
        )
        self._delivered += 1
        if self._settings.exposure_auto is not AutoMode.OFF and settings == self._settings:
            self._adjust_exposure(frame, schedule)
        return frame

    def _adjust_exposure(self, frame: Frame, schedule: ExposureSchedule) -> None:
        """Set the exposure of the next frame not begun, from the brightness of a delivered frame."""
        now = self._settings
        overexposure = overexposure_log2(frame.image, bits=frame.bits, black_level=now.black_level)
        found = next_exposure(now.exposure_ns, overexposure, longest_ns=longest_exposure_ns(now))
        once_is_over = found.settled and now.exposure_auto is AutoMode.ONCE
        mode = AutoMode.OFF if once_is_over else now.exposure_auto
        requested = replace(now, exposure_ns=found.exposure_ns, exposure_auto=mode)
        supported = supported_settings(self._role, requested)
        if supported != now:
            self._settings = supported
            schedule.adjust(supported, now_ns=self._clock.now_ns())

    def _image(self, exposure: CameraExposure) -> Image:
        if self._role in self._world.faults.frozen and self._last is not None:
            return self._last.image
        channels = 3 if exposure.settings.pixel_format is PixelFormat.RGB8 else 1
        radiance = self._world.radiance(
            self._optics, exposure.interval, channels=channels, binning=exposure.settings.binning
        )
        key = (self._world.seed, CAMERA_NUMBER[self._role], exposure.seq)
        image = image_from_radiance(
            radiance, self._optics, exposure.settings, key=key, defocus_px=self._assembly.defocus_px
        )
        return delivered_image(
            image,
            self._assembly,
            self._role,
            bits=12 if exposure.settings.pixel_format is PixelFormat.MONO12 else 8,
            binning=exposure.settings.binning,
            seq=exposure.seq,
        )

    def _running(self) -> ExposureSchedule:
        self._require_connected("read")
        if self._schedule is None:
            raise InvalidInput(f"camera {self._role}: asked for a frame, but it is stopped; start it first")
        return self._schedule

    def _require_connected(self, action: str) -> None:
        if self._role in self._world.faults.unplugged:
            self._connected = False
        if not self._connected:
            raise NotConnected(
                f"camera {self._role}: asked to {action}, but it is not connected; plug it in and reconnect"
            )

    def _timeout_text(self) -> str:
        if self._settings.triggered:
            return f"camera {self._role}: no trigger arrived in time; check the trigger cable, or trigger it"
        return f"camera {self._role}: no frame in time; allow more than its exposure and frame period"
