"""The mirrors of a recording: they are where they were recorded, and nobody can move them.

Parking, switching and pinging succeed, for there is nothing that could be in the way of a stop; steering
and exposing are refused, as nothing would come of them.
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
"""Nobody writes it down; it is that of the published rig."""


class ReplayMirrors:
    """Implements the contract's Mirrors over the volts of a recording; `eyes`: left, right, if recorded."""

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
        """That it is a recording."""
        return DeviceInfo(vendor="recording", model="recorded mirrors", serial=self._name)

    @property
    def limits(self) -> MirrorLimits:
        """Those of the published rig."""
        return MirrorLimits()

    @property
    def state(self) -> MirrorState:
        """The recorded volts of this moment."""
        return MirrorState(
            connected=self._connected, enabled=self._connected and self._enabled, volts=self._volts()
        )

    @property
    def telemetry(self) -> LinkTelemetry:
        """Nothing goes to and fro."""
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
        """As on the published rig."""
        return UNKNOWN_LOW_PASS_HZ

    def connect(self) -> None:
        """Be there."""
        self._connected = True

    def close(self) -> None:
        """Be gone; harmless when gone."""
        self._connected = self._enabled = False

    def enable(self) -> None:
        """Count as switched on."""
        self._enabled = True

    def disable(self) -> None:
        """Count as switched off."""
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

    def steer(self, volts: StereoVolts) -> StereoVolts:
        """Refuse."""
        self._refuse("steer")

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Refuse."""
        self._refuse("steer and expose")

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Refuse."""
        self._refuse("steer and expose")

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Refuse, unless nothing would change."""
        if cutoff_hz != self.low_pass_hz:
            self._refuse(f"run at {cutoff_hz} Hz")

    def _volts(self) -> StereoVolts:
        now_ns = self._clock.now_ns()
        left = None if self._left is None else self._left.volts_at(now_ns)
        right = None if self._right is None else self._right.volts_at(now_ns)
        return StereoVolts(left=left or PARKED.left, right=right or PARKED.right)

    def _refuse(self, what: str) -> NoReturn:
        raise OutOfRange(
            f"mirrors: asked to {what}, but they are those of the recording {self._name} and go where they"
            " were recorded; open a rig to move them",
            asked=what,
            found="a recording",
            remedy="open a rig",
        )
