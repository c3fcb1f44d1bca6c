"""Schemas of cameras: settings, ranges, link, counters, trigger tests."""

from typing import Literal

from foveacam_hardware.contract import Binning
from foveacam_server.foundation.quantities import BlackLevel, Decibels, ExposureMs, Hertz
from foveacam_server.foundation.schema import RequestModel, ResponseModel

PixelFormatName = Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"]
ExposureAutoName = Literal["off", "once", "continuous"]
Verdict = Literal["untested", "ok", "ok_software_only", "camera", "wiring", "no_probe"]


class SpanDocument(ResponseModel):
    """Accepted range, both ends included; `low` = `high`: the setting is fixed."""

    low: float
    high: float


class CameraRangesDocument(ResponseModel):
    """Accepted ranges of a camera's settings; `pixel_formats` is empty before the camera was opened."""

    exposure_ms: SpanDocument
    exposure_auto: list[ExposureAutoName]
    """Accepted modes; a hardware-triggered fovea has `once` with `linked`: one exposure for both."""
    gain_db: SpanDocument
    black_level: SpanDocument
    frame_rate_hz: SpanDocument
    frame_rate_auto: bool
    """Whether the camera offers an automatic frame rate."""
    pixel_formats: list[PixelFormatName]


class CameraSettingsDocument(ResponseModel):
    """The settings that a camera accepted; `frame_rate_hz` is nominal. `kept`: restored at every start.

    Automatic exposure and rate are read back once a second.
    """

    exposure_ms: float
    exposure_auto: ExposureAutoName
    gain_db: float
    black_level: float
    frame_rate_hz: float
    frame_rate_auto: bool
    pixel_format: PixelFormatName
    binning: Binning
    """In force now: sensor pixels along each side of a picture's pixel. Set for all cameras at
    `/rig/binning`."""
    trigger: Literal["none", "hardware", "software"]
    kept: bool


class CameraLinkDocument(ResponseModel):
    """State of a camera's link, and why it does not deliver; `epoch` counts its openings."""

    phase: Literal["closed", "opening", "ready", "streaming", "degraded", "lost", "backoff"]
    reason: str
    since_s: float | None
    """Time in this state; null when unknown."""
    epoch: int


class CameraDocument(ResponseModel):
    """Last status of a camera."""

    role: str
    vendor: str
    model: str
    serial: str
    version: str
    """Version of the firmware; empty when unknown."""
    connected: bool
    width: int | None
    """Width of the unbinned sensor, px; null before the first frame."""
    height: int | None
    px_per_deg: float | None
    """Sensor pixels per degree on the optical axis, by the calibration in force; null without one."""
    exposure_ms: float
    frame_rate_hz: float
    """Measured rate."""
    frame_age_ms: float | None
    delivered: int
    skipped: int
    """Complete frames not read because newer ones had arrived."""
    dropped: int
    """Frames lost before arrival, counted by gaps in the sequence numbers."""
    incomplete: int
    late: int
    underrun: int
    settings: CameraSettingsDocument
    ranges: CameraRangesDocument
    link: CameraLinkDocument


class DifferenceDocument(ResponseModel):
    """A setting in which the foveae differ by more than 0.5 % of its range."""

    setting: Literal["exposure_ms", "exposure_auto", "gain_db", "black_level", "pixel_format", "trigger"]
    left: float | str
    right: float | str


class CameraPatch(RequestModel):
    """Settings to change; fields left out stay.

    `linked`: both foveae at once. An exposure or a rate without its mode switches the automatic off.
    """

    exposure_ms: ExposureMs | None = None
    exposure_auto: ExposureAutoName | None = None
    gain_db: Decibels | None = None
    black_level: BlackLevel | None = None
    frame_rate_hz: Hertz | None = None
    frame_rate_auto: bool | None = None
    pixel_format: PixelFormatName | None = None
    linked: bool = False


class CamerasChangedDocument(ResponseModel):
    """The changed cameras, and the settings in which the foveae differ now."""

    cameras: list[CameraDocument]
    divergence: list[DifferenceDocument]


class CamerasConfigured(ResponseModel):
    """Data of the event that cameras were configured; `reset`: to the rig file's settings."""

    roles: list[str]
    reset: bool


class EyeTestDocument(ResponseModel):
    """Result of the trigger test of one eye; times from trigger to frame."""

    eye: Literal["left", "right"]
    verdict: Verdict
    detail: str
    software_ms: float | None
    hardware_ms: float | None


class TriggerTestDocument(ResponseModel):
    """One trigger test; `id` is empty before the first."""

    id: str
    created_utc: str
    eyes: list[EyeTestDocument]
