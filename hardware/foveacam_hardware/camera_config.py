"""What a rig's TOML file may say of its three cameras: which device is which eye, and what it runs with.

A camera is found by its serial number, never by the order in which the machine lists it. What an option means
to a device is its driver's; that left and right agree is checked here.
"""

from typing import Annotated, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator


def _without_spaces(serial: str) -> str:
    if serial.split() != [serial]:
        raise ValueError("has spaces in it; copy it from `foveacam doctor`")
    return serial


Serial: TypeAlias = Annotated[str, Field(min_length=1, max_length=80), AfterValidator(_without_spaces)]
Line: TypeAlias = Annotated[str, Field(min_length=1, max_length=40)]
"""An input or output of a camera, as GenICam names it (`Line0`)."""
ExposureMs: TypeAlias = Annotated[float, Field(gt=0.0, le=10_000.0)]
GainDb: TypeAlias = Annotated[float, Field(ge=0.0, le=60.0)]
Pixels: TypeAlias = Annotated[int, Field(ge=8, le=20_000)]

ROLES = ("wide", "left", "right")
LINKED = (
    "kind",
    "exposure_ms",
    "exposure_auto",
    "gain_db",
    "black_level",
    "pixel_format",
    "frame_rate_hz",
    "frame_rate_auto",
    "width_px",
    "height_px",
    "trigger",
    "trigger_edge",
)
"""What left and right must have alike: one pulse exposes both, and their pictures are compared."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class AbsentCameraConfig(_Table):
    """No camera: the rig opens without, and says so."""

    kind: Literal["absent"] = "absent"


class _PresentCamera(_Table):
    frame_rate_hz: Annotated[float, Field(gt=0.0, le=10_000.0)] = 30.0
    """Of a free-running camera; a triggered one is at most as fast."""
    frame_rate_auto: bool = False
    """The camera chooses its rate itself: as fast as exposure and readout allow."""
    readout_us: Annotated[float, Field(ge=0.0, le=1_000_000.0)] = 0.0
    """How long a frame is read out of the sensor; it places exposures where no clock can be read."""
    buffers: Annotated[int, Field(ge=2, le=256)] = 8
    """Frames that wait for who reads; of more the oldest are skipped, and counted."""


class _MachineVisionCamera(_PresentCamera):
    serial: Serial
    """As on its label; the camera is found by it."""
    exposure_ms: ExposureMs = 8.0
    exposure_auto: Literal["off", "once", "continuous"] = "off"
    """Whether the camera sets its exposure itself, beginning with `exposure_ms`; not of an eye on a pulse."""
    gain_db: GainDb = 0.0
    black_level: Annotated[float, Field(ge=0.0, le=65_535.0)] = 0.0
    """In the camera's own units."""
    pixel_format: Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"] = "Mono8"
    trigger: Literal["hardware", "software", "none"] | None = None
    """What each exposure waits for; None: left and right wait for `trigger_line`, wide for nothing."""
    trigger_line: Line = "Line0"
    """The input that the mirror controller's pulse arrives at."""
    trigger_edge: Literal["rising", "falling"] = "rising"
    strobe_line: Line | None = "Line1"
    """The output that tells the controller when an exposure goes on; None when it is not wired."""
    width_px: Pixels | None = None
    height_px: Pixels | None = None
    """The part of the sensor that is read, None: all of it; in its middle unless offsets are given."""
    offset_x_px: Annotated[int, Field(ge=0, le=20_000)] | None = None
    offset_y_px: Annotated[int, Field(ge=0, le=20_000)] | None = None
    packet_size_bytes: Annotated[int, Field(ge=220, le=16_000)] | None = None
    """GigE Vision only: the largest packet; None lets the driver find it (8900 suits an MTU of 9000)."""
    packet_delay_ns: Annotated[int, Field(ge=0, le=10_000_000)] | None = None
    """GigE Vision only: the pause between packets, where cameras share a link."""


