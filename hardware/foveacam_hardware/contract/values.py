"""Value types exchanged with the hardware: volts, frames, receipts, limits and states. No gaze angles."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.contract.quantities import check_ordered, check_positive

Image: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]
"""(h, w) grey or (h, w, 3) RGB, uint8, or uint16 holding `Frame.bits` significant bits."""


Binning: TypeAlias = Literal[1, 2]
"""Pixels of the sensor along each side of one pixel of a frame. Pixel coordinates (integers at pixel centres)
of a binned frame are those of the sensor by x = binning x_b + (binning - 1) / 2."""


class Role(StrEnum):
    """Role of a camera in the rig: the wide camera, or the left or right fovea."""

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
"""Both mirrors at zero differential volts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceInfo:
    """Identity of a device; `serial` identifies it across reconnects."""

    vendor: str
    model: str
    serial: str
    version: str = ""
    port: str = ""
    """Port for display; empty when not known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One image of a camera with its time, number and mirror drive.

    `t_ns` is the middle of the exposure on the host's clock, for triggered and free-running cameras alike:
    the exposure began `exposure_ns` / 2 earlier. `volts` is the mean mirror drive during the exposure (None
    for the wide camera).
    """

    image: Image
    role: Role
    seq: int
    t_ns: int
    exposure_ns: int
    bits: int = 8
    volts: MirrorVolts | None = None
    frame_id: int | None = None
    """The controller's number of the exposure that `volts` belongs to; None for an untriggered exposure."""
    epoch: int = 0
    """Number of the camera's opening that delivered it; `seq` continues across reopenings."""
    binning: Binning = 1
    """Pixels of the sensor along each side of a pixel of `image`, which is their mean."""

    def with_volts(self, volts: MirrorVolts, *, frame_id: int | None = None) -> "Frame":
        """Return a copy with the mirror drive of its exposure and the exposure's number."""
        return replace(self, volts=volts, frame_id=frame_id)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """The observation of one look: both foveae exposed by one pulse, and the wide frame nearest in time."""

    left: Frame
    right: Frame
    wide: Frame
    volts: StereoVolts
    """Mean drive of both mirrors during the exposure, as the controller reported it."""
    wide_before: tuple[Frame, ...] = ()
    """Unread wide frames before `wide`, oldest first; a recording stores them all."""
    missing: Role | None = None
    """The fovea without a camera; its frame is black."""
    exposure_after_trigger_ns: int = 0
    """Delay from the trigger to the start of the exposure, by the controller's clock."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureReceipt:
    """The mirror controller's report of one triggered exposure; times on the host's clock.

    `t_trigger_ns` is the rising edge of the trigger lines. `t_exposure_start_ns` is the first rising edge of
    a strobe, which is the start of the exposure; the controller knows neither its middle nor its end.
    `clock_uncertainty_ns`: largest error of both, from mapping the controller's clock to the host's.
    """

    frame_id: int
    t_trigger_ns: int
    t_exposure_start_ns: int
    volts: StereoVolts
    clock_uncertainty_ns: int = 0

    def middle_ns(self, *, exposure_ns: int) -> int:
        """Return the middle of an exposure of length `exposure_ns`, comparable with `Frame.t_ns`."""
        return self.t_exposure_start_ns + exposure_ns // 2

    def end_ns(self, *, exposure_ns: int) -> int:
        """Return the end of an exposure of length `exposure_ns`."""
        return self.t_exposure_start_ns + exposure_ns


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorLimits:
    """Limits that the driver enforces; commands beyond them are refused, never clipped."""

    max_v: float = 170.0
    bias_v: float = 90.0
    max_slew_v: float = 400.0
    """Largest change of one axis in one update, volts (400 is the full stroke: no slew limit)."""

    def __post_init__(self) -> None:
        check_positive("mirror limits", max_v=self.max_v, bias_v=self.bias_v, max_slew_v=self.max_slew_v)


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorState:
    """State of the mirror controller as the driver knows it."""

    connected: bool
    enabled: bool
    volts: StereoVolts
    """Volts last commanded; the actual drive is known only while `enabled`."""
    fault: str | None = None
    """Why the controller is not usable, for the operator; None when it is."""
    guarded: bool = False
    """Whether a guardian process, or the controller itself, parks the mirrors when this program is killed."""
    parks: int = 0
    """How often the mirrors were parked by this driver; every switch-on parks them too."""
    exposing: bool = False
    """Whether a requested exposure is not over yet: a mirror that moves now blurs it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamTelemetry:
    """Statistics of one of the controller's position streams."""

    stream: int
    updates_per_s: float
    volts: StereoVolts
    """Volts last sent to the stream."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkTelemetry:
    """Traffic and timing of the controller's link since it connected; rates are over the last second."""

    tx_packets: int
    rx_packets: int
    tx_bytes: int
    rx_bytes: int
    bad_packets: int
    rtt_p50_ms: float
    rtt_p99_ms: float
    clock_offset_ns: int
    crc: bool = False
    """Whether packets carry a CRC besides their checksum, as negotiated when connecting."""
    crc_errors: int = 0
    """Bad packets that only the CRC detected."""
    rtt_p95_ms: float = 0.0
    rtt_max_ms: float = 0.0
    tx_bytes_per_s: float = 0.0
    rx_bytes_per_s: float = 0.0
    tx_packets_per_s: float = 0.0
    rx_packets_per_s: float = 0.0
    queued_bytes: int = 0
    """Bytes in the operating system's output queue."""
    lost_answers: int = 0
    """Answers lost on a working link; each time the mirrors were parked and the caller got an error."""
    update_limit_hz: float = 0.0
    """Current limit of position updates a second."""
    clock_drift_ppm: float | None = None
    """How much faster the controller's clock runs than the host's; None until it is measured."""
    streams: tuple[StreamTelemetry, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltPose:
    """Bearing of the rig's base, rad: `pan_rad` > 0 turns the rig to the right, `tilt_rad` > 0 down.

    Not a gaze: the hardware layer has angles only here, because the device itself works in angles.
    """

    pan_rad: float
    tilt_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltLimits:
    """Reachable bearings of a pan-tilt; bearings outside are refused."""

    pan_min_rad: float
    pan_max_rad: float
    tilt_min_rad: float
    tilt_max_rad: float

    def __post_init__(self) -> None:
        check_ordered("pan-tilt limits", pan_min_rad=self.pan_min_rad, pan_max_rad=self.pan_max_rad)
        check_ordered("pan-tilt limits", tilt_min_rad=self.tilt_min_rad, tilt_max_rad=self.tilt_max_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltState:
    """State of a pan-tilt. `pose` is None when it is not known (moved by hand, not homed)."""

    connected: bool
    moving: bool = False
    homed: bool = False
    pose: PanTiltPose | None = None
    fault: str | None = None
    """Why it is not usable, for the operator; None when it is."""
    awaits_zero: bool = False
    """Whether the operator must confirm its zero: it has no switches and its position is not known."""
    wanted: PanTiltPose | None = None
    """Requested bearing of a manual pan-tilt; None when nothing is requested or when it has motors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookOptions:
    """How a look is made."""

    settle_us: int | None = None
    """Wait between the move and the exposure; None for the rig's default."""
    one_eyed: bool = False
    """Whether the camera of one fovea may be missing."""
    missing: Role | None = None
    """That fovea, where its camera is known to be missing: its frame is black."""

    def __post_init__(self) -> None:
        if self.missing is Role.WIDE:
            raise InvalidInput("asked to look without the wide camera: every look needs it; plug it in")


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerPrint:
    """The three printed calibration markers, in one plane on a horizontal line.

    `side_m`: side of the black square. `spacing_m`: distance from the wide camera's marker to each fovea's.
    The ids are of the dictionary 4X4_50.
    """

    side_m: float = 0.060
    spacing_m: float = 0.100
    wide_id: int = 0
    left_id: int = 1
    right_id: int = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class RailLimits:
    """Reachable positions of a rail, metres from its centre; positions outside are refused."""

    min_m: float
    max_m: float

    def __post_init__(self) -> None:
        check_ordered("rail limits", min_m=self.min_m, max_m=self.max_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class RailState:
    """State of a rail. `position_m` is None when it is not known (moved by hand, not homed)."""

    connected: bool
    moving: bool = False
    homed: bool = False
    position_m: float | None = None
    """Position of the rig, metres from the rail's centre, > 0 to the rig's right."""
    fault: str | None = None
    """Why it is not usable, for the operator; None when it is."""
    awaits_zero: bool = False
    """Whether the operator must confirm its zero: it has no switch and its position is not known."""
    wanted_m: float | None = None
    """Requested position of a manual rail; None when nothing is requested or when it has a motor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RailPlace:
    """A named position on the rail."""

    name: str
    position_m: float


class StationTarget(StrEnum):
    """The calibration target at a station."""

    BOARD = "board"
    """A calibration board that a person holds and turns."""
    MARKERS = "markers"
    """Three markers, one per camera, spaced by the baseline."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """A bearing of the base at which the rig is calibrated, and the target there.

    `distance_m`: measured distance from the wide camera to the centre of the target; None when not measured.
    """

    name: str
    target: StationTarget
    pose: PanTiltPose
    distance_m: float | None = None
