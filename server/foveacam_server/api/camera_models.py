"""Cameras as asked for and as answered: settings, ranges, link, counters, trigger tests."""

from typing import Literal

from foveacam_server.api.models import RequestModel, ResponseModel
from foveacam_server.quantities import BlackLevel, Decibels, ExposureMs, Hertz

PixelFormatName = Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"]
ExposureAutoName = Literal["off", "once", "continuous"]
Verdict = Literal["untested", "ok", "ok_software_only", "camera", "wiring", "no_probe"]


class SpanDocument(ResponseModel):
    """What a camera accepts, both ends included; `low` = `high`: it cannot be set."""

    low: float
    high: float


class CameraRangesDocument(ResponseModel):
    """What a camera accepts; no formats before it was opened."""

    exposure_ms: SpanDocument
    exposure_auto: list[ExposureAutoName]
    """What may be asked; a fovea that waits for pulses has `once`, linked: one exposure for both."""
    gain_db: SpanDocument
    black_level: SpanDocument
    frame_rate_hz: SpanDocument
    frame_rate_auto: bool
    """Whether it can choose its rate itself."""
    pixel_formats: list[PixelFormatName]


class CameraSettingsDocument(ResponseModel):
    """What a camera took; `frame_rate_hz` is nominal. `kept`: asked again at every start.

    While it sets exposure or rate itself, they are those in force, read back once a second.
    """

    exposure_ms: float
    exposure_auto: ExposureAutoName
    gain_db: float
    black_level: float
    frame_rate_hz: float
    frame_rate_auto: bool
    pixel_format: PixelFormatName
    trigger: Literal["none", "hardware", "software"]
    kept: bool


class CameraLinkDocument(ResponseModel):
    """Whether a camera delivers and if not, why; `epoch` counts its openings."""

    phase: Literal["closed", "opening", "ready", "streaming", "degraded", "lost", "backoff"]
    reason: str
    since_s: float | None
    """How long it has been so; null when nobody knows."""
    epoch: int


class CameraDocument(ResponseModel):
    """One camera as last seen."""

    role: str
    vendor: str
    model: str
    serial: str
    version: str
    """Its firmware; empty where it does not say."""
    connected: bool
    width: int | None
    height: int | None
    exposure_ms: float
    frame_rate_hz: float
    """Measured."""
    frame_age_ms: float | None
    delivered: int
    skipped: int
    """Came whole, and newer ones were read in their place."""
    dropped: int
    """Never came: their numbers are missing."""
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
    """What shall change; what is left out stays. `linked`: both foveae at once.

    An exposure or a rate by itself is one by hand: it switches the automatic off.
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
    """The cameras that changed, with what they took, and in what the foveae differ now."""

    cameras: list[CameraDocument]
    divergence: list[DifferenceDocument]


class EyeTestDocument(ResponseModel):
    """What the trigger test found of one eye; times from trigger to frame."""

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
