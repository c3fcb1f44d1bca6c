"""The mirrors of a recording: at their recorded positions, and not movable.

Parking, switching and pinging succeed, so that a stop never fails; steering and exposing raise `OutOfRange`.
"""

from typing import NoReturn

from foveacam_hardware.contract import (
    PARKED,
    Clock,
    DeviceInfo,
    ExposureReceipt,
    LinkTelemetry,
    MirrorLimits,
    MirrorState,
    OutOfRange,
    PendingExposure,
    Role,
    StereoVolts,
)
from foveacam_hardware.drivers.replay.camera import ReplayCamera

UNKNOWN_LOW_PASS_HZ = 120
"""Cut-off of the published rig, as recordings do not store it."""


class ReplayMirrors:
    """Implements the contract's Mirrors with recorded volts; `eyes`: left and right cameras, if recorded."""

    def __init__(
        self, eyes: tuple[ReplayCamera | None, ReplayCamera | None], *, clock: Clock, name: str
    ) -> None:
        self._left, self._right = eyes
        self._clock = clock
        self._name = name
        self._connected = False
        self._enabled = False

    @property
    def info(self) -> DeviceInfo:
        """An identity that names the recording."""
        return DeviceInfo(vendor="recording", model="recorded mirrors", serial=self._name)

    @property
    def limits(self) -> MirrorLimits:
        """Limits of the published rig."""
        return MirrorLimits()

    @property
    def state(self) -> MirrorState:
        """Connection state, and the recorded volts at the current time."""
        return MirrorState(
            connected=self._connected, enabled=self._connected and self._enabled, volts=self._volts()
        )

    @property
    def telemetry(self) -> LinkTelemetry:
        """All zero: there is no link."""
        return LinkTelemetry(
            tx_packets=0,
            rx_packets=0,
            tx_bytes=0,
            rx_bytes=0,
            bad_packets=0,
            rtt_p50_ms=0.0,
            rtt_p99_ms=0.0,
            clock_offset_ns=0,
        )

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the published rig, Hz."""
        return UNKNOWN_LOW_PASS_HZ

    def connect(self) -> None:
        """Mark as connected."""
        self._connected = True

    def close(self) -> None:
        """Mark as closed."""
        self._connected = self._enabled = False

    def enable(self) -> None:
        """Mark as enabled."""
        self._enabled = True

    def disable(self) -> None:
        """Mark as disabled."""
        self._enabled = False

    def park(self) -> None:
        """Do nothing: nothing moves."""

    def park_confirmed(self, *, within_s: float) -> None:
        """Do nothing: nothing moves."""

    def ping(self) -> float:
        """Return 0 ms."""
        return 0.0

    def recover(self) -> None:
        """Do nothing: there are no DACs."""

    def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
        """Raise `OutOfRange`."""
        self._refuse("steer")

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Raise `OutOfRange`."""
        self._refuse("steer and expose")

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Raise `OutOfRange`."""
        self._refuse("steer and expose")

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Raise `OutOfRange` unless nothing would change."""
        if cutoff_hz != self.low_pass_hz:
            self._refuse(f"run at {cutoff_hz} Hz")

    def _volts(self) -> StereoVolts:
        now_ns = self._clock.now_ns()
        left = None if self._left is None else self._left.volts_at(now_ns)
        right = None if self._right is None else self._right.volts_at(now_ns)
        return StereoVolts(left=left or PARKED.left, right=right or PARKED.right)

    def _refuse(self, what: str) -> NoReturn:
        raise OutOfRange(
            f"mirrors: asked to {what}, but they are those of the recording {self._name} and go where they "
            "were recorded",
            asked=what,
            found="a recording",
            remedy="open a rig to move them",
        )
