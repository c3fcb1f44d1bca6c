"""The rig as answered: cameras, mirrors, pan-tilt, calibration, clock."""

from typing import Literal

from foveacam_server.api.camera_models import CameraDocument, DifferenceDocument
from foveacam_server.api.models import CalibrationDocument, RequestModel, ResponseModel
from foveacam_server.quantities import Degrees


class DeviceProblemDocument(ResponseModel):
    """What is wrong with one device."""

    device: str
    detail: str
    remedy: str


class EyeDocument(ResponseModel):
    """One mirror's drive, and the direction that the calibration gives it; null while nobody knows.

    Nobody does while the mirrors' controller is not connected: it may have stopped, or lost its supply.
    """

    x_v: float | None
    y_v: float | None
    ax_deg: float | None
    ay_deg: float | None


class PositionStreamDocument(ResponseModel):
    """One of the controller's streams of positions."""

    stream: int
    updates_per_s: float
    left_x_v: float
    left_y_v: float
    right_x_v: float
    right_y_v: float


class ControllerLinkDocument(ResponseModel):
    """The controller's link since it was connected; rates are of the last second."""

    tx_bytes: int
    rx_bytes: int
    tx_packets: int
    rx_packets: int
    bad_packets: int
    crc: bool
    """Whether packets carry a CRC: where the firmware has one, and the rig file does not forbid it."""
    crc_errors: int
    """Of the bad packets, those that only the CRC has found out."""
    lost_answers: int
    """Requests whose answer was lost: the mirrors were parked, and whoever asked was told."""
    tx_bytes_per_s: float
    rx_bytes_per_s: float
    tx_packets_per_s: float
    rx_packets_per_s: float
    queued_bytes: int
    """Taken by the system, not yet by the controller."""
    rtt_p50_ms: float
    rtt_p95_ms: float
    rtt_p99_ms: float
    rtt_max_ms: float
    update_limit_hz: float
    """How many position updates a second the link is given now."""
    clock_offset_ms: float
    clock_drift_ppm: float | None
    """How much faster the controller's clock runs than the host's."""
    streams: list[PositionStreamDocument]


class ControllerDocument(ResponseModel):
    """Who the mirrors' controller is."""

    vendor: str
    model: str
    serial: str
    version: str
    port: str
    """Where it is attached; empty before it was."""


class MirrorsDocument(ResponseModel):
    """Both mirrors and their controller."""

    connected: bool
    enabled: bool | None
    """Whether the mirrors' rail is on; null while nobody knows."""
    left: EyeDocument
    right: EyeDocument
    fault: str | None
    rtt_p50_ms: float | None
    rtt_p99_ms: float | None
    tx_packets: int
    rx_packets: int
    bad_packets: int
    clock_offset_ms: float | None
    guarded: bool
    """Whether the mirrors are parked when this server is killed."""
    rail_wanted: bool
    """False after the operator has switched the mirrors off."""
    controller: ControllerDocument | None
    link: ControllerLinkDocument | None


class SteeringDocument(ResponseModel):
    """The box of directions that the calibration covers."""

    ax_min_deg: float
    ax_max_deg: float
    ay_min_deg: float
    ay_max_deg: float


class TriggerDocument(ResponseModel):
    """How often both foveae can look: settle, then the slower camera, then a margin.

    `settle_source`: `rig file`, or `measured` and the date. `interval_ms`, `rate_hz`: null until both
    cameras say how fast they can be.
    """

    settle_us: int
    settle_source: str
    interval_ms: float | None
    rate_hz: float | None


class ClockDocument(ResponseModel):
    """The rig's clock and the wall's at one moment."""

    t_ns: int
    utc: str


class RigDocument(ResponseModel):
    """The whole rig."""

    name: str
    rig_id: str | None
    simulated: bool
    scene: str | None
    state: str
    problems: list[DeviceProblemDocument]
    baseline_m: float | None
    steering: SteeringDocument | None
    cameras: list[CameraDocument]
    divergence: list[DifferenceDocument]
    """In what the foveae differ: one pulse exposes both."""
    mirrors: MirrorsDocument
    trigger: TriggerDocument | None
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    clock: ClockDocument


class DeviceInfoDocument(ResponseModel):
    """Who a device is."""

    vendor: str
    model: str
    serial: str
    version: str


class PanTiltLimitsDocument(ResponseModel):
    """How far the pan-tilt turns."""

    pan_min_deg: float
    pan_max_deg: float
    tilt_min_deg: float
    tilt_max_deg: float


class StationDocument(ResponseModel):
    """A place to look at while calibrating; `distance_m`: by tape, null when nobody measured."""

    name: str
    target: Literal["board", "markers"]
    pan_deg: float
    tilt_deg: float
    distance_m: float | None


class PanTiltDocument(ResponseModel):
    """What turns the whole rig: +pan to the right, +tilt down."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator turns the rig by hand."""
    wanted_pan_deg: float | None
    wanted_tilt_deg: float | None
    """Where the operator is to turn it; null when nothing is wanted, or when it moves itself."""
    connected: bool
    homed: bool
    moving: bool
    pan_deg: float | None
    tilt_deg: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it wants to be told that it stands at its zero: `zero_confirmations`."""
    limits: PanTiltLimitsDocument | None
    stations: list[StationDocument]


class PanTiltMove(RequestModel):
    """Where to turn the rig: a station by its name, or a bearing."""

    station: str | None = None
    pan_deg: Degrees | None = None
    tilt_deg: Degrees | None = None
