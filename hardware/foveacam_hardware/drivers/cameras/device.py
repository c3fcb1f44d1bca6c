"""The interface that a driver implements for each vendor library: `CameraDevice` and its value types.

Threading, deadlines, frame checks, counters and recovery are implemented once, in `SupervisedCamera`.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

from foveacam_hardware.contract import CameraRanges, CameraSettings, DeviceInfo, Image


class GrabStatus(StrEnum):
    """Outcome of one buffer."""

    OK = "ok"
    INCOMPLETE = "incomplete"
    """Packets are missing, or the library reports it as corrupt; `image` may be None."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grab:
    """One buffer, copied out of the library's memory.

    `image`: (h, w) grey or (h, w, 3) RGB, uint8, or uint16 holding `bits` significant bits; Bayer and packed
    formats are unpacked. `number`: the camera's own frame number, None when it has none. `t_device_ns`: start
    of the exposure on the camera's clock, None when not reported. `t_host_ns`: arrival on the host's clock.
    """

    status: GrabStatus
    image: Image | None
    bits: int
    number: int | None
    t_device_ns: int | None
    t_host_ns: int


class CameraDevice(Protocol):
    """One camera through one library. Every call may block; one thread makes all of them.

    Calls raise only errors of the contract: `NotConnected` (absent, held by another program, lost),
    `OutOfRange` (a setting that is not accepted), `DeviceFault` (the library failed).
    """

    def open(self) -> DeviceInfo:
        """Find the camera by its serial number, open it exclusively and stop it; return its identity."""
        ...

    def close(self) -> None:
        """Release the camera; do nothing when it is closed or gone."""
        ...

    def ranges(self) -> CameraRanges:
        """Return the accepted values of every setting."""
        ...

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return those in force, read back from the camera.

        The binning returned is the device's own: 1 where it cannot average pixels, or not those of the region
        that it reads. The host then averages them.
        """
        ...

    def start(self) -> None:
        """Start acquisition."""
        ...

    def stop(self) -> None:
        """Stop acquisition; buffers not yet grabbed are lost."""
        ...

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none arrived in time."""
        ...

    def software_trigger(self) -> None:
        """Trigger one exposure."""
        ...

    def alive(self) -> bool:
        """Return whether the camera still answers a register read."""
        ...

    def underruns(self) -> int:
        """Return the number of frames since `start` for which no buffer was free."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockReading:
    """The camera's clock, and the host's clock before and after reading it."""

    t_device_ns: int
    t_before_ns: int
    t_after_ns: int


@runtime_checkable
class ReadsItsClock(Protocol):
    """A device whose clock can be read, so that no latency has to be estimated."""

    def read_clock(self) -> ClockReading | None:
        """Return one reading; None when the camera has no readable clock."""
        ...


@runtime_checkable
class ReadableSettings(Protocol):
    """A device with automatic modes, whose current settings can be read while it streams."""

    def read_settings(self) -> CameraSettings:
        """Return the settings in force, read from the camera; a mode that has ended is off."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundCamera:
    """A camera that a search found; it is not opened."""

    kind: str
    """Kind of the driver, as in rig files."""
    info: DeviceInfo
    address: str = ""
    """IP address, USB path or device file."""
    problem: str | None = None
    """Why it cannot be used, as far as known without opening it."""
