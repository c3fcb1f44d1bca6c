"""The rig as answered: cameras, mirrors, pan-tilt, calibration, clock."""

from typing import Literal

from foveacam_server.api.models import Asked, CalibrationDocument, Told


class DeviceProblemDocument(Told):
    """What is wrong with one device."""

    device: str
    detail: str
    remedy: str


class CameraDocument(Told):
    """One camera as last seen."""

    role: str
    vendor: str
    model: str
    serial: str
    connected: bool
    width: int | None
    height: int | None
    exposure_ms: float
    frame_rate_hz: float
    """Measured."""
    frame_age_ms: float | None
    delivered: int
    dropped: int


class EyeDocument(Told):
    """One mirror's drive, and the direction that the calibration gives it."""

    x_v: float
    y_v: float
    ax_deg: float | None
    ay_deg: float | None


class MirrorsDocument(Told):
    """Both mirrors and their controller."""

    connected: bool
    enabled: bool
    left: EyeDocument
    right: EyeDocument
    fault: str | None
    rtt_p50_ms: float | None
    rtt_p99_ms: float | None
    tx_packets: int
    rx_packets: int
    bad_packets: int
    clock_offset_ms: float | None


class SteeringDocument(Told):
    """The box of directions that the calibration covers."""

    ax_min_deg: float
    ax_max_deg: float
    ay_min_deg: float
    ay_max_deg: float


class ClockDocument(Told):
    """The rig's clock and the wall's at one moment."""

    t_ns: int
    utc: str


class RigDocument(Told):
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
    mirrors: MirrorsDocument
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    clock: ClockDocument


class DeviceInfoDocument(Told):
    """Who a device is."""

    vendor: str
    model: str
    serial: str
    version: str


class PanTiltLimitsDocument(Told):
    """How far the pan-tilt turns."""

    pan_min_deg: float
    pan_max_deg: float
    tilt_min_deg: float
    tilt_max_deg: float


class StationDocument(Told):
    """A place to look at while calibrating; `distance_m`: by tape, null when nobody measured."""

    name: str
    target: Literal["board", "markers"]
    pan_deg: float
    tilt_deg: float
    distance_m: float | None


class PanTiltDocument(Told):
    """What turns the whole rig: +pan to the right, +tilt down."""

    present: bool
    info: DeviceInfoDocument | None
    moves_itself: bool
    """False when the operator turns the rig by hand."""
    connected: bool
    homed: bool
    moving: bool
    pan_deg: float | None
    tilt_deg: float | None
    fault: str | None
    limits: PanTiltLimitsDocument | None
    stations: list[StationDocument]


class PanTiltMove(Asked):
    """Where to turn the rig: a station by its name, or a bearing."""

    station: str | None = None
    pan_deg: float | None = None
    tilt_deg: float | None = None
