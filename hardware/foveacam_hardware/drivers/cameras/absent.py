"""Placeholder for a role without a camera, so that a rig with fewer cameras still opens."""

from collections.abc import Iterator
from typing import NoReturn

from foveacam_hardware.contract import (
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    DeviceInfo,
    Frame,
    NotConnected,
    Role,
    ValueRange,
)


class AbsentCamera:
    """Implements the contract's Camera; calls that need a device raise `NotConnected` with the reason."""

    def __init__(self, role: Role, *, reason: str, remedy: str) -> None:
        self._role = role
        self._reason = reason
        self._remedy = remedy

    @property
    def role(self) -> Role:
        """Role without a camera."""
        return self._role

    @property
    def info(self) -> DeviceInfo:
        """A placeholder identity."""
        return DeviceInfo(vendor="none", model="no camera", serial="")

    @property
    def settings(self) -> CameraSettings:
        """Default settings of the role."""
        return CameraSettings(exposure_ns=8_000_000, triggered=self._role is not Role.WIDE)

    @property
    def counters(self) -> CameraCounters:
        """All counters zero."""
        return CameraCounters()

    @property
    def waiting(self) -> int:
        """Always 0."""
        return 0

    @property
    def ranges(self) -> CameraRanges:
        """Ranges in which nothing can be set."""
        nothing = ValueRange(low=0.0, high=0.0)
        return CameraRanges(
            exposure_ns=nothing,
            gain_db=nothing,
            frame_rate_hz=nothing,
            black_level=nothing,
            pixel_formats=(),
        )

    @property
    def link(self) -> CameraLink:
        """Closed, with the reason why there is no camera."""
        return CameraLink(phase=CameraPhase.CLOSED, reason=self._reason)

    def connect(self) -> None:
        """Raise `NotConnected`."""
        self._refuse()

    def close(self) -> None:
        """Do nothing."""

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Raise `NotConnected`."""
        self._refuse()

    def start(self) -> None:
        """Raise `NotConnected`."""
        self._refuse()

    def stop(self) -> None:
        """Do nothing."""

    def software_trigger(self) -> None:
        """Raise `NotConnected`."""
        self._refuse()

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Raise `NotConnected`."""
        self._refuse()

    def latest(self, *, max_age_ms: float) -> Frame:
        """Raise `NotConnected`."""
        self._refuse()

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Raise `NotConnected`."""
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise NotConnected(f"camera {self._role}: {self._reason}", found=self._reason, remedy=self._remedy)
