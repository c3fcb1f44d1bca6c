"""The vendor device owned by a camera's thread: opens and configures it, closes and reopens it on failure.

Every call into the vendor's library goes through `call`, with a deadline. Frames and commands are left to
`worker`.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from foveacam_hardware.contract import (
    CameraPhase,
    CameraSettings,
    Clock,
    DeviceInfo,
    FoveaError,
    NotConnected,
    Role,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice, ReadsItsClock, TellsItsSettings
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
        self.asked_ns = 0
        """When the device was last asked for a sign of life."""

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
            ranges = self._shared.ranges = self.call("tell its ranges", device.ranges)
            refuse_outside(self.settings, ranges, first=True)
            self.configure(self.settings)
            self.times = ExposureTimes(readout_ns=self._plan.readout_ns)
            self.read_clock(device, self._clock.now_ns())
        except FoveaError as error:
            self.lose(str(error))
            raise
        self._shared.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def configure(self, settings: CameraSettings) -> None:
        """Apply settings to the stopped device; remember those in force."""
        device = self.require_open("configure")
        self.settings = self.call("configure", lambda: device.configure(settings))
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
        device = self.require_open("tell its settings")
        if isinstance(device, TellsItsSettings):
            self.settings = self.call(
                "tell its settings", device.read_settings, within_ns=self._timeouts.alive_ns
            )
        self._plan_read_back(device)
        return self.settings

    def _plan_read_back(self, device: CameraDevice) -> None:
        readable = self.settings.automatic and isinstance(device, TellsItsSettings)
        self._read_back_ns = self._clock.now_ns() + READ_BACK_NS if readable else NEVER_NS

    def read_clock(self, device: CameraDevice, now_ns: int) -> None:
        """Read the camera's clock when a reading is due and the device supports it."""
        if self.times.reading_due(now_ns) and isinstance(device, ReadsItsClock):
            reading = self.call("read its clock", device.read_clock, within_ns=self._timeouts.alive_ns)
            self.times.add_reading(reading)

    def call(self, name: str, call: Callable[[], T], *, within_ns: int | None = None) -> T:
        """Call the vendor's library; raise `Timeout` when it took longer than allowed."""
        return self.calls.make(name, call, within_ns=within_ns or self._timeouts.call_ns)
