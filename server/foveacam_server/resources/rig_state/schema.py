"""Schemas of the rig's status: mirrors and controller, pan-tilt, trigger, clock."""

from typing import Literal

from foveacam_server.foundation.quantities import Degrees
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.calibrations.schema import CalibrationDocument
from foveacam_server.resources.cameras.schema import CameraDocument, DifferenceDocument


class DeviceProblemDocument(ResponseModel):
    """A problem of a device."""

    device: str
    detail: str
    remedy: str


class EyeDocument(ResponseModel):
    """One mirror's drive, and its direction by the calibration; null while unknown.

    They are unknown while the mirrors' controller is not connected: it may have stopped, or lost its supply.
    """

    x_v: float | None
    y_v: float | None
    ax_deg: float | None
    ay_deg: float | None


class PositionStreamDocument(ResponseModel):
    """One of the controller's position streams."""

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
    """Whether packets carry a CRC: if the firmware supports it, and the rig file does not forbid it."""
    crc_errors: int
    """Bad packets that only the CRC detected."""
    lost_answers: int
    """Requests whose answer was lost: the mirrors were parked, and the request failed."""
    tx_bytes_per_s: float
    rx_bytes_per_s: float
    tx_packets_per_s: float
    rx_packets_per_s: float
    queued_bytes: int
    """Bytes accepted by the system and not yet by the controller."""
    rtt_p50_ms: float
    rtt_p95_ms: float
    rtt_p99_ms: float
    rtt_max_ms: float
    update_limit_hz: float
    """Present limit of position updates a second on the link."""
    clock_offset_ms: float
    clock_drift_ppm: float | None
    """By how much the controller's clock runs faster than the host's."""
    streams: list[PositionStreamDocument]


class ControllerDocument(ResponseModel):
    """Identification of the mirrors' controller."""

    vendor: str
    model: str
    serial: str
    version: str
    port: str
    """Port that it is attached to; empty before it was."""


class MirrorsDocument(ResponseModel):
    """Both mirrors and their controller."""

    connected: bool
    enabled: bool | None
    """Whether the mirrors' supply rail is on; null while unknown."""
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
    """The range of directions that the calibration covers."""

    ax_min_deg: float
    ax_max_deg: float
    ay_min_deg: float
    ay_max_deg: float


class TriggerDocument(ResponseModel):
    """How often both foveae can look: settle time, the slower camera, and a margin.

    `settle_source`: `rig file`, or `measured` and the date. `interval_ms`, `rate_hz`: null until the highest
    rates of both cameras are known.
    """

    settle_us: int
    settle_source: str
    interval_ms: float | None
    rate_hz: float | None


class ClockDocument(ResponseModel):
    """The rig's clock and the wall clock at one moment."""

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
    """Settings in which the foveae differ, though one pulse exposes both."""
    mirrors: MirrorsDocument
    trigger: TriggerDocument | None
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    clock: ClockDocument


class DeviceInfoDocument(ResponseModel):
    """Identification of a device."""

    vendor: str
    model: str
    serial: str
    version: str


class PanTiltLimitsDocument(ResponseModel):
    """Limits of the pan-tilt."""

    pan_min_deg: float
    pan_max_deg: float
    tilt_min_deg: float
    tilt_max_deg: float


class StationDocument(ResponseModel):
    """A pan-tilt pose for calibration; `distance_m`: measured by tape, null when not measured."""

    name: str
    target: Literal["board", "markers"]
    pan_deg: float
    tilt_deg: float
    distance_m: float | None


class PanTiltDocument(ResponseModel):
    """The pan-tilt, which turns the whole rig: +pan to the right, +tilt down."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator turns the rig by hand."""
    wanted_pan_deg: float | None
    wanted_tilt_deg: float | None
    """Pose to which the operator is asked to turn it; null when none, or when it moves itself."""
    connected: bool
    homed: bool
    moving: bool
    pan_deg: float | None
    tilt_deg: float | None
    fault: str | None
    awaits_zero: bool
    """Whether it awaits the confirmation that it stands at its zero: `zero_confirmations`."""
    limits: PanTiltLimitsDocument | None
    stations: list[StationDocument]


class PanTiltMove(RequestModel):
    """Destination of a turn: a station by its name, or a bearing."""

    station: str | None = None
    pan_deg: Degrees | None = None
    tilt_deg: Degrees | None = None
