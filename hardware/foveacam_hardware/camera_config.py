"""Schema of the three cameras in a rig's TOML file: which device serves which role, with which settings.

A camera is identified by its serial number, never by the order in which the machine lists it. Checks that
left and right agree; how an option is applied to a device is left to its driver.
"""

from typing import Annotated, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from foveacam_hardware.config_errors import KeysConflict


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
"""Keys that must be equal for left and right: one pulse exposes both, and their images are compared."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class AbsentCameraConfig(_Table):
    """A role without a camera: the rig opens without it and reports it as missing."""

    kind: Literal["absent"] = "absent"


class _PresentCamera(_Table):
    frame_rate_hz: Annotated[float, Field(gt=0.0, le=10_000.0)] = 30.0
    """Rate of a free-running camera; a triggered camera is at most as fast."""
    frame_rate_auto: bool = False
    """Whether the camera chooses its rate itself: as fast as exposure and readout allow."""
    readout_us: Annotated[float, Field(ge=0.0, le=1_000_000.0)] = 0.0
    """Readout time of the sensor; dates exposures of cameras whose clock cannot be read."""
    buffers: Annotated[int, Field(ge=2, le=256)] = 8
    """Frames buffered for the reader; beyond that the oldest are skipped and counted."""


class MachineVisionCameraConfig(_PresentCamera):
    """A camera with a serial number and a trigger input; base of the kinds that a fovea may have."""

    kind: str
    serial: Serial
    """Serial number on the camera's label; identifies the camera."""
    exposure_ms: ExposureMs = 8.0
    exposure_auto: Literal["off", "once", "continuous"] = "off"
    """Automatic exposure, starting from `exposure_ms`; refused for a fovea that waits for the pulse."""
    gain_db: GainDb = 0.0
    black_level: Annotated[float, Field(ge=0.0, le=65_535.0)] = 0.0
    """Black level in the camera's own units."""
    pixel_format: Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"] = "Mono8"
    trigger: Literal["hardware", "software", "none"] | None = None
    """What starts each exposure; None: `trigger_line` for left and right, free-running for wide."""
    trigger_line: Line = "Line0"
    """Input that receives the mirror controller's pulse."""
    trigger_edge: Literal["rising", "falling"] = "rising"
    strobe_line: Line | None = "Line1"
    """Output that signals the exposure to the controller; None when it is not wired."""
    width_px: Pixels | None = None
    height_px: Pixels | None = None
    """Size of the sensor region that is read; None: all of it. Centred unless offsets are given."""
    offset_x_px: Annotated[int, Field(ge=0, le=20_000)] | None = None
    offset_y_px: Annotated[int, Field(ge=0, le=20_000)] | None = None
    packet_size_bytes: Annotated[int, Field(ge=220, le=16_000)] | None = None
    """GigE Vision only: largest packet; None lets the driver find it (8900 suits an MTU of 9000)."""
    packet_delay_ns: Annotated[int, Field(ge=0, le=10_000_000)] | None = None
    """GigE Vision only: pause between packets, for cameras that share a link."""


class AravisCameraConfig(MachineVisionCameraConfig):
    """A GigE Vision or USB3 Vision camera, opened through the system's libaravis."""

    kind: Literal["aravis"]
    interface: Annotated[str, Field(min_length=1, max_length=60)] | None = None
    """Address or name of the network interface to search; None: all interfaces."""


class PylonCameraConfig(MachineVisionCameraConfig):
    """A Basler camera, opened through the vendor's library."""

    kind: Literal["pylon"]
    trigger_line: Line = "Line1"
    strobe_line: Line | None = "Line2"
    """Basler counts lines from 1: Line1 is the opto-coupled input, Line2 the output."""


class OpenCvCameraConfig(_PresentCamera):
    """A UVC camera, a network stream, a video file or numbered images."""

    kind: Literal["opencv"]
    source: Annotated[str, Field(min_length=1)] | Annotated[int, Field(ge=0, le=63)]
    """`0`, `/dev/v4l/by-id/…`, `rtsp://…`, or a video or images (`shots/%04d.png`) relative to this file."""
    exposure_ms: ExposureMs | None = None
    """None leaves the exposure to the camera: a UVC camera then sets it automatically."""
    exposure_auto: Literal["off", "continuous"] | None = None
    """None: off when `exposure_ms` is given."""
    gain_db: GainDb | None = None
    pixel_format: Literal["Mono8", "RGB8"] = "RGB8"
    trigger: Literal["software", "none"] | None = None
    """Such a camera has no trigger input: None means free-running."""
    width_px: Pixels | None = None
    height_px: Pixels | None = None
    loop: bool = False
    """Restart a file at its end; otherwise the camera counts as lost there."""


PresentCameraConfig: TypeAlias = AravisCameraConfig | PylonCameraConfig | OpenCvCameraConfig
CameraConfig: TypeAlias = Annotated[PresentCameraConfig | AbsentCameraConfig, Field(discriminator="kind")]


class CamerasConfig(_Table):
    """The three cameras by role."""

    wide: CameraConfig = AbsentCameraConfig()
    left: CameraConfig = AbsentCameraConfig()
    right: CameraConfig = AbsentCameraConfig()

    @model_validator(mode="after")
    def _claim_each_once(self) -> "CamerasConfig":
        claimed: dict[str, str] = {}
        for role in ROLES:
            name = device_name(getattr(self, role))
            if name is not None and claimed.setdefault(name, role) != role:
                raise KeysConflict(
                    f"{name} is claimed by {claimed[name]} and by {role}; one camera is one eye: give"
                    f' {role} the serial number on its own label, or `kind = "absent"`',
                    keys=(role,),
                )
        return self

    @model_validator(mode="after")
    def _keep_the_exposures_alike(self) -> "CamerasConfig":
        for role in ("left", "right"):
            eye = getattr(self, role)
            pulsed = getattr(eye, "trigger", "none") in (None, "hardware")
            if isinstance(eye, MachineVisionCameraConfig) and pulsed and eye.exposure_auto != "off":
                raise KeysConflict(
                    f'{role}: exposure_auto = "{eye.exposure_auto}", but one pulse exposes both foveae, whose'
                    " exposures must stay alike; leave it out here, and let the console find one exposure for"
                    " both",
                    keys=(f"{role}.exposure_auto",),
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
                raise KeysConflict(
                    f"left and right differ in {key} ({of_left!r} and {of_right!r}); one pulse exposes both"
                    f" and their pictures are compared: give both the same {key}",
                    keys=(f"left.{key}", f"right.{key}"),
                )
        return self


def device_name(camera: CameraConfig) -> str | None:
    """Return the identification of a camera's device, unique on the machine; None for an absent camera."""
    match camera:
        case MachineVisionCameraConfig():
            return f"serial {camera.serial}"
        case OpenCvCameraConfig():
            return f"source {camera.source}"
        case AbsentCameraConfig():
            return None
