"""Protocols of cameras, mirrors and heads, implemented by drivers and simulation and used by procedures."""

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

from foveacam_hardware.contract.camera_values import (
    CameraCounters,
    CameraLink,
    CameraRanges,
    CameraSettings,
)
from foveacam_hardware.contract.values import (
    DeviceInfo,
    ExposureReceipt,
    Frame,
    LinkTelemetry,
    LookOptions,
    MirrorLimits,
    MirrorState,
    Role,
    Sighting,
    StereoVolts,
)


class Camera(Protocol):
    """A camera; the primitive is a sequence of frames, a single image is n = 1.

    `connect` ends connected and verified, or undoes everything and raises `NotConnected`.
    """

    @property
    def role(self) -> Role:
        """Role of the camera in the rig."""
        ...

    @property
    def info(self) -> DeviceInfo:
        """Vendor, model, serial number, version and port of the camera."""
        ...

    @property
    def settings(self) -> CameraSettings:
        """Settings in force; values that the camera sets itself are at most a second old."""
        ...

    @property
    def counters(self) -> CameraCounters:
        """Frames delivered, skipped, dropped, incomplete and late since `start`."""
        ...

    @property
    def ranges(self) -> CameraRanges:
        """Accepted values of every setting."""
        ...

    @property
    def link(self) -> CameraLink:
        """State of the link, and the reason when frames are not delivered."""
        ...

    @property
    def waiting(self) -> int:
        """Number of frames not yet read; 0 where frames are produced only on request."""
        ...

    def connect(self) -> None:
        """Open and verify the device."""
        ...

    def close(self) -> None:
        """Release the device; do nothing when closed."""
        ...

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings, also while started; return those in force.

        All or nothing: after an error the previous settings stay in force. Raise `OutOfRange` for a value
        outside `ranges`, `InvalidInput` for an unsupported binning.
        """
        ...

    def start(self) -> None:
        """Start delivering frames, free-running or one per trigger."""
        ...

    def stop(self) -> None:
        """Stop delivering frames."""
        ...

    def software_trigger(self) -> None:
        """Expose once; raise `InvalidInput` unless the camera is configured for software triggers."""
        ...

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Return the oldest frame not yet read; raise `Timeout` or `DeviceFault`."""
        ...

    def latest(self, *, max_age_ms: float) -> Frame:
        """Return the newest frame, waiting for one when the newest is older than `max_age_ms`."""
        ...

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Yield the next `n` frames in order."""
        ...


class PendingExposure(Protocol):
    """A triggered exposure that has been requested."""

    def wait(self) -> ExposureReceipt:
        """Wait for its end; call once. Raise `Timeout`, `DeviceFault` or `NotConnected` when it failed."""
        ...


class Mirrors(Protocol):
    """The pair of steering mirrors and the trigger lines, behind one controller."""

    @property
    def info(self) -> DeviceInfo:
        """Vendor, model, serial number, version and port of the controller."""
        ...

    @property
    def limits(self) -> MirrorLimits:
        """Limits beyond which the driver refuses a command."""
        ...

    @property
    def state(self) -> MirrorState:
        """Whether it is connected and enabled, the volts last commanded, and the fault if any."""
        ...

    @property
    def telemetry(self) -> LinkTelemetry:
        """Traffic, round-trip times and clock offset of the link."""
        ...

    def connect(self) -> None:
        """Open the link, check the version, set filter and bias, synchronise the clock."""
        ...

    def close(self) -> None:
        """Park, disable and release; do nothing when closed."""
        ...

    def enable(self) -> None:
        """Set the bias, then switch the mirror supply rail on."""
        ...

    def disable(self) -> None:
        """Park and switch the mirror supply rail off."""
        ...

    def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
        """Move without waiting for a reply; return the volts actually set. May be called at 1 kHz.

        `unless_parked_since`: a value of `MirrorState.parks`; raise `Stopped`, and move nothing, when any
        thread has parked the mirrors since.
        """
        ...

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Move, settle, trigger both foveae, and return once the exposure is over.

        `without`: the fovea that has no camera; only the other one is triggered.
        """
        ...

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Request an exposure, as `expose` does, without waiting: the exposure is over when `wait` returns.

        Two may be under way at most, the second exposed after the first; raise `Busy` for a third. One whose
        `wait` is never called counts until its answer is overdue.
        """
        ...

    def park(self) -> None:
        """Set both mirrors to zero differential volts now; callable from any thread at any time."""
        ...

    def park_confirmed(self, *, within_s: float) -> None:
        """Park and wait for the controller's acknowledgement; raise `Timeout` without it."""
        ...

    def ping(self) -> float:
        """Return the round-trip time of one request, ms; raise `Timeout` or `NotConnected`."""
        ...

    def recover(self) -> None:
        """Restart the mirrors' DACs without switching the rail; raise `DeviceFault` if not supported."""
        ...

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Set the cut-off of the drive filters, Hz (1 to 1000), until closed or set again."""
        ...

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the drive filters, Hz."""
        ...


class Head(Protocol):
    """Steers both foveae and captures observations; all that a procedure needs of a rig.

    Implemented by the rig itself (scripts, benches) and by the server (through its hardware thread).
    """

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Steer, settle and expose both foveae; return their frames with a wide frame not older than them."""
        ...

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame without moving anything."""
        ...

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set exposure and gain of both foveae for the following looks."""
        ...

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the mirrors' drive filters, Hz; return the previous one."""
        ...


class PendingLook(Protocol):
    """A look that has been requested."""

    def result(self) -> Sighting:
        """Wait for its frames; raise as `Head.look` does."""
        ...


@runtime_checkable
class AheadHead(Head, Protocol):
    """A head that can begin the next look while its caller still evaluates the previous one."""

    def begin_look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> PendingLook:
        """Request a look as `look` makes it, without waiting; requests are carried out in their order."""
        ...


@runtime_checkable
class TriggerHead(Head, Protocol):
    """A head that separates exposure and readout, so that the mirrors move while the cameras are read.

    `settle_us`: default wait after a move.
    """

    settle_us: int

    def begin(self, volts: StereoVolts, *, settle_us: int) -> PendingExposure:
        """Begin to steer, settle and expose both foveae; the previous exposure must be over."""
        ...

    def frames_of(self, receipt: ExposureReceipt) -> tuple[Frame, Frame]:
        """Return the left and right frames of an exposure; raise `DeviceFault` when one is missing."""
        ...

    def frame_of(self, role: Role, receipt: ExposureReceipt) -> Frame:
        """Return one fovea's frame of an exposure, even if the other's is missing; raises as `frames_of`."""
        ...

    def wide_since(self, t_ns: int) -> Frame:
        """Return the newest wide frame whose `Frame.t_ns` is `t_ns` or later, waiting for it if necessary."""
        ...
