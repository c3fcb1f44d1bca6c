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
    port: str = ""
    """Where it is attached, for people; empty where nobody says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One exposure.

    `t_ns` is the middle of the exposure on the host's clock, of triggered and of free-running cameras alike:
    it began `exposure_ns` / 2 before. `volts` is the mean mirror drive in force during it (None for the wide
    camera).
    """

    image: Image
    role: Role
    seq: int
    t_ns: int
    exposure_ns: int
    bits: int = 8
    volts: MirrorVolts | None = None
    frame_id: int | None = None
    """The controller's number of the exposure that `volts` are of; None where no controller counted it."""
    epoch: int = 0
    """Which opening of the camera it comes from; `seq` goes on over a reopening."""

    def with_volts(self, volts: MirrorVolts, *, frame_id: int | None = None) -> "Frame":
        """Return the same frame carrying the mirror drive of its exposure, and the exposure's number."""
        return replace(self, volts=volts, frame_id=frame_id)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """One triggered look: both foveae exposed by one pulse, and the wide frame nearest in time."""

    left: Frame
    right: Frame
    wide: Frame
    volts: StereoVolts
    """Mean drive of both mirrors during the exposure, as the controller reported it."""
    wide_before: tuple[Frame, ...] = ()
    """Wide frames that waited unread before `wide`, oldest first: a recording wants them all."""
    missing: Role | None = None
    """The fovea whose camera is not there: its frame is black."""
    exposure_after_trigger_ns: int = 0
    """From the trigger to the start of the exposure, both by the controller's clock."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureReceipt:
    """What the mirror controller reports of one triggered exposure; times on the host's clock.

    `t_trigger_ns` is the rise of the trigger lines. `t_exposure_start_ns` is the first rise of a strobe: the
    start of the exposure, of which the controller knows neither middle nor end.
    """

    frame_id: int
    t_trigger_ns: int
    t_exposure_start_ns: int
    volts: StereoVolts

    def middle_ns(self, *, exposure_ns: int) -> int:
        """Return the middle of an exposure so long, which is what `Frame.t_ns` tells."""
        return self.t_exposure_start_ns + exposure_ns // 2

    def end_ns(self, *, exposure_ns: int) -> int:
        """Return the end of an exposure so long."""
        return self.t_exposure_start_ns + exposure_ns


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
    guarded: bool = False
    """Whether a guardian, or the controller itself, parks the mirrors when this program is killed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamTelemetry:
    """One of the controller's streams of positions."""

    stream: int
    updates_per_s: float
    volts: StereoVolts
    """Last sent to it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkTelemetry:
    """Traffic and timing of the controller's link since the connect; rates are of the last second."""

    tx_packets: int
    rx_packets: int
    tx_bytes: int
    rx_bytes: int
    bad_packets: int
    rtt_p50_ms: float
    rtt_p99_ms: float
    clock_offset_ns: int
    crc: bool = False
    """Whether packets carry a CRC beside their checksum: agreed on at the connect."""
    crc_errors: int = 0
    """Of the bad packets, those that only the CRC has found out."""
    rtt_p95_ms: float = 0.0
    rtt_max_ms: float = 0.0
    tx_bytes_per_s: float = 0.0
    rx_bytes_per_s: float = 0.0
    tx_packets_per_s: float = 0.0
    rx_packets_per_s: float = 0.0
    queued_bytes: int = 0
    """Taken by the system, not yet by the controller."""
    lost_answers: int = 0
    """Requests whose answer was lost while the link held: mirrors parked, the caller told."""
    update_limit_hz: float = 0.0
    """How many position updates a second the link is given now."""
    clock_drift_ppm: float | None = None
    """How much faster the controller's clock runs than the host's; None until it can be told."""
    streams: tuple[StreamTelemetry, ...] = ()


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
    awaits_zero: bool = False
    """Whether the operator has to say when it stands at its zero: without switches, it has lost its place."""
    wanted: PanTiltPose | None = None
    """Where whoever turns it by hand is to turn it; None when nothing is wanted, or when it has motors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerPrint:
    """The three markers that a rig is calibrated with, as printed: in one plane on a horizontal line.

    `side_m`: of the black square. `spacing_m`: from the wide camera's marker to each eye's. The ids are of
    the dictionary 4X4_50.
    """

    side_m: float = 0.060
    spacing_m: float = 0.100
    wide_id: int = 0
    left_id: int = 1
    right_id: int = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class RailLimits:
    """How far a rail reaches, metres from its middle; asking for more is refused."""

    min_m: float
    max_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RailState:
    """What is known of the rail. `position_m` is None when nobody can say (moved by hand, not homed)."""

    connected: bool
    moving: bool = False
    homed: bool = False
    position_m: float | None = None
    """Where the rig stands, metres from the rail's middle: > 0 to the rig's right."""
    fault: str | None = None
    """Why it is not usable, in words for the operator; None when it is."""
    awaits_zero: bool = False
    """Whether the operator has to say when it stands at its zero: without a switch, it has lost its place."""
    wanted_m: float | None = None
    """Where whoever moves it by hand is to push it; None when nothing is wanted, or when it has a motor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RailPlace:
    """A place on the rail that the operator knows by name."""

    name: str
    position_m: float


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
