"""Value types that cross the hardware's border: volts, frames, settings, receipts. No angles here."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Image: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]
"""(h, w) grey or (h, w, 3) RGB, uint8, or uint16 holding `Frame.bits` significant bits."""


class Role(StrEnum):
    """Which eye of the rig a camera is."""

    WIDE = "wide"
    LEFT = "left"
    RIGHT = "right"


class PixelFormat(StrEnum):
    """What a camera delivers (GenICam names)."""

    MONO8 = "Mono8"
    MONO12 = "Mono12"
    RGB8 = "RGB8"


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorVolts:
    """Differential drive of one mirror, volts."""

    x_v: float
    y_v: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoVolts:
    """Differential drive of both mirrors, volts."""

    left: MirrorVolts
    right: MirrorVolts


PARKED = StereoVolts(left=MirrorVolts(x_v=0.0, y_v=0.0), right=MirrorVolts(x_v=0.0, y_v=0.0))
"""Both mirrors at rest: no differential voltage."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceInfo:
    """Who a device is; `serial` identifies it across reconnects."""

    vendor: str
    model: str
    serial: str
    version: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSettings:
    """What a camera is asked for, and, as returned by `configure`, what it took."""

    exposure_ns: int
    gain_db: float = 0.0
    frame_rate_hz: float = 30.0
    pixel_format: PixelFormat = PixelFormat.MONO8
    triggered: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCounters:
    """Honest statistics of one camera since it was started."""

    delivered: int = 0
    dropped: int = 0
    incomplete: int = 0
    late: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One exposure.

    `t_ns` is the middle of the exposure on the host's clock; `volts` the mean mirror drive
    in force during it (None for the wide camera).
    """

    image: Image
    role: Role
    seq: int
    t_ns: int
    exposure_ns: int
    bits: int = 8
    volts: MirrorVolts | None = None

    def with_volts(self, volts: MirrorVolts) -> "Frame":
        """Return the same frame carrying the mirror drive of its exposure."""
        return replace(self, volts=volts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """One triggered look: both foveae exposed by one pulse, and the wide frame nearest in time."""

    left: Frame
    right: Frame
    wide: Frame
    volts: StereoVolts
    """Mean drive of both mirrors during the exposure, as the controller reported it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureReceipt:
    """What the mirror controller reports of one triggered exposure; times on the host's clock."""

    frame_id: int
    t_trigger_ns: int
    t_exposure_ns: int
    volts: StereoVolts


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorLimits:
    """Limits that the driver enforces above the wire: refused, never clipped."""

    max_v: float = 170.0
    bias_v: float = 90.0
    max_slew_v: float = 400.0
    """Largest change of one axis in one update, volts (400 = the full stroke, no slew limit)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorState:
    """What the mirror driver knows of its controller."""

    connected: bool
    enabled: bool
    volts: StereoVolts
    fault: str | None = None
    """Why the controller is not usable, in words for the operator; None when it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkTelemetry:
    """Traffic and timing of the controller's link."""

    tx_packets: int
    rx_packets: int
    tx_bytes: int
    rx_bytes: int
    bad_packets: int
    rtt_p50_ms: float
    rtt_p99_ms: float
    clock_offset_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltPose:
    """Where the rig's base points, rad: `pan_rad` > 0 turns the rig to the right, `tilt_rad` > 0 down.

    A bearing, not a gaze: the one place where the hardware knows angles, because the device does.
    """

    pan_rad: float
    tilt_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltLimits:
    """How far a pan-tilt turns; asking for more is refused."""

    pan_min_rad: float
    pan_max_rad: float
    tilt_min_rad: float
    tilt_max_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltState:
    """What is known of the pan-tilt. `pose` is None when nobody can say (moved by hand, not homed)."""

    connected: bool
    moving: bool = False
    homed: bool = False
    pose: PanTiltPose | None = None
    fault: str | None = None
    """Why it is not usable, in words for the operator; None when it is."""


class StationTarget(StrEnum):
    """What stands where the rig looks at a station."""

    BOARD = "board"
    """A calibration board that somebody holds and turns."""
    MARKERS = "markers"
    """Three markers, one for each camera, spaced by the baseline."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """A place to look at while calibrating: where the base must point, and what stands there.

    `distance_m`: from the wide camera to the middle of the target, by tape; None when nobody measured.
    """

    name: str
    target: StationTarget
    pose: PanTiltPose
    distance_m: float | None = None