class AravisCameraConfig(_MachineVisionCamera):
    """GigE Vision or USB3 Vision, by the system's libaravis."""

    kind: Literal["aravis"]
    interface: Annotated[str, Field(min_length=1, max_length=60)] | None = None
    """Address or name of the network interface to look on; None: on all."""


class PylonCameraConfig(_MachineVisionCamera):
    """A Basler camera, by the vendor's library."""

    kind: Literal["pylon"]
    trigger_line: Line = "Line1"
    strobe_line: Line | None = "Line2"
    """Basler counts its lines from 1: the opto-coupled input, and the output."""


class OpenCvCameraConfig(_PresentCamera):
    """A UVC camera, a network stream, a video file or numbered images."""

    kind: Literal["opencv"]
    source: Annotated[str, Field(min_length=1)] | Annotated[int, Field(ge=0, le=63)]
    """`0`, `/dev/v4l/by-id/…`, `rtsp://…`, or beside this file a video, or images as `shots/%04d.png`."""
    exposure_ms: ExposureMs | None = None
    """None leaves it to the camera: a UVC camera then sets it itself."""
    exposure_auto: Literal["off", "continuous"] | None = None
    """None: off when there is an `exposure_ms`."""
    gain_db: GainDb | None = None
    pixel_format: Literal["Mono8", "RGB8"] = "RGB8"
    trigger: Literal["software", "none"] | None = None
    """Such a camera hears no pulse: None is free-running."""
    width_px: Pixels | None = None
    height_px: Pixels | None = None
    loop: bool = False
    """Begin a file anew at its end, instead of being lost there."""


CameraConfig: TypeAlias = Annotated[
    AravisCameraConfig | PylonCameraConfig | OpenCvCameraConfig | AbsentCameraConfig,
    Field(discriminator="kind"),
]


class CamerasConfig(_Table):
    """The three cameras, by their roles."""

    wide: CameraConfig = AbsentCameraConfig()
    left: CameraConfig = AbsentCameraConfig()
    right: CameraConfig = AbsentCameraConfig()

    @model_validator(mode="after")
    def _claim_each_once(self) -> "CamerasConfig":
        claimed: dict[str, str] = {}
        for role in ROLES:
            name = device_name(getattr(self, role))
            if name is not None and claimed.setdefault(name, role) != role:
                raise ValueError(
                    f"{name} is claimed by {claimed[name]} and by {role}; one camera is one eye: give"
                    f' {role} the serial number on its own label, or `kind = "absent"`'
                )
        return self

    @model_validator(mode="after")
    def _keep_the_exposures_alike(self) -> "CamerasConfig":
        for role in ("left", "right"):
            eye = getattr(self, role)
            pulsed = getattr(eye, "trigger", "none") in (None, "hardware")
            if isinstance(eye, _MachineVisionCamera) and pulsed and eye.exposure_auto != "off":
                raise ValueError(
                    f'{role}: exposure_auto = "{eye.exposure_auto}", but one pulse exposes both foveae, whose'
                    " exposures must stay alike; leave it out here, and let the console find one exposure for"
                    " both"
                )
        return self

    @model_validator(mode="after")
    def _link_the_foveae(self) -> "CamerasConfig":
        left, right = self.left, self.right
        if isinstance(left, AbsentCameraConfig) or isinstance(right, AbsentCameraConfig):
            return self
        for key in LINKED:
            of_left, of_right = getattr(left, key, None), getattr(right, key, None)
            if of_left != of_right:
                raise ValueError(
                    f"left and right differ in {key} ({of_left!r} and {of_right!r}); one pulse exposes both"
                    f" and their pictures are compared: give both the same {key}"
                )
        return self


def device_name(camera: CameraConfig) -> str | None:
    """Return what tells a camera's device from all others; None where there is none."""
    match camera:
        case AravisCameraConfig() | PylonCameraConfig():
            return f"serial {camera.serial}"
        case OpenCvCameraConfig():
            return f"source {camera.source}"
        case AbsentCameraConfig():
            return None
