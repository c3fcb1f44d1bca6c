"""Schemas of the set-up: found devices, the draft of a rig file, its faults and advice, rig files."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from foveacam_hardware.contract import Binning
from foveacam_server.foundation.quantities import Degrees, Label, Millimetres, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel

CameraKind: TypeAlias = Literal["aravis", "pylon", "opencv", "simulated"]
RoleName: TypeAlias = Literal["wide", "left", "right"]
FoveaTrigger: TypeAlias = Literal["hardware", "software", "none"]
CameraName: TypeAlias = Annotated[str, Field(min_length=1, max_length=300, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A serial number, a source of OpenCV, or the role of a simulated camera."""
PortName: TypeAlias = Annotated[str, Field(max_length=300, pattern=r"^[^\x00-\x1f\x7f]*$")]
Volts: TypeAlias = Annotated[float, Field(ge=-1000.0, le=1000.0, allow_inf_nan=False)]
Microseconds: TypeAlias = Annotated[int, Field(ge=0, le=10_000_000)]
MarkerNumber: TypeAlias = Annotated[int, Field(ge=0, le=1_000_000)]
ContentHash: TypeAlias = Annotated[str, Field(min_length=64, max_length=64, pattern="^[0-9a-f]*$")]
SIMULATED: Literal["simulated"] = "simulated"
"""Kind of the simulated cameras, and port name of the simulated controller."""


class FoundCameraDocument(ResponseModel):
    """A camera on a bus, found without opening it.

    `name`: its name in a draft. `role`, `in_use`: its role in the open rig, and which program has it open.
    `problem`: why it cannot be used.
    """

    kind: CameraKind
    name: str
    vendor: str
    model: str
    serial: str
    address: str
    role: RoleName | None
    in_use: str | None
    problem: str | None


class FoundPortDocument(ResponseModel):
    """A serial port; `name`: its name in a draft. `use`: by the open rig. `controller`: has its USB id."""

    name: str
    device: str
    usb_id: str
    product: str
    serial: str
    use: str | None
    in_use: str | None
    problem: str | None
    controller: bool


class SilentBus(ResponseModel):
    """A bus that could not be searched, and why."""

    kind: str
    problem: str


class FoundDevices(ResponseModel):
    """All cameras and serial ports on this machine's buses now."""

    cameras: list[FoundCameraDocument]
    ports: list[FoundPortDocument]
    silent: list[SilentBus]


class DraftCamera(RequestModel):
    """The camera of a role."""

    kind: CameraKind
    name: CameraName


class DraftCameras(RequestModel):
    """The camera of each role; null: none chosen."""

    wide: DraftCamera | None = None
    left: DraftCamera | None = None
    right: DraftCamera | None = None


class DraftMirrors(RequestModel):
    """The mirrors' controller: its port, limits and delays."""

    port: PortName = ""
    max_v: Volts = 170.0
    bias_v: Volts = 90.0
    low_pass_hz: Annotated[int, Field(ge=0, le=1_000_000)] = 120
    settle_us: Microseconds = 14_000
    pulse_us: Microseconds = 4_000


class DraftMarkers(RequestModel):
    """The three markers as printed."""

    side_mm: Millimetres = 60.0
    spacing_mm: Millimetres = 100.0
    wide_id: MarkerNumber = 0
    left_id: MarkerNumber = 1
    right_id: MarkerNumber = 2


class DraftPanTilt(RequestModel):
    """The pan-tilt of the rig; when it is turned by hand, only `kind` has an effect."""

    kind: Literal["grbl", "ptu", "manual"]
    port: PortName = ""
    pan_min_deg: Degrees = -70.0
    pan_max_deg: Degrees = 70.0
    tilt_min_deg: Degrees = -30.0
    tilt_max_deg: Degrees = 30.0
    zero_pan_deg: Degrees | None = None
    zero_tilt_deg: Degrees | None = None
    speed_deg_s: Degrees = 25.0
    has_switches: bool = True


class RigDraft(RequestModel):
    """The values of a rig file that the set-up page edits; everything else in the file stays."""

    rig_id: Text = "my-rig"
    name: Label = "FoveaCam Duo"
    baseline_mm: Millimetres = 200.0
    working_binning: Binning | None = None
    """Binning of looks, following and live views; null: the default of the rig's kind, 2 simulated and 1
    real."""
    cameras: DraftCameras = DraftCameras()
    fovea_trigger: FoveaTrigger = "hardware"
    """Trigger of left and right: the controller's pulse, a software command, or none."""
    mirrors: DraftMirrors = DraftMirrors()
    pan_tilt: DraftPanTilt | None = None
    markers: DraftMarkers = DraftMarkers()


class DraftFault(ResponseModel):
    """A fault of one field of the draft, or of a key of its file that the draft does not have."""

    field: str
    message: str


class DraftDocument(ResponseModel):
    """The draft, its file and its faults.

    `file_exists`: whether the file is there already. `changed`: whether saving would change the file.
    """

    draft: RigDraft
    path: str
    file_exists: bool
    changed: bool
    simulated: bool
    faults: list[DraftFault]


class DraftStart(RequestModel):
    """The rig file of the list from which a draft begins; null: an empty draft, or the simulated rig."""

    path: CameraName | None = None
    simulated: bool = False
    """Whether a draft without a file begins from the built-in simulated rig."""


class AdviceDocument(ResponseModel):
    """A finding of the doctor about the draft; `field`: the field that it concerns."""

    field: str
    name: str
    level: Literal["ok", "warning", "problem"]
    found: str
    remedy: str


class RigFileDocument(ResponseModel):
    """The rig file on the disk and the changes that saving would make.

    `hash`: of the file, null without one. `changes`: unified diff of saving. `meanwhile`: unified diff of
    changes by others since the draft began; empty: none. `versions`: number of earlier ones that can be
    restored. `command`: starts the server with it.
    """

    path: str
    hash: str | None
    proposed: str
    changes: str
    meanwhile: str
    versions: int
    command: str


class FileOrder(RequestModel):
    """Hash of the file as the client saw it; null: there was no file."""

    hash: ContentHash | None


class RigFileEntry(ResponseModel):
    """A rig file that can be opened; `open`: the server has it open."""

    path: str
    name: str
    open: bool
    problem: str | None


class SceneEntry(ResponseModel):
    """A scene of the simulated rig."""

    name: str
    title: str


class RigFiles(ResponseModel):
    """The rig files that can be opened; `simulated`: whether the built-in simulated rig is open.

    `scenes`: those in which it can be opened by name; `scene`: the one that is open, null where it is not.
    """

    files: list[RigFileEntry]
    simulated: bool
    replayed: bool
    scenes: list[SceneEntry]
    scene: str | None


class OpenOrder(RequestModel):
    """The rig file to open; null: the built-in simulated rig, in a shipped scene or the present one."""

    path: CameraName | None
    scene: Annotated[str | None, Field(max_length=60)] = None


class TryOrder(RequestModel):
    """The device of the draft to identify on its port."""

    device: Literal["controller", "pan_tilt"]


class MirrorStepOrder(RequestModel):
    """A small step of both mirrors and back; only with the operator's confirmation."""

    confirmed: Literal[True]


class TryResult(ResponseModel):
    """Result of a test in a sentence; `remedy`: what to do when it failed."""

    good: bool
    sentence: str
    remedy: str
