"""Stands where a rig's configuration names no camera, so that a rig with fewer cameras still opens."""

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
    """A camera that is not there; all it can do is say why."""

    def __init__(self, role: Role, *, reason: str, remedy: str) -> None:
        self._role = role
        self._reason = reason
        self._remedy = remedy

    @property
    def role(self) -> Role:
        """Which eye is missing."""
        return self._role

    @property
    def info(self) -> DeviceInfo:
        """Nobody."""
        return DeviceInfo(vendor="none", model="no camera", serial="")

    @property
    def settings(self) -> CameraSettings:
        """What it would run with."""
        return CameraSettings(exposure_ns=8_000_000, triggered=self._role is not Role.WIDE)

    @property
    def counters(self) -> CameraCounters:
        """Nothing was delivered."""
        return CameraCounters()

    @property
    def waiting(self) -> int:
        """None."""
        return 0

    @property
    def ranges(self) -> CameraRanges:
        """Nothing can be set."""
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
        """Why there is no camera."""
        return CameraLink(phase=CameraPhase.CLOSED, reason=self._reason)

    def connect(self) -> None:
        """Say why there is no camera."""
        self._refuse()

    def close(self) -> None:
        """Do nothing."""

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Say why there is no camera."""
        self._refuse()

    def start(self) -> None:
        """Say why there is no camera."""
        self._refuse()

    def stop(self) -> None:
        """Do nothing."""

    def software_trigger(self) -> None:
        """Say why there is no camera."""
        self._refuse()

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Say why there is no camera."""
        self._refuse()

    def latest(self, *, max_age_ms: float) -> Frame:
        """Say why there is no camera."""
        self._refuse()

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Say why there is no camera."""
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise NotConnected(
            f"camera {self._role}: {self._reason}; {self._remedy}", found=self._reason, remedy=self._remedy
        )
