"""The seam between a vendor's library and our cameras: the little that each library must be brought to do.

Everything else (its own thread, deadlines, checks of every frame, counters, recovery) is done once, above it.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

from foveacam_hardware.contract import CameraRanges, CameraSettings, DeviceInfo, Image


class GrabStatus(StrEnum):
    """What became of one buffer."""

    OK = "ok"
    INCOMPLETE = "incomplete"
    """Packets are missing, or the library calls it broken; `image` may be None."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grab:
    """One buffer, copied out of the library's memory, which it has back already.

    `image`: (h, w) grey or (h, w, 3) RGB, uint8, or uint16 holding `bits` significant bits: Bayer and packed
    formats are unpacked. `number`: the camera's own frame number, None when it has none. `t_device_ns`: start
    of the exposure on the camera's clock, None when it does not say. `t_host_ns`: arrival, host's clock.
    """

    status: GrabStatus
    image: Image | None
    bits: int
    number: int | None
    t_device_ns: int | None
    t_host_ns: int


class CameraDevice(Protocol):
    """One camera through one library. Every call may block; one thread makes all of them.

    Calls raise errors of the contract alone: `NotConnected` (not there, held by another program, gone),
    `OutOfRange` (a setting that it does not take), `DeviceFault` (the library failed).
    """

    def open(self) -> DeviceInfo:
        """Find it by its serial number, take it, stop whatever it does; return who it is."""
        ...

    def close(self) -> None:
        """Release it; harmless when closed or gone."""
        ...

    def ranges(self) -> CameraRanges:
        """Return what it accepts."""
        ...

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return what it took, read back from it."""
        ...

    def start(self) -> None:
        """Begin to acquire."""
        ...

    def stop(self) -> None:
        """Stop acquiring; buffers not yet grabbed are gone."""
        ...

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none came in time."""
        ...

    def software_trigger(self) -> None:
        """Expose once."""
        ...

    def alive(self) -> bool:
        """Return whether it still answers: a register is read."""
        ...

    def underruns(self) -> int:
        """Return how many frames found no buffer since `start`."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockReading:
    """The camera's clock, read between two moments of the host's."""

    t_device_ns: int
    t_before_ns: int
    t_after_ns: int


@runtime_checkable
class ReadsItsClock(Protocol):
    """A device that can tell what its clock says now: no latency must be guessed then."""

    def read_clock(self) -> ClockReading | None:
        """Return one reading; None when this camera has no such register."""
        ...


@runtime_checkable
class TellsItsSettings(Protocol):
    """A device with automatic modes: it can tell what it runs with now."""

    def read_settings(self) -> CameraSettings:
        """Return what is in force, read from the camera while it streams; a mode that ended is off."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundCamera:
    """A camera that a library sees, not opened."""

    kind: str
    """The driver's kind, as a rig file names it."""
    info: DeviceInfo
    address: str = ""
    """Where it is: an IP address, a USB path, a device file."""
    problem: str | None = None
    """Why it cannot be used, as far as one can tell without opening it."""
