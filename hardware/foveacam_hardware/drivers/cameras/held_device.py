"""The vendor device owned by a camera's thread: opens and configures it, closes and reopens it on failure.

Every call into the vendor's library goes through `call`, with a deadline. Frames and commands are left to
`worker`.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from foveacam_hardware.contract import (
    Binning,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    NotConnected,
    Role,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice, ReadableSettings, ReadsItsClock
from foveacam_hardware.drivers.cameras.frame_times import ExposureTimes
from foveacam_hardware.drivers.cameras.ranges import refuse_outside
from foveacam_hardware.drivers.cameras.shared_state import BackOff, CameraSharedState
from foveacam_hardware.drivers.cameras.vendor_calls import VendorCalls
from foveacam_hardware.drivers.cameras.watchdog import WatchdogTimeouts

logger = logging.getLogger(__name__)

T = TypeVar("T")

READ_BACK_NS = 1_000_000_000
"""Period of reading the settings back from a camera with an automatic mode."""
NEVER_NS = 1 << 63
BINNINGS: tuple[Binning, ...] = (1, 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPlan:
    """Configuration of a camera: initial settings, sensor readout, buffered frames and timeouts."""

    settings: CameraSettings
    readout_ns: int = 0
    """Readout time of the sensor; used when the camera's clock cannot be read."""
    frames: int = 8
    """Number of frames buffered for the reader."""
    timeouts: WatchdogTimeouts = field(default_factory=WatchdogTimeouts)


class HeldDevice:
    """The device of one camera; every method is called by one thread."""

    def __init__(
        self,
        role: Role,
        factory: Callable[[], CameraDevice],
        *,
        shared: CameraSharedState,
        plan: CameraPlan,
        clock: Clock,
    ) -> None:
        self._role = role
        self._factory = factory
        self._shared = shared
        self._plan = plan
        self._timeouts = plan.timeouts
        self._clock = clock
        self.calls = VendorCalls(clock=clock)
        self.settings = plan.settings
        """Settings in force; a reopened device is configured with them."""
        self.info: DeviceInfo | None = None
        self.times = ExposureTimes()
        """Exposure times of this opening."""
        self.device: CameraDevice | None = None
        """None while it is not open."""
        self._backoff = BackOff(
            first_ns=self._timeouts.backoff_first_ns, most_ns=self._timeouts.backoff_most_ns
        )
        self._attempt_ns = 0
        self._read_back_ns = NEVER_NS
        self.host_averages = False
        """Whether the host averages 2x2 pixels of each frame, which the device cannot."""
        self.asked_ns = 0
        """Time at which the device was last asked for a register, ns."""

    def require_open(self, action: str) -> CameraDevice:
        """Return the device; raise `NotConnected` while it is not open."""
        if self.device is None:
            reason = self._shared.state.link.reason
            raise NotConnected(f"asked to {action}, but it is not connected: {reason}")
        return self.device

    def attempt_due(self, now_ns: int) -> bool:
        """Return whether the device is not open and the pause since the last attempt is over."""
        return self.device is None and now_ns >= self._attempt_ns

    def open(self) -> None:
        """Open the device with its last settings; close it and raise when any step fails."""
        self._shared.go(CameraPhase.OPENING, now_ns=self._clock.now_ns())
        device = self.device = self._factory()
        try:
            self.info = self.call("open", device.open, within_ns=self._timeouts.open_ns)
            refuse_outside(self.settings, self._read_ranges(device), first=True)
            self.configure(self.settings)
            self.times = ExposureTimes(readout_ns=self._plan.readout_ns)
            self.read_clock(device, self._clock.now_ns())
        except FoveaError as error:
            self.lose(str(error))
            raise
        self._shared.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def configure(self, settings: CameraSettings) -> None:
        """Apply settings to the stopped device; remember those in force."""
        device, before = self.require_open("configure"), self.settings.binning
        taken = self.call("configure", lambda: device.configure(settings))
        if taken.binning > settings.binning:
            raise DeviceFault(
                f"asked for binning {settings.binning}, and it stays at {taken.binning}; power it off and on"
            )
        if settings.binning != before:
            self._read_ranges(device)
        self.host_averages = taken.binning < settings.binning
        self.settings = replace(taken, binning=settings.binning)
        self._plan_read_back(device)

    def lose(self, reason: str) -> None:
        """Close the device after a failure and schedule the next attempt to open it."""
        self._shared.go(CameraPhase.LOST, now_ns=self._clock.now_ns(), reason=reason)
        logger.info("camera %s: %s", self._role, reason)
        self.release()
        now_ns = self._clock.now_ns()
        self._attempt_ns = now_ns + self._backoff.pause_ns()
        self._shared.go(CameraPhase.BACKOFF, now_ns=now_ns)

    def release(self) -> None:
        """Close the device; do nothing when it is not open."""
        device, self.device = self.device, None
        if device is not None:
            try:
                self.call("close", device.close)
            except FoveaError as error:
                logger.debug("camera %s: closing: %s", self._role, error)

    def close_abandoned(self) -> None:
        """Close the device at the end of an abandoned thread; errors are only logged."""
        device, self.device = self.device, None
        if device is not None:
            try:
                device.close()
            except FoveaError as error:
                logger.debug("camera %s: closing after all: %s", self._role, error)

    def note_delivery(self) -> None:
        """Restart the back-off: a good frame arrived."""
        self._backoff.reset()

    def check_alive(self) -> None:
        """Read a register; raise `NotConnected` when the camera does not answer."""
        self.asked_ns = self._clock.now_ns()
        device = self.require_open("answer")
        if not self.call("read a register", device.alive, within_ns=self._timeouts.alive_ns):
            raise NotConnected("it does not answer any more; check its cable and power")

    def read_back_due(self, now_ns: int) -> bool:
        """Return whether the settings of a camera with an automatic mode should be read back."""
        return now_ns >= self._read_back_ns

    def read_back(self) -> CameraSettings:
        """Read the settings in force from the camera and return them."""
        device = self.require_open("read its settings")
        if isinstance(device, ReadableSettings):
            read = self.call("read its settings", device.read_settings, within_ns=self._timeouts.alive_ns)
            self.settings = replace(read, binning=self.settings.binning)
        self._plan_read_back(device)
        return self.settings

    def _read_ranges(self, device: CameraDevice) -> CameraRanges:
        """Read the accepted values of every setting; the host bins where the device does not."""
        ranges = self.call("read its ranges", device.ranges)
        self._shared.ranges = replace(ranges, binnings=BINNINGS)
        return self._shared.ranges

    def _plan_read_back(self, device: CameraDevice) -> None:
        readable = self.settings.automatic and isinstance(device, ReadableSettings)
        self._read_back_ns = self._clock.now_ns() + READ_BACK_NS if readable else NEVER_NS

    def read_clock(self, device: CameraDevice, now_ns: int) -> None:
        """Read the camera's clock when a reading is due and the device supports it."""
        if self.times.reading_due(now_ns) and isinstance(device, ReadsItsClock):
            reading = self.call("read its clock", device.read_clock, within_ns=self._timeouts.alive_ns)
            self.times.add_reading(reading)

    def call(self, name: str, call: Callable[[], T], *, within_ns: int | None = None) -> T:
        """Call the vendor's library; raise `Timeout` when it took longer than allowed."""
        return self.calls.make(name, call, within_ns=within_ns or self._timeouts.call_ns)
