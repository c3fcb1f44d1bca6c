"""Protocols of the devices. Drivers and the simulation implement them; procedures know nothing else."""

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
    MirrorLimits,
    MirrorState,
    Role,
    Sighting,
    StereoVolts,
)


class Camera(Protocol):
    """A camera; the sequence is the primitive, a snap is n = 1.

    `connect` ends connected and verified, or undoes everything and raises `NotConnected`.
    """

    @property
    def role(self) -> Role:
        """Which eye it is."""
        ...

    @property
    def info(self) -> DeviceInfo:
        """Who it is."""
        ...

    @property
    def settings(self) -> CameraSettings:
        """What it runs with; of what it sets itself, what it said within the last second."""
        ...

    @property
    def counters(self) -> CameraCounters:
        """Frames delivered, skipped, dropped, incomplete and late since `start`."""
        ...

    @property
    def ranges(self) -> CameraRanges:
        """What it accepts."""
        ...

    @property
    def link(self) -> CameraLink:
        """Whether it delivers, and if not, why."""
        ...

    @property
    def waiting(self) -> int:
        """How many frames wait to be read; 0 where a frame is made only when asked for."""
        ...

    def connect(self) -> None:
        """Open the device and verify it."""
        ...

    def close(self) -> None:
        """Release the device; harmless when closed."""
        ...

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings; return what the camera took."""
        ...

    def start(self) -> None:
        """Begin to deliver frames (free-running, or one a trigger)."""
        ...

    def stop(self) -> None:
        """Stop delivering."""
        ...

    def software_trigger(self) -> None:
        """Expose once; raise `InvalidInput` unless it is triggered by software."""
        ...

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        """Return the next frame not yet read; raise `Timeout` or `DeviceFault`."""
        ...

    def latest(self, *, max_age_ms: float) -> Frame:
        """Return the newest frame, waiting for one when the newest is older than `max_age_ms`."""
        ...

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        """Yield the next `n` frames in order."""
        ...


class PendingExposure(Protocol):
    """A triggered exposure that was asked for."""

    def wait(self) -> ExposureReceipt:
        """Return once it is over; once. Raise `Timeout`, `DeviceFault` or `NotConnected` when it failed."""
        ...


class Mirrors(Protocol):
    """The pair of steering mirrors and the trigger lines, behind one controller."""

    @property
    def info(self) -> DeviceInfo:
        """Who the controller is."""
        ...

    @property
    def limits(self) -> MirrorLimits:
        """What the driver refuses to exceed."""
        ...

    @property
    def state(self) -> MirrorState:
        """Connected, enabled, volts last commanded, fault."""
        ...

    @property
    def telemetry(self) -> LinkTelemetry:
        """Traffic, round trips, clock offset."""
        ...

    def connect(self) -> None:
        """Open the link, check the version, set filter and bias, map the clock."""
        ...

    def close(self) -> None:
        """Park, disable and release; harmless when closed."""
        ...

    def enable(self) -> None:
        """Switch the mirror rail on, bias first."""
        ...

    def disable(self) -> None:
        """Park and switch the rail off."""
        ...

    def steer(self, volts: StereoVolts) -> StereoVolts:
        """Move without waiting for a reply; return the volts really set. Safe at 1 kHz."""
        ...

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Move, settle, trigger both foveae, and return once the exposure is over.

        `without`: the fovea that has no camera; the other one's is triggered alone.
        """
        ...

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Do the same without waiting: the exposure is over when its `wait` returns. One at a time."""
        ...

    def park(self) -> None:
        """Bring both mirrors to zero differential now; callable from any thread at any time."""
        ...

    def park_confirmed(self, *, within_s: float) -> None:
        """Do the same and return once the controller has acknowledged it, or raise `Timeout`."""
        ...

    def ping(self) -> float:
        """Return one round trip, ms; raise `Timeout` or `NotConnected`."""
        ...

    def recover(self) -> None:
        """Start the mirrors' DACs anew, rail unswitched; raise `DeviceFault` where that is unknown."""
        ...

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Run the drive filters at another cut-off, Hz (1 to 1000), until closed or set again."""
        ...

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the drive filters."""
        ...


class Head(Protocol):
    """What a procedure needs of a rig: look somewhere and see.

    Implemented by the rig itself (scripts, benches) and by the server (through its hardware thread).
    """

    def look(self, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """Steer, settle, expose both foveae, and return them with a wide frame not older than them.

        `settle_us`: how long to wait between the move and the exposure; None is the rig's own time.
        """
        ...

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame without moving anything."""
        ...

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set both foveae's exposure and gain, for the looks that follow."""
        ...

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Run the mirrors' drive filters at another cut-off, Hz; return the one before."""
        ...


@runtime_checkable
class OneEyedHead(Head, Protocol):
    """A head that can look while the camera of one fovea is missing."""

    def look_without(self, missing: Role, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """As `look`, with a black frame in place of what the missing camera would have seen."""
        ...


@runtime_checkable
class TriggerHead(Head, Protocol):
    """A head that looks in two steps, so that the mirrors move on while the cameras are read.

    `settle_us`: how long it waits after a move, unless it is told otherwise.
    """

    settle_us: int

    def begin(self, volts: StereoVolts, *, settle_us: int) -> PendingExposure:
        """Begin to steer, settle and expose both foveae; the one begun before must be over."""
        ...

    def frames_of(self, receipt: ExposureReceipt) -> tuple[Frame, Frame]:
        """Return left and right of an exposure; raise `DeviceFault` for one that is missing."""
        ...

    def frame_of(self, role: Role, receipt: ExposureReceipt) -> Frame:
        """Return what one fovea saw in an exposure, whatever became of the other's frame; as `frames_of`."""
        ...

    def wide_since(self, t_ns: int) -> Frame:
        """Return the newest wide frame whose `Frame.t_ns` is `t_ns` or later; wait for it if need be."""
        ...
