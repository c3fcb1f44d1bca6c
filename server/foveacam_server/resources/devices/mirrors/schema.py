"""Schemas of the mirrors, their controller, and steering by hand."""

from pydantic import model_validator

from foveacam_server.foundation.quantities import Degrees, DistanceM, Volts
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.rig.schema import Direction


class SteerRequest(RequestModel):
    """Direction at which both eyes point; in parallel without a distance."""

    direction: Direction
    distance_m: DistanceM | None = None


class EyeVolts(RequestModel):
    """Differential volts of one mirror."""

    x_v: Volts
    y_v: Volts


class VoltsRequest(RequestModel):
    """Differential volts of each eye's mirror; an eye left out stays unchanged."""

    left: EyeVolts | None = None
    right: EyeVolts | None = None

    @model_validator(mode="after")
    def _some_eye(self) -> "VoltsRequest":
        if self.left is None and self.right is None:
            raise ValueError("give the volts of left, of right, or of both")
        return self


class SteerGaze(SteerRequest):
    """A gaze of both eyes, and their vertical shift: by it the left eye points lower, the right higher."""

    vertical_shift_deg: Degrees = 0.0


class EyeDocument(ResponseModel):
    """One mirror's volts, and its direction by the calibration; null while unknown.

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
    """Whether packets carry a CRC: when the firmware supports it and the rig file allows it."""
    crc_errors: int
    """Bad packets that only the CRC detected."""
    lost_answers: int
    """Requests whose answer was lost, after which the mirrors were parked and the request failed."""
    tx_bytes_per_s: float
    rx_bytes_per_s: float
    tx_packets_per_s: float
    rx_packets_per_s: float
    queued_bytes: int
    """Bytes accepted by the operating system but not yet by the controller."""
    rtt_p50_ms: float
    rtt_p95_ms: float
    rtt_p99_ms: float
    rtt_max_ms: float
    update_limit_hz: float
    """Present limit of position updates per second on the link."""
    clock_offset_ms: float
    clock_drift_ppm: float | None
    """Rate of the controller's clock relative to the host's; positive: faster."""
    streams: list[PositionStreamDocument]


class ControllerDocument(ResponseModel):
    """Identification of the mirrors' controller."""

    vendor: str
    model: str
    serial: str
    version: str
    port: str
    """Its serial port; empty before it was first connected."""


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
