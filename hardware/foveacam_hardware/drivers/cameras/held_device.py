"""The device that a camera's thread holds: opened with all settings, given up when it fails, opened again.

Every call into the vendor's library goes through `call`, with a deadline. Frames and commands are `worker`'s.
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
"""How often a camera with an automatic mode is asked what it runs with."""
NEVER_NS = 1 << 63


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPlan:
    """Settings to begin with, the sensor's readout, and how much is waited for it and kept of it."""

    settings: CameraSettings
    readout_ns: int = 0
    """How long a frame is read out of the sensor; used where the camera's clock cannot be read."""
    frames: int = 8
    """How many wait for their reader."""
    patience: WatchdogTimeouts = field(default_factory=WatchdogTimeouts)


class HeldDevice:
    """One camera's device; all methods belong to one thread."""

    def __init__(
        self,
        role: Role,
        factory: Callable[[], CameraDevice],
        *,
        desk: CameraSharedState,
        plan: CameraPlan,
        clock: Clock,
    ) -> None:
        self._role = role
        self._factory = factory
        self._desk = desk
        self._plan = plan
        self._patience = plan.patience
        self._clock = clock
        self.calls = VendorCalls(clock=clock)
        self.settings = plan.settings
        """What the device took; it is opened with this again."""
        self.info: DeviceInfo | None = None
        self.times = ExposureTimes()
        """Of this opening."""
        self.device: CameraDevice | None = None
        """None while it is not open."""
        self._backoff = BackOff(
            first_ns=self._patience.backoff_first_ns, most_ns=self._patience.backoff_most_ns
        )
        self._attempt_ns = 0
        self._read_back_ns = NEVER_NS
        self.asked_ns = 0
        """When it was last asked whether it is there."""

    def opened(self, action: str) -> CameraDevice:
        """Return the device; raise `NotConnected` while it is not open."""
        if self.device is None:
            reason = self._desk.state.link.reason
            raise NotConnected(f"asked to {action}, but it is not connected: {reason}")
        return self.device

    def attempt_due(self, now_ns: int) -> bool:
        """Tell whether it is not open, and the pause since the last attempt is over."""
        return self.device is None and now_ns >= self._attempt_ns

    def open(self) -> None:
        """Open and configure as it was; give it up when a part of that fails."""
        self._desk.go(CameraPhase.OPENING, now_ns=self._clock.now_ns())
        device = self.device = self._factory()
        try:
            self.info = self.call("open", device.open, within_ns=self._patience.open_ns)
            ranges = self._desk.ranges = self.call("tell its ranges", device.ranges)
            refuse_outside(self.settings, ranges, first=True)
            self.configure(self.settings)
            self.times = ExposureTimes(readout_ns=self._plan.readout_ns)
            self.read_clock(device, self._clock.now_ns())
        except FoveaError as error:
            self.lose(str(error))
            raise
        self._desk.go(CameraPhase.READY, now_ns=self._clock.now_ns())

    def configure(self, settings: CameraSettings) -> None:
        """Apply settings to the device, which is stopped; keep what it took."""
        device = self.opened("configure")
        self.settings = self.call("configure", lambda: device.configure(settings))
        self._plan_read_back(device)

    def lose(self, reason: str) -> None:
        """Give the device up until the next attempt."""
        self._desk.go(CameraPhase.LOST, now_ns=self._clock.now_ns(), reason=reason)
        logger.info("camera %s: %s", self._role, reason)
        self.release()
        now_ns = self._clock.now_ns()
        self._attempt_ns = now_ns + self._backoff.pause_ns()
        self._desk.go(CameraPhase.BACKOFF, now_ns=now_ns)

    def release(self) -> None:
        """Close the device; harmless when it is not open."""
        device, self.device = self.device, None
        if device is not None:
            try:
                self.call("close", device.close)
            except FoveaError as error:
                logger.debug("camera %s: closing: %s", self._role, error)

    def give_back(self) -> None:
        """Close the device at the end of a thread that was given up; nobody hears of it."""
        device, self.device = self.device, None
        if device is not None:
            try:
                device.close()
            except FoveaError as error:
                logger.debug("camera %s: closing after all: %s", self._role, error)

    def delivered(self) -> None:
        """Take note of a good frame: another loss is the first of its row."""
        self._backoff.reset()

    def ask(self) -> None:
        """Read a register; raise `NotConnected` when the camera does not answer."""
        self.asked_ns = self._clock.now_ns()
        device = self.opened("answer")
        if not self.call("read a register", device.alive, within_ns=self._patience.alive_ns):
            raise NotConnected("it does not answer any more; check its cable and power")

    def read_back_due(self, now_ns: int) -> bool:
        """Tell whether a camera that sets itself should be asked what it runs with."""
        return now_ns >= self._read_back_ns

    def read_back(self) -> CameraSettings:
        """Ask the camera what it runs with; return it."""
        device = self.opened("tell its settings")
        if isinstance(device, TellsItsSettings):
            self.settings = self.call(
                "tell its settings", device.read_settings, within_ns=self._patience.alive_ns
            )
        self._plan_read_back(device)
        return self.settings

    def _plan_read_back(self, device: CameraDevice) -> None:
        asks = self.settings.automatic and isinstance(device, TellsItsSettings)
        self._read_back_ns = self._clock.now_ns() + READ_BACK_NS if asks else NEVER_NS

    def read_clock(self, device: CameraDevice, now_ns: int) -> None:
        """Read the camera's clock when that is due, where it can be read."""
        if self.times.reading_due(now_ns) and isinstance(device, ReadsItsClock):
            reading = self.call("read its clock", device.read_clock, within_ns=self._patience.alive_ns)
            self.times.read(reading)

    def call(self, name: str, call: Callable[[], T], *, within_ns: int | None = None) -> T:
        """Call the library; raise `Timeout` when it took longer than allowed."""
        return self.calls.make(name, call, within_ns=within_ns or self._patience.call_ns)
