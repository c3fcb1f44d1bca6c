# Written by .ci/generate_client.py; do not edit.
"""Documents of the API: what is sent, what is answered."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from typing_extensions import TypeAliasType

from foveacam_client.document import Document, JsonObject


class AcceptanceFigureDocument(Document):
    """A figure and its limits; null: there is none."""

    model_config = ConfigDict(
        extra="forbid",
    )
    high: float | None
    low: float | None
    name: str
    unit: str
    value: float
    within: bool


class AcceptanceRequest(Document):
    """Request of an acceptance run: how many looks without a pause, and how long the wide camera's rate."""

    model_config = ConfigDict(
        extra="forbid",
    )
    looks: Annotated[int, Field(ge=20, le=5000)] = 300
    wide_s: Annotated[float, Field(ge=2.0, le=600.0)] = 60.0


class AdviceDocument(Document):
    """A finding of the doctor about the draft; `field`: the field that it concerns."""

    model_config = ConfigDict(
        extra="forbid",
    )
    field: str
    found: str
    level: Literal["ok", "warning", "problem"]
    name: str
    remedy: str


class AlternativeDocument(Document):
    """One of several distances that a target may have.

    The probabilities of all add up to 1, or to less where it may have none of them.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    basis: Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"]
    distance_m: float
    distance_sigma_m: float
    point_rig_m: tuple[float, float, float]
    probability: float


class AnaglyphColours(Document):
    """Colours of the anaglyph: of the left and of the right eye's glass."""

    model_config = ConfigDict(
        extra="forbid",
    )
    style: Literal["red_cyan", "red_blue", "cyan_red", "blue_red"]


class ArchiveDocument(Document):
    """The archive of this server; `url`: null without one."""

    model_config = ConfigDict(
        extra="forbid",
    )
    url: str | None


class ArchiveRequest(Document):
    """How to archive. `remove_local`: whether the large files are removed from this machine afterwards."""

    model_config = ConfigDict(
        extra="forbid",
    )
    remove_local: bool = False


class ArchivedDocument(Document):
    """Location of its files in an archive. `local`: whether all are also on this machine's disk."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bytes: int
    local: bool
    url: str
    utc: str


class AreasDocument(Document):
    """Areas of the regions. `multi`: union over targets; `single`: mean of the targets' own regions."""

    model_config = ConfigDict(
        extra="forbid",
    )
    multi_m2: float
    single_m2: float
    weighted_m2: float


class AuditDocument(Document):
    """An entry of the audit log: a change that was made or attempted."""

    model_config = ConfigDict(
        extra="forbid",
    )
    address: str
    detail: str
    id: int
    kind: Literal["local", "shared_token", "user", "service", "nobody"]
    method: str
    outcome: Literal["done", "refused", "failed"]
    path: str
    repeated: int
    status: int
    utc: str
    what: str
    who: str


class AuditPage(Document):
    """Entries, newest first; `next_before`: where the next page begins, null at the end."""

    model_config = ConfigDict(
        extra="forbid",
    )
    entries: list[AuditDocument]
    next_before: int | None


AutoMode = TypeAliasType(
    "AutoMode",
    Annotated[
        Literal["off", "once", "continuous"],
        Field(description="Mode of a camera's automatic exposure."),
    ],
)


class BackendComparisonRequest(Document):
    """Two backends that are compared on the newest look."""

    model_config = ConfigDict(
        extra="forbid",
    )
    first: Annotated[str, Field(pattern="^[a-z0-9][a-z0-9_-]{0,39}$")]
    research_confirmed: bool = False
    second: Annotated[str, Field(pattern="^[a-z0-9][a-z0-9_-]{0,39}$")]


class BatchClusterDocument(Document):
    """The Dask scheduler of the server's settings, for batches; `url`: null without one."""

    model_config = ConfigDict(
        extra="forbid",
    )
    url: str | None


class BatchFailureDocument(Document):
    """A product that could not be made; `unit`: point or scan, null for a whole capture."""

    model_config = ConfigDict(
        extra="forbid",
    )
    dataset: str
    reason: str
    unit: int | None


CaptureId = TypeAliasType("CaptureId", Annotated[str, Field(max_length=255, min_length=1)])


class BatchRequest(Document):
    """Captures and kind of product of a batch; `to`: the format of an export.

    `cluster`: compute on the workers of the server's Dask cluster instead of this machine.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    capture_ids: Annotated[list[CaptureId], Field(max_length=500, min_length=1)]
    cluster: bool = False
    kind: Literal["depth", "mosaic", "export", "evaluate"]
    to: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"] = "hugging-face"


class BinningRequest(Document):
    """Working binning of all cameras."""

    model_config = ConfigDict(
        extra="forbid",
    )
    working_binning: Literal[1, 2]


class BlankPattern(Document):
    """A blank white screen."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["blank"]


class BoardDocument(Document):
    """The calibration board of stage 1: inner corners, sides in mm, and how a ChArUco board is drawn."""

    model_config = ConfigDict(
        extra="forbid",
    )
    columns: int
    dictionary: Literal[
        "4X4_50",
        "4X4_100",
        "4X4_250",
        "4X4_1000",
        "5X5_50",
        "5X5_100",
        "5X5_250",
        "5X5_1000",
        "6X6_50",
        "6X6_100",
        "6X6_250",
        "6X6_1000",
        "7X7_50",
        "7X7_100",
        "7X7_250",
        "7X7_1000",
    ] = "4X4_50"
    kind: Literal["charuco", "checkerboard"]
    legacy_pattern: bool = False
    marker_mm: float | None
    rows: int
    square_mm: float


class BoardOption(Document):
    """The calibration board: inner corners, side of a square.

    Of a ChArUco board also the side of a marker, the markers' dictionary, and whether it is drawn as OpenCV
    did before 4.6 (`legacy_pattern`: an even number of squares downwards begins with a white one).
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    columns: Annotated[int, Field(ge=3, le=40)] = 9
    dictionary: Literal[
        "4X4_50",
        "4X4_100",
        "4X4_250",
        "4X4_1000",
        "5X5_50",
        "5X5_100",
        "5X5_250",
        "5X5_1000",
        "6X6_50",
        "6X6_100",
        "6X6_250",
        "6X6_1000",
        "7X7_50",
        "7X7_100",
        "7X7_250",
        "7X7_1000",
    ] = "4X4_50"
    kind: Literal["charuco", "checkerboard"] = "charuco"
    legacy_pattern: bool = False
    marker_mm: Annotated[float | None, Field(gt=0.0, le=1000.0)] = None
    rows: Annotated[int, Field(ge=3, le=40)] = 6
    square_mm: Annotated[float, Field(gt=0.0, le=1000.0)]


class BoundDocument(Document):
    """Limits of a distance; `farthest_m` is null when there is none."""

    model_config = ConfigDict(
        extra="forbid",
    )
    farthest_m: float | None
    nearest_m: float


class CameraFlowDocument(Document):
    """Frames of a camera, and those lost by reason since it was started.

    `worst_gap_ms`: longest time between two frames shown, in the last 10 s. `lost_last_minute`: those of all
    reasons, each frame once.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    connected: bool
    delivered: int
    dropped: int
    flagged: bool
    incomplete: int
    late: int
    lost_last_minute: int
    rate_hz: float
    role: str
    skipped: int
    underrun: int
    worst_gap_ms: float | None


class CameraLinkDocument(Document):
    """State of a camera's link, and why it does not deliver; `epoch` counts its openings."""

    model_config = ConfigDict(
        extra="forbid",
    )
    epoch: int
    phase: Literal["closed", "opening", "ready", "streaming", "degraded", "lost", "backoff"]
    reason: str
    since_s: float | None


class CameraPatch(Document):
    """Settings to change; fields left out stay.

    `linked`: both foveae at once. An exposure or a rate without its mode switches the automatic off.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    black_level: Annotated[float | None, Field(ge=-65536.0, le=65536.0)] = None
    exposure_auto: Literal["off", "once", "continuous"] | None = None
    exposure_ms: Annotated[float | None, Field(ge=0.0, le=3600000.0)] = None
    frame_rate_auto: bool | None = None
    frame_rate_hz: Annotated[float | None, Field(ge=0.0, le=1000000.0)] = None
    gain_db: Annotated[float | None, Field(ge=-1000.0, le=1000.0)] = None
    linked: bool = False
    pixel_format: Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"] | None = None


class CameraSettingsDocument(Document):
    """The settings that a camera accepted; `frame_rate_hz` is nominal. `kept`: restored at every start.

    Automatic exposure and rate are read back once a second.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    binning: Literal[1, 2]
    black_level: float
    exposure_auto: Literal["off", "once", "continuous"]
    exposure_ms: float
    frame_rate_auto: bool
    frame_rate_hz: float
    gain_db: float
    kept: bool
    pixel_format: Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"]
    trigger: Literal["none", "hardware", "software"]


class CaptureChecked(Document):
    """Result of reading every file again; `faults`: a sentence each."""

    model_config = ConfigDict(
        extra="forbid",
    )
    faults: list[str]
    id: str
    sound: bool


class CapturePatch(Document):
    """Fields of a capture to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str | None, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    licence: Annotated[str | None, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None


class CapturePoints(Document):
    """Counts of a capture's points: planned, captured, skipped."""

    model_config = ConfigDict(
        extra="forbid",
    )
    frames: int
    planned: int
    scans: int
    skipped: int
    taken: int


class CaptureProgress(Document):
    """Progress of a running capture; bytes and rate are of this run."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bytes_per_s: float
    done: int
    left_s: float | None
    note: str
    phase: Literal["survey", "rail", "points", "paused", "closing"]
    stored: int
    total: int
    written_bytes: int


class CharucoPattern(Document):
    """A ChArUco board: inner corners, sides of a square and of a marker (dictionary 4X4_50)."""

    model_config = ConfigDict(
        extra="forbid",
    )
    columns: Annotated[int, Field(ge=3, le=40)]
    kind: Literal["charuco"]
    marker_mm: Annotated[float, Field(gt=0.0, le=1000.0)]
    rows: Annotated[int, Field(ge=3, le=40)]
    square_mm: Annotated[float, Field(gt=0.0, le=1000.0)]


class CheckDocument(Document):
    """Errors of the fitted calibration at poses that no sweep visited."""

    model_config = ConfigDict(
        extra="forbid",
    )
    calibration_id: str
    epipolar_p95_px: float | None
    epipolar_rms_px: float | None
    pointing_rms_px: float | None
    pointing_sigma_px: float | None
    poses: int


class CheckOptions(Document):
    """Number of poses outside the sweep to measure."""

    model_config = ConfigDict(
        extra="forbid",
    )
    poses: Annotated[int | None, Field(ge=2, le=200)] = None


class CheckRun(Document):
    """Check the fitted calibration at poses that no sweep visited."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: CheckOptions | None = None
    step: Literal["check"]


class CheckerboardPattern(Document):
    """A plain checkerboard: inner corners, side of a square."""

    model_config = ConfigDict(
        extra="forbid",
    )
    columns: Annotated[int, Field(ge=3, le=40)]
    kind: Literal["checkerboard"]
    rows: Annotated[int, Field(ge=3, le=40)]
    square_mm: Annotated[float, Field(gt=0.0, le=1000.0)]


class ChoiceRequest(Document):
    """Index of the fixation's alternative that is the true one, counted from 0."""

    model_config = ConfigDict(
        extra="forbid",
    )
    alternative: Annotated[int, Field(ge=0, le=1000000)]


class ClockDocument(Document):
    """The rig's clock and the wall clock at one moment."""

    model_config = ConfigDict(
        extra="forbid",
    )
    t_ns: int
    utc: str


class ClosingEyeDocument(Document):
    """Drift of an eye between its sweep and the check."""

    model_config = ConfigDict(
        extra="forbid",
    )
    eye: Literal["left", "right"]
    moved_px: float
    roll_deg: float
    shift_deg: tuple[float, float]
    sigma_px: float


class CloudDocument(Document):
    """The point cloud of a fixation. PLY: rig frame (x right, y down, z forward), m; GLB: +y up, m."""

    model_config = ConfigDict(
        extra="forbid",
    )
    backend: str = "sgbm"
    centre_rig_m: tuple[float, float, float]
    created_utc: str
    depth_height: int | None = None
    depth_url: str
    depth_width: int | None = None
    fixation_id: str
    glb_url: str | None
    id: str
    look_height: int | None = None
    look_width: int | None = None
    network_sha256: str | None = None
    ply_url: str
    points: int
    sigma_median_m: float
    z_max_m: float
    z_min_m: float


class ClutterRequest(Document):
    """Random obstacles (Eqs. 10-13)."""

    model_config = ConfigDict(
        extra="forbid",
    )
    occupancy: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    radius_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.5


class CombineRequest(Document):
    """Sessions of one rig whose sweeps are to be fitted jointly. `label`: None: the number of poses."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    sessions: Annotated[list[str], Field(max_length=50, min_length=2)]


class ComparedBackend(Document):
    """One side of a comparison."""

    model_config = ConfigDict(
        extra="forbid",
    )
    compute_ms: float
    known: float
    name: str
    picture_url: str
    sha256: str | None
    sigma_median_px: float | None


class ControllerDocument(Document):
    """Identification of the mirrors' controller."""

    model_config = ConfigDict(
        extra="forbid",
    )
    model: str
    port: str
    serial: str
    vendor: str
    version: str


class CorrectionDocument(Document):
    """A correction of an answer by the operator.

    `fixation_id`: the fixation that it started; for a choice, the fixation whose alternative was chosen.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    alternative: int | None = None
    created_utc: str
    fixation_id: str
    kind: Literal["choice", "nearer", "farther", "rectangle", "click"]


class CorrectionRequest(Document):
    """On which side of the present answer the true distance lies."""

    model_config = ConfigDict(
        extra="forbid",
    )
    direction: Literal["nearer", "farther"]


class CurveDocument(Document):
    """Probability of success against D_max, over the same domain; rows belong together."""

    model_config = ConfigDict(
        extra="forbid",
    )
    clear: list[float]
    d_max_m: list[float]
    success: list[float]


class DatasetExportRequest(Document):
    """The format to which a dataset is exported."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]


class DepthBackendChoice(Document):
    """The backend to use for the depth of looks from now on."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[str, Field(pattern="^[a-z0-9][a-z0-9_-]{0,39}$")]
    research_confirmed: bool = False


class DepthBackendDocument(Document):
    """One backend."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["built_in", "network"]
    licence: str
    name: str
    problem: str | None
    research_only: bool
    sha256: str | None


class DepthBackendsDocument(Document):
    """All backends and the one in use."""

    model_config = ConfigDict(
        extra="forbid",
    )
    backends: list[DepthBackendDocument]
    fallback: str | None
    in_use: str


class DepthDocument(Document):
    """Depth at one wide pixel."""

    model_config = ConfigDict(
        extra="forbid",
    )
    age_s: float
    distance_m: float
    distance_sigma_m: float
    fixation_id: str
    point_rig_m: tuple[float, float, float]
    x_px: float
    y_px: float


class DeviceInfoDocument(Document):
    """Identification of a device."""

    model_config = ConfigDict(
        extra="forbid",
    )
    model: str
    serial: str
    vendor: str
    version: str


class DeviceProblemDocument(Document):
    """A problem of a device."""

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    device: str
    remedy: str


class DifferenceDocument(Document):
    """A setting in which the foveae differ by more than 0.5 % of its range."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left: float | str
    right: float | str
    setting: Literal["exposure_ms", "exposure_auto", "gain_db", "black_level", "pixel_format", "trigger"]


class Direction(Document):
    """Axis-wise angles in the rig frame: tan ax = X/Z, tan ay = Y/Z; +x right, +y down."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: Annotated[float, Field(ge=-360.0, le=360.0)]
    ay_deg: Annotated[float, Field(ge=-360.0, le=360.0)]


class DisplayDocument(Document):
    """A connected screen; sizes in mm are null until its scale is set there.

    `fits`: whether the pattern fits on it; null when unknown. `silent_s`: time since its last message.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    fits: bool | None
    height_mm: float | None
    height_px: int
    id: str
    name: str
    px_per_mm: float | None
    silent_s: float
    width_mm: float | None
    width_px: int


class DisplayRequest(Document):
    """A screen as it describes itself.

    `width_px`, `height_px`: of the page, device pixels. `px_per_mm`: device pixels; null: not calibrated
    there yet.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    height_px: Annotated[int, Field(ge=1, le=100000)]
    name: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]
    px_per_mm: Annotated[float | None, Field(gt=0.0, le=1000.0)]
    width_px: Annotated[int, Field(ge=1, le=100000)]


class DistanceLimits(Document):
    """Limits of an answer's distance from the rig's origin; no `farthest_m`: no upper limit."""

    model_config = ConfigDict(
        extra="forbid",
    )
    farthest_m: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None
    nearest_m: Annotated[float, Field(ge=0.0, le=1000000.0)]


class DraftCamera(Document):
    """The camera of a role."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["aravis", "pylon", "opencv", "simulated"]
    name: Annotated[str, Field(max_length=300, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]


class DraftCameras(Document):
    """The camera of each role; null: none chosen."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left: DraftCamera | None = None
    right: DraftCamera | None = None
    wide: DraftCamera | None = None


class DraftFault(Document):
    """A fault of one field of the draft, or of a key of its file that the draft does not have."""

    model_config = ConfigDict(
        extra="forbid",
    )
    field: str
    message: str


class DraftMarkers(Document):
    """The three markers as printed."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left_id: Annotated[int, Field(ge=0, le=1000000)] = 1
    right_id: Annotated[int, Field(ge=0, le=1000000)] = 2
    side_mm: Annotated[float, Field(ge=-1000000.0, le=1000000.0)] = 60.0
    spacing_mm: Annotated[float, Field(ge=-1000000.0, le=1000000.0)] = 100.0
    wide_id: Annotated[int, Field(ge=0, le=1000000)] = 0


class DraftMirrors(Document):
    """The mirrors' controller: its port, limits and delays."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bias_v: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 90.0
    low_pass_hz: Annotated[int, Field(ge=0, le=1000000)] = 120
    max_v: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 170.0
    port: Annotated[str, Field(max_length=300, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    pulse_us: Annotated[int, Field(ge=0, le=10000000)] = 4000
    settle_us: Annotated[int, Field(ge=0, le=10000000)] = 14000


class DraftPanTilt(Document):
    """The pan-tilt of the rig; when it is turned by hand, only `kind` has an effect."""

    model_config = ConfigDict(
        extra="forbid",
    )
    has_switches: bool = True
    kind: Literal["grbl", "ptu", "manual"]
    pan_max_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 70.0
    pan_min_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = -70.0
    port: Annotated[str, Field(max_length=300, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    speed_deg_s: Annotated[float, Field(ge=-360.0, le=360.0)] = 25.0
    tilt_max_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 30.0
    tilt_min_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = -30.0
    zero_pan_deg: Annotated[float | None, Field(ge=-360.0, le=360.0)] = None
    zero_tilt_deg: Annotated[float | None, Field(ge=-360.0, le=360.0)] = None


class DraftStart(Document):
    """The rig file of the list from which a draft begins; null: an empty draft, or the simulated rig."""

    model_config = ConfigDict(
        extra="forbid",
    )
    path: Annotated[
        str | None,
        Field(max_length=300, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$"),
    ] = None
    simulated: bool = False


class DriftEyeDocument(Document):
    """Drift of one eye."""

    model_config = ConfigDict(
        extra="forbid",
    )
    eye: Literal["left", "right"]
    rotation_deg: float
    scale: float
    shift_x_deg: float
    shift_y_deg: float
    sigma_deg: float | None
    significant: bool


class DriftRequest(Document):
    """Request of a drift check; `distance_m`: of the scene ahead, when known."""

    model_config = ConfigDict(
        extra="forbid",
    )
    apply: bool = False
    distance_m: Annotated[float | None, Field(gt=0.5, le=1000.0)] = None


class DueItem(Document):
    """An item that the rules would remove, and why; `for_good`: its kind has no trash, it is deleted."""

    model_config = ConfigDict(
        extra="forbid",
    )
    created_utc: str
    for_good: bool
    id: str
    kind: Literal["captures", "recordings", "stills", "clouds", "fixations", "exports"]
    name: str
    size_bytes: int
    why: str


class EdgeDocument(Document):
    """The flow from one part to another; rates of the last `flow_window_s`, counts since the process began.

    `mb_per_s`: null where sizes are not counted. `dropped`: items that did not arrive; pictures that slow
    viewers drop are not flagged.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    count: int
    dropped: int
    dropped_hz: float
    flagged: bool
    items: str
    mb_per_s: float | None
    rate_hz: float
    source: str
    target: str


EndCause = TypeAliasType(
    "EndCause",
    Annotated[
        Literal["duration", "stopped", "disk_reserve", "cancelled", "failed"],
        Field(description="The cause that ended a recording; its file is complete after the first three."),
    ],
)


class EventDocument(Document):
    """An event."""

    model_config = ConfigDict(
        extra="forbid",
    )
    data: JsonObject
    id: int
    kind: str
    level: Literal["info", "warning", "error"]
    message: str
    t_utc: str


class EventLoopDocument(Document):
    """Largest lag of the event loop in the last `window_s`; null: not measured yet."""

    model_config = ConfigDict(
        extra="forbid",
    )
    flagged: bool
    window_s: float
    worst_lag_ms: float | None


class EyeDocument(Document):
    """One mirror's volts, and its direction by the calibration; null while unknown.

    They are unknown while the mirrors' controller is not connected: it may have stopped, or lost its supply.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: float | None
    ay_deg: float | None
    x_v: float | None
    y_v: float | None


class EyeTestDocument(Document):
    """Result of the trigger test of one eye; times from trigger to frame."""

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    eye: Literal["left", "right"]
    hardware_ms: float | None
    software_ms: float | None
    verdict: Literal["untested", "ok", "ok_software_only", "camera", "wiring", "no_probe"]


class EyeViewDocument(Document):
    """Whether a fovea sees the target at the end of a fixation; `reason`: why it does not."""

    model_config = ConfigDict(
        extra="forbid",
    )
    reason: str
    sees_target: bool


class EyeVolts(Document):
    """Differential volts of one mirror."""

    model_config = ConfigDict(
        extra="forbid",
    )
    x_v: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    y_v: Annotated[float, Field(ge=-1000.0, le=1000.0)]


Fault = TypeAliasType(
    "Fault",
    Annotated[
        Literal[
            "missing_device",
            "no_trigger",
            "no_strobe",
            "late_strobe",
            "late_exposure",
            "frozen_picture",
            "marker_not_seen",
            "exchanged_cameras",
            "mirrored_picture",
            "rotated_picture",
            "defocus",
            "exchanged_mirrors",
            "exchanged_axes",
            "reversed_axis",
            "stuck_axis",
            "weak_drive",
            "pixel_format",
            "black_level",
            "noise",
            "hot_pixels",
            "dark_eye",
            "vignetting",
            "lost_frames",
            "frame_rate",
            "slow_filter",
            "controller_clock",
            "loose_mount",
            "mount_drift",
            "hysteresis",
            "scatter",
            "moved_eye",
            "baseline",
            "printed_scale",
            "taped_distance",
            "not_parked",
        ],
        Field(description="Causes that a run can name."),
    ],
)


class FaultDocument(Document):
    """A fault or warning with its count; `name`: which of the scope, such as a device or a kind of job.

    `present`: whether it lasts; an incident, such as a failed job, is over at once. `over_utc`: when it
    ended, null while it is present.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    count: int
    first_utc: str
    id: str
    last_utc: str
    level: Literal["warning", "error"]
    name: str
    over_utc: str | None
    present: bool
    remedy: str | None
    scope: str
    what: str


class FaultsDismissed(Document):
    """The faults that were removed from the list."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ids: list[str]


class FieldScoreDocument(Document):
    """Leave-one-out error of a rectification."""

    model_config = ConfigDict(
        extra="forbid",
    )
    chosen: bool
    eye: Literal["left", "right"]
    loo_px: float
    name: str
    order: int


class FileOrder(Document):
    """Hash of the file as the client saw it; null: there was no file."""

    model_config = ConfigDict(
        extra="forbid",
    )
    hash: Annotated[str | None, Field(max_length=64, min_length=64, pattern="^[0-9a-f]*$")]


class FilmDocument(Document):
    """A finished film."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: str
    recording_id: str
    size_bytes: int
    url: str


class FilmRequest(Document):
    """Request of an export: one camera, or both foveae side by side or as an anaglyph; whole or a part.

    `format`: `png` gives a ZIP of pictures with their times, `npy` an array of one camera's pixels at full
    depth. `fps`: resampled in time; null: every frame, at the recorded rate. `undistorted`: for the wide
    camera only.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    end_s: Annotated[float | None, Field(ge=0.0, le=1000000.0)] = None
    format: Literal[
        "h264", "hevc", "vp9", "av1", "prores", "prores_hq", "prores_4444", "mpeg4", "png", "npy"
    ] = "h264"
    fps: Annotated[float | None, Field(ge=0.1, le=240.0)] = None
    show: Literal["wide", "left", "right", "side-by-side", "anaglyph"] = "wide"
    start_s: Annotated[float, Field(ge=0.0, le=1000000.0)] = 0.0
    undistorted: bool = False


class FitOptions(Document):
    """The fit of stages 2 and 3.

    `order`, `field_order`: of the mirrors' and the rectification's polynomials; null: chosen by scores.
    `pose_by_pose`: the paper's rectification. `distance`: source of the markers' distance. `compare`:
    score each of our additions to the paper's model.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    compare: bool = True
    distance: Literal["print", "tape", "unknown"] = "print"
    field_order: Annotated[int | None, Field(ge=1, le=5)] = None
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    order: Annotated[int | None, Field(ge=1, le=9)] = None
    pose_by_pose: bool = False
    use_all_distances: bool = True


class FitRun(Document):
    """Fit a calibration to the session's measurements."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: FitOptions | None = None
    step: Literal["fit"]


class FixationEstimate(Document):
    """An estimate of a fixation's distance; the last one is the answer.

    `step`: looks until then, 0 before the first. `elapsed_ms`: since the fixation was asked for. Basis,
    distance and limits are null while nothing is known.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    basis: Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"] | None = None
    bound: BoundDocument | None = None
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    distance_sigma_random_m: float | None = None
    elapsed_ms: float
    fixation_id: str
    job_id: str
    point_rig_m: tuple[float, float, float] | None = None
    step: int


class FolderDocument(Document):
    """A folder from which recordings are opened. `found`: whether it is there and can be read."""

    model_config = ConfigDict(
        extra="forbid",
    )
    found: bool
    path: str


class FolderFile(Document):
    """A recording in such a folder; `opened`: whether it was already added to the recordings."""

    model_config = ConfigDict(
        extra="forbid",
    )
    modified_utc: str
    name: str
    opened: bool
    path: str
    size_bytes: int


class FoldersDocument(Document):
    """The folders and their recordings, newest first. `complete`: false when there are more files."""

    model_config = ConfigDict(
        extra="forbid",
    )
    complete: bool
    files: list[FolderFile]
    folders: list[FolderDocument]


class FollowPatch(Document):
    """Changes of a followed target; fields left out stay."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    priority: Annotated[float | None, Field(ge=0.1, le=10.0)] = None
    tracker: Literal["template", "filter"] | None = None


class FollowRoundRequest(Document):
    """One look at each followed target, kept as a dataset."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    name: Annotated[str, Field(max_length=80, min_length=1)]


class FollowRoundTaken(Document):
    """Data of the event that a round of followed targets was captured."""

    model_config = ConfigDict(
        extra="forbid",
    )
    capture_id: str
    name: str
    targets: int


class FollowedDocument(Document):
    """A followed target as it is now; what is not known yet is null."""

    model_config = ConfigDict(
        extra="forbid",
    )
    age_s: float | None = None
    created_utc: str
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    hits: int = 0
    id: str
    label: str
    looks: int = 0
    point_rig_m: tuple[float, float, float] | None = None
    priority: float
    rate_hz: float = 0.0
    score: float | None = None
    speed_m_s: float | None = None
    state: Literal["finding", "followed", "lost", "out_of_field"]
    tracker: Literal["template", "filter"]
    velocity_rig_m_s: tuple[float, float, float] | None = None
    wide_score: float | None = None
    x_px: float | None = None
    y_px: float | None = None


LeftItem = TypeAliasType("LeftItem", Annotated[tuple[float, float], Field(max_length=2, min_length=2)])


RightItem = TypeAliasType("RightItem", Annotated[tuple[float, float], Field(max_length=2, min_length=2)])


class Footprints(Document):
    """Corners of both views of a point, wide px, clockwise from the top left of its image."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left: list[LeftItem]
    right: list[RightItem]


class FormatDocument(Document):
    """A format of exports; `available`: whether this machine can write it, else `why` not."""

    model_config = ConfigDict(
        extra="forbid",
    )
    available: bool
    name: str
    suffix: str
    title: str
    why: str


class FoundCameraDocument(Document):
    """A camera on a bus, found without opening it.

    `name`: its name in a draft. `role`, `in_use`: its role in the open rig, and which program has it open.
    `problem`: why it cannot be used.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    address: str
    in_use: str | None
    kind: Literal["aravis", "pylon", "opencv", "simulated"]
    model: str
    name: str
    problem: str | None
    role: Literal["wide", "left", "right"] | None
    serial: str
    vendor: str


class FoundPortDocument(Document):
    """A serial port; `name`: its name in a draft. `use`: by the open rig. `controller`: has its USB id."""

    model_config = ConfigDict(
        extra="forbid",
    )
    controller: bool
    device: str
    in_use: str | None
    name: str
    problem: str | None
    product: str
    serial: str
    usb_id: str
    use: str | None


class FoundStop(Document):
    """A stop of the rail: its reading and its estimated pose, relative to the compared scan's stop.

    `place_m`: (x, y, z), rig frame; its standard errors. `turn_rad`: about x, y, z. `shift_px`: error of the
    gazes, (u, v) of the left and of the right eye, fovea px.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    observations: int
    place_m: tuple[float, float, float]
    rail_m: float
    scan: int
    shift_px: tuple[float, float, float, float]
    sigma_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float]


class GazeDocument(Document):
    """Volts (x, y) of both mirrors while the foveae looked."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left_v: tuple[float, float]
    right_v: tuple[float, float]


class GeojsonMapRequest(Document):
    """A map as GeoJSON: polygons are obstacles, points whose property `kind` is "target" are targets."""

    model_config = ConfigDict(
        extra="forbid",
    )
    document: JsonObject
    kind: Literal["geojson"]
    m_per_unit: Annotated[float, Field(gt=0.0, le=1000000.0)] = 1.0


class GridPoints(Document):
    """Points in rows and columns, evenly spaced in angle about a centre; the outermost lie on the rim.

    Without half sizes it is as large as the calibration allows at the distance at which the eyes verge, and
    is filled in before the start.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    centre_ax_deg: Annotated[float, Field(ge=-45.0, le=45.0)] = 0.0
    centre_ay_deg: Annotated[float, Field(ge=-45.0, le=45.0)] = 0.0
    columns: Annotated[int, Field(ge=1, le=101)] = 9
    half_height_deg: Annotated[float | None, Field(gt=0.0, le=45.0)] = None
    half_width_deg: Annotated[float | None, Field(gt=0.0, le=45.0)] = None
    kind: Literal["grid"] = "grid"
    order: Literal["serpentine", "rows"] = "serpentine"
    rows: Annotated[int, Field(ge=1, le=101)] = 9


class HardwareLoadDocument(Document):
    """The hardware thread: queued commands, and its busy share of the time.

    `busy_share`: null while no rig is open. Waiting for a device counts as busy.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    busy_share: float | None
    flagged: bool
    queue_length: int
    queue_limit: int


class HealthDocument(Document):
    """Errors of the calibration in force, as medians over recent ordinary fixations."""

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    fixations: int
    horizontal_px: float | None
    rows_px: float | None
    score: float | None
    verdict: Literal["good", "recalibrate", "unknown"]
    vertical_px: float | None


class InvitationDocument(Document):
    """A one-time link, as a path of this server."""

    model_config = ConfigDict(
        extra="forbid",
    )
    expires_utc: str
    path: str


class JobProgress(Document):
    """Progress of a job: `done` of `total`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    done: int
    eta_s: float | None
    note: str
    total: int


class JoinRequest(Document):
    """The code of a one-time link, and the password to set; `name` for the first admin only."""

    model_config = ConfigDict(
        extra="forbid",
    )
    code: Annotated[str, Field(max_length=200, min_length=1)]
    name: Annotated[
        str | None,
        Field(examples=["anna"], max_length=64, pattern="^[a-z0-9][a-z0-9._@+-]{0,63}$"),
    ] = None
    password: Annotated[str, Field(examples=["correct horse battery"], max_length=256)]


class KindDocument(Document):
    """Files of one kind: `fovea` or `wide`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    files: int
    kind: str
    raw_bytes: int
    stored_bytes: int


class LeaseAnswer(Document):
    """The holder's answer to a request for the lease."""

    model_config = ConfigDict(
        extra="forbid",
    )
    hand_over: bool


class LeaseDocument(Document):
    """The holder of the control lease; null: nobody, and anybody may move."""

    model_config = ConfigDict(
        extra="forbid",
    )
    asked_by: str | None = None
    expires_in_s: float | None
    holder: str | None
    idle_s: float | None = None
    person: str | None = None


class LeaseGrant(Document):
    """The granted lease; its token goes into the X-Lease header."""

    model_config = ConfigDict(
        extra="forbid",
    )
    expires_in_s: float
    holder: str
    token: str


class LeaseRequest(Document):
    """Name of the client that takes the lease."""

    model_config = ConfigDict(
        extra="forbid",
    )
    holder: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]
    reason: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    take_over: bool = False


class LeaseWish(Document):
    """Name of the client that requests the lease from its holder."""

    model_config = ConfigDict(
        extra="forbid",
    )
    holder: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]


class LengthDocument(Document):
    """The length from the first point to the second; `same_look`: shared errors are counted once."""

    model_config = ConfigDict(
        extra="forbid",
    )
    delta_rig_m: tuple[float, float, float]
    delta_sigma_m: tuple[float, float, float]
    length_m: float
    length_sigma_m: float
    same_look: bool


class LensOptions(Document):
    """The lens of a fovea with its mirror at rest; `views`: number to take.

    `station`: where a board that fits its field is shown; without one, a station whose name contains `fovea`,
    else the rig is not turned.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    board: BoardOption | None = None
    camera: Literal["left", "right"]
    station: Annotated[str | None, Field(max_length=60, min_length=1)] = None
    views: Annotated[int | None, Field(ge=3, le=200)] = None


class LensParameterDocument(Document):
    """A parameter of a lens with its standard error; `assumed`: the views do not determine it."""

    model_config = ConfigDict(
        extra="forbid",
    )
    assumed: bool
    name: str
    sigma: float
    value: float


class LensRun(Document):
    """Measure the lens of a fovea, or add views to those taken; no other step needs it."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: LensOptions
    step: Literal["lens"]


class Liveness(Document):
    """The process is alive."""

    model_config = ConfigDict(
        extra="forbid",
    )
    status: str


class LoopAxisDocument(Document):
    """One axis: its command and range, and its error in the last look that measured it, degrees."""

    model_config = ConfigDict(
        extra="forbid",
    )
    axis: Literal["pan_x", "pan_y", "verge", "shift_y"]
    command_deg: float
    error_deg: float | None
    held: bool
    least_deg: float
    most_deg: float


class LoopDrag(Document):
    """Pixel of the wide view at which both eyes point in parallel during a drag."""

    model_config = ConfigDict(
        extra="forbid",
    )
    x_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    y_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]


class LoopEyeDocument(Document):
    """One eye that follows a separate point, fovea px; null where the point is not found."""

    model_config = ConfigDict(
        extra="forbid",
    )
    eye: Literal["left", "right"]
    score: float | None
    state: Literal["still", "tracking", "lost"]
    x_px: float | None
    y_px: float | None


class LoopEyePlace(Document):
    """The point of one fovea's picture that the loop keeps centred, fovea px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    x_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    y_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]


class LoopGains(Document):
    """Gains of one loop: kp without unit, ki per unit of loop time, kd in units of loop time."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kd: Annotated[float, Field(ge=0.0, le=2.0)]
    ki: Annotated[float, Field(ge=0.0, le=2.0)]
    kp: Annotated[float, Field(ge=0.0, le=2.0)]


CommandDegAdditionalProperty = TypeAliasType(
    "CommandDegAdditionalProperty", Annotated[float, Field(ge=-360.0, le=360.0)]
)


class LoopPatch(Document):
    """Pause, hold single axes, or set their commands; setting a command holds its axis from then on."""

    model_config = ConfigDict(
        extra="forbid",
    )
    command_deg: dict[Literal["pan_x", "pan_y", "verge", "shift_y"], CommandDegAdditionalProperty] | None = (
        None
    )
    held: dict[Literal["pan_x", "pan_y", "verge", "shift_y"], bool] | None = None
    paused: bool | None = None


class LoopRelayDocument(Document):
    """Result of the relay test of one axis; `period_looks`: period of its oscillation."""

    model_config = ConfigDict(
        extra="forbid",
    )
    amplitude_deg: float
    axis: Literal["pan_x", "pan_y", "verge", "shift_y"]
    period_looks: float
    swing_deg: float
    ultimate_gain: float


class LoopSample(Document):
    """One look of the loop's history; angles in the order of the axes."""

    model_config = ConfigDict(
        extra="forbid",
    )
    command_deg: tuple[float, float, float, float]
    distance_m: float | None
    distance_sigma_m: float | None
    error_deg: tuple[float, float, float, float] | None
    look: int
    score: float | None
    status: Literal[
        "off",
        "initializing",
        "tracking",
        "low_score",
        "match_stale",
        "pair_skew",
        "tracker_lost",
        "out_of_reach",
        "frozen",
        "held",
        "manual",
        "trigger_fault",
        "auto_tune",
        "split",
        "waiting",
    ]
    t_s: float


class LoopSettingsDocument(Document):
    """All settings of the loop, as in `LoopSettingsPatch`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    box_height_px: int
    box_width_px: int
    correct_for_ms: float | None
    depth: LoopGains
    expand_x: float
    expand_y: float
    lead_ms: float
    min_score: float
    most_hz: float | None
    pan: LoopGains
    predict: bool
    sensitivity: float
    template_scale: float
    tracker: Literal["off", "template", "filter"]
    vertical: LoopGains


class LoopSettingsPatch(Document):
    """Settings to change; fields left out stay."""

    model_config = ConfigDict(
        extra="forbid",
    )
    box_height_px: Annotated[int | None, Field(ge=16, le=400)] = None
    box_width_px: Annotated[int | None, Field(ge=16, le=400)] = None
    correct_for_ms: Annotated[float | None, Field(ge=0.0, le=10000.0)] = None
    depth: LoopGains | None = None
    expand_x: Annotated[float | None, Field(ge=1.0, le=4.0)] = None
    expand_y: Annotated[float | None, Field(ge=1.0, le=4.0)] = None
    lead_ms: Annotated[float | None, Field(ge=-50.0, le=50.0)] = None
    min_score: Annotated[float | None, Field(ge=0.0, le=1.0)] = None
    most_hz: Annotated[float | None, Field(ge=0.5, le=1000.0)] = None
    pan: LoopGains | None = None
    predict: bool | None = None
    sensitivity: Annotated[float | None, Field(ge=0.01, le=1.0)] = None
    template_scale: Annotated[float | None, Field(ge=0.0, le=1.0)] = None
    tracker: Literal["off", "template", "filter"] | None = None
    vertical: LoopGains | None = None


class LoopStepDocument(Document):
    """Step response of one axis; a settling time is null where it did not settle."""

    model_config = ConfigDict(
        extra="forbid",
    )
    axis: Literal["pan_x", "pan_y", "verge", "shift_y"]
    overshoot: float
    overshoot_before: float
    settle_before_ms: float | None
    settle_ms: float | None


class LoopTargetDocument(Document):
    """Place and tracking state of the target, wide px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    state: Literal["fixed", "tracked", "lost"]
    tracker_score: float | None
    x_px: float
    y_px: float


class LoopTriggerDocument(Document):
    """Exposures and trigger of the loop; one pulse exposes both foveae."""

    model_config = ConfigDict(
        extra="forbid",
    )
    after_trigger_us: float | None
    exposures: int
    failures: int
    in_a_row: int
    latched: bool
    pair_skew_us: float
    reason: str | None
    wide_age_ms: float | None


class LoopTuneDocument(Document):
    """The last tuning: its gains, the relay tests and step responses, and the costs before and after."""

    model_config = ConfigDict(
        extra="forbid",
    )
    candidates: int
    cost: float
    cost_before: float
    cost_relay: float
    picture_url: str
    relays: list[LoopRelayDocument]
    settings: LoopSettingsDocument
    steps: list[LoopStepDocument]
    tuned_utc: str


class LoopTuneRequest(Document):
    """How to tune: by relays alone, or polished by CMA-ES afterwards."""

    model_config = ConfigDict(
        extra="forbid",
    )
    candidates: Annotated[int, Field(ge=8, le=200)] = 48
    polish: bool = False


class MadeExport(Document):
    """A finished export: one ZIP file. `outdated`: the dataset or this program has changed since."""

    model_config = ConfigDict(
        extra="forbid",
    )
    download_url: str
    made_utc: str
    outdated: bool
    points: int
    size_bytes: int


class MapDocument(Document):
    """A map as GeoJSON in metres, as `regions` takes it."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bounds_m: list[float]
    map: JsonObject
    obstacle_m2: float
    obstacles: int
    targets_m: list[list[float]]
    vertices: int


class MarkerPattern(Document):
    """One marker of the dictionary 4X4_50: id, side of the black square."""

    model_config = ConfigDict(
        extra="forbid",
    )
    id: Annotated[int, Field(ge=0, le=49)]
    kind: Literal["marker"]
    side_mm: Annotated[float, Field(gt=0.0, le=1000.0)]


class MarkersPattern(Document):
    """The mirrors' three markers: 0 (wide) between 1 (left) and 2 (right).

    `spacing_mm`: from the middle one to each of the others, as a rule half the baseline.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["markers"]
    side_mm: Annotated[float, Field(gt=0.0, le=1000.0)]
    spacing_mm: Annotated[float, Field(gt=0.0, le=1000.0)]


class MeasuredPointDocument(Document):
    """A measured point, rig frame.

    `snapped_px`: distance of the measured pixel from the requested one, px of that view. `at_edge`: a depth
    edge is so near that the depth may be that of either surface.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    at_edge: bool
    distance_m: float
    distance_sigma_m: float
    fixation_id: str
    point_rig_m: tuple[float, float, float]
    point_sigma_m: tuple[float, float, float]
    snapped_px: float
    view: Literal["wide", "left", "right", "anaglyph", "difference", "depth"]
    x_px: float
    y_px: float


class MeasuredSettleTime(Document):
    """A measured settle time; `low_pass_hz`: cut-off of the drive filter during the measurement."""

    model_config = ConfigDict(
        extra="forbid",
    )
    low_pass_hz: int | None
    measured_utc: str
    session_id: str
    settle_us: int


DrawnPxItem = TypeAliasType("DrawnPxItem", Annotated[tuple[float, float], Field(max_length=2, min_length=2)])


class MeasurementPatch(Document):
    """Fields of a measurement to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]


class MirrorStepOrder(Document):
    """A small step of both mirrors and back; only with the operator's confirmation."""

    model_config = ConfigDict(
        extra="forbid",
    )
    confirmed: Literal[True]


Node = TypeAliasType("Node", Annotated[int, Field(ge=3, le=41)])


Station = TypeAliasType("Station", Annotated[str, Field(max_length=60, min_length=1)])


class MirrorsOptions(Document):
    """Stage 2: stations, nodes and extent of the sweep; `restart`: set earlier sweeps aside."""

    model_config = ConfigDict(
        extra="forbid",
    )
    extent_ax_deg: Annotated[float | None, Field(gt=0.0, le=12.0)] = None
    extent_ay_deg: Annotated[float | None, Field(gt=0.0, le=12.0)] = None
    nodes: Annotated[list[Node] | None, Field(max_length=2, min_length=2)] = None
    restart: bool = False
    spacing: Literal["rim", "even"] | None = None
    stations: Annotated[list[Station] | None, Field(max_length=16, min_length=1)] = None


class MirrorsRun(Document):
    """Sweep the mirrors, or continue an interrupted sweep."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: MirrorsOptions | None = None
    step: Literal["mirrors"]


class ModelScoreDocument(Document):
    """Leave-one-out error of a mirror model."""

    model_config = ConfigDict(
        extra="forbid",
    )
    chosen: bool
    eye: Literal["left", "right"]
    loo_deg: tuple[float, float]
    name: str
    order: int | None


class MosaicDepth(Document):
    """Figures of the fused depth; shares from 0 to 1."""

    model_config = ConfigDict(
        extra="forbid",
    )
    between_pairs_rel_rms: float | None
    known: float
    median_sigma_rel: float | None
    outliers: float
    seen_twice: float


class MosaicLayer(Document):
    """One layer as Deep Zoom: level 0 is one pixel, the last level the full size."""

    model_config = ConfigDict(
        extra="forbid",
    )
    dzi_url: str
    height: int
    levels: int
    name: Literal["picture", "depth"]
    tile_px: int
    tiles_url: str
    width: int


class MosaicMatching(Document):
    """Backend that computed the depth of the pairs."""

    model_config = ConfigDict(
        extra="forbid",
    )
    backend: str = "sgbm"
    failed_pairs: int = 0
    sha256: str | None = None


class MosaicNeedsDocument(Document):
    """Estimated size of a mosaic: views, px, disk space."""

    model_config = ConfigDict(
        extra="forbid",
    )
    free_bytes: int
    height: int
    needed_bytes: int
    views: int
    width: int


class MosaicRequest(Document):
    """Eye, scan and exposure of the dataset of which the mosaic is made."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bracket: Annotated[int, Field(ge=0, le=99)] = 0
    eye: Literal["left", "right"] = "left"
    scan: Annotated[int, Field(ge=0, le=1000000)] = 0


class MosaicSeams(Document):
    """Seams: distances between corresponding points of overlapping views, fovea px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    adjusted: bool
    after_rms_px: float | None
    before_rms_px: float | None
    largest_gain_percent: float | None
    largest_shift_px: float | None
    links: int
    measuring_rms_px: float | None
    rejected: int


class MountDriftDocument(Document):
    """Drift of an eye's mount during the calibration; lengths in fovea px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    knocks_px: list[float] = []
    minutes: float
    moved_px: float
    pieces: int
    px_per_minute: float
    sigma_px: float
    visits: int


class MountKnock(Document):
    """Displacement of a fovea's mount after a knock, degrees; signs as in a drift check."""

    model_config = ConfigDict(
        extra="forbid",
    )
    rotation_deg: Annotated[float, Field(ge=-5.0, le=5.0)] = 0.0
    shift_x_deg: Annotated[float, Field(ge=-5.0, le=5.0)] = 0.0
    shift_y_deg: Annotated[float, Field(ge=-5.0, le=5.0)] = 0.0


class NameDocument(Document):
    """The name that a recording would get. `free`: whether it can be recorded now, else `why` not."""

    model_config = ConfigDict(
        extra="forbid",
    )
    free: bool
    name: str
    why: str


class NetworkFindingDocument(Document):
    """One check of a network."""

    model_config = ConfigDict(
        extra="forbid",
    )
    found: str
    passed: bool
    remedy: str
    what: str


class OpenMapRequest(Document):
    """A square without obstacles and with one target in its middle."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["open"]
    size_m: Annotated[float, Field(ge=1.0, le=1000000.0)] = 60.0


class OpenOrder(Document):
    """The rig file to open; null: the built-in simulated rig, in a shipped scene or the present one."""

    model_config = ConfigDict(
        extra="forbid",
    )
    path: Annotated[
        str | None,
        Field(max_length=300, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$"),
    ]
    scene: Annotated[str | None, Field(max_length=60)] = None


class OpenRequest(Document):
    """A recording in a folder of the server's machine; `name`: its name here, usually its file's."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[str | None, Field(max_length=1000)] = None
    path: Annotated[str, Field(max_length=4096, min_length=1)]


class PanTiltLimitsDocument(Document):
    """Limits of the pan-tilt."""

    model_config = ConfigDict(
        extra="forbid",
    )
    pan_max_deg: float
    pan_min_deg: float
    tilt_max_deg: float
    tilt_min_deg: float


class PanTiltMove(Document):
    """Destination of a turn: a station by its name, or a bearing."""

    model_config = ConfigDict(
        extra="forbid",
    )
    pan_deg: Annotated[float | None, Field(ge=-360.0, le=360.0)] = None
    station: str | None = None
    tilt_deg: Annotated[float | None, Field(ge=-360.0, le=360.0)] = None


class PartDocument(Document):
    """A part of the server with flows in or out; `busy_share` and `waiting` are null where it has none.

    A thread has the name that it has under `threads`, a camera or a view `camera wide`, `view wide`.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    busy_share: float | None
    flagged: bool
    kind: Literal["thread", "camera", "device", "view", "clients", "file"]
    name: str
    waiting: int | None


class PasswordChange(Document):
    """The present password and the new one."""

    model_config = ConfigDict(
        extra="forbid",
    )
    new_password: Annotated[str, Field(examples=["correct horse battery"], max_length=256)]
    password: Annotated[str, Field(examples=["correct horse battery"], max_length=256)]


class PatternDocument(Document):
    """The pattern that all screens show; its size includes the white edge, and is null when it is blank."""

    model_config = ConfigDict(
        extra="forbid",
    )
    description: str
    height_mm: float | None
    pattern: Annotated[
        CharucoPattern | CheckerboardPattern | MarkerPattern | MarkersPattern | BlankPattern,
        Field(discriminator="kind"),
    ]
    width_mm: float | None


class PictureDocument(Document):
    """A picture of a step's result."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: str
    title: str
    url: str


class PictureMapRequest(Document):
    """A picture of the map from above, dark at obstacles: PNG or JPEG."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["picture"]
    m_per_px: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None
    picture_base64: Annotated[str, Field(max_length=24000000)]


class Pixel(Document):
    """A point of the wide image, px; the centre of the first pixel is (0, 0)."""

    model_config = ConfigDict(
        extra="forbid",
    )
    x_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    y_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]


PixelFormat = TypeAliasType(
    "PixelFormat",
    Annotated[
        Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"],
        Field(
            description="Pixel format on the wire (GenICam names); drivers convert Bayer to RGB and packed pixels to 16 bit."
        ),
    ],
)


class PlaceRequest(Document):
    """A pixel of a view; the centre of the first pixel is (0, 0).

    Without `fixation_id`, the newest look with depth is measured; the view must still show it. In the wide
    view the newest look that covers the pixel is measured, and `fixation_id` has no effect.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    fixation_id: Annotated[str | None, Field(max_length=40)] = None
    view: Literal["wide", "left", "right", "anaglyph", "difference", "depth"]
    x_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    y_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]


CornersRigMItem = TypeAliasType(
    "CornersRigMItem",
    Annotated[tuple[float, float, float], Field(max_length=3, min_length=3)],
)


class PlaneDocument(Document):
    """A plane, rig frame; `normal` points to the rig.

    `normal_sigma_deg`: rms angle from the true normal. `pan_deg`: turned to the right about the vertical,
    `tilt_deg`: facing up; both 0 for a plane that faces the rig. `distance_m`: of the plane from the rig's
    origin. Residuals are the inlier pixels' distances from the plane: their rms, the rms expected from
    matching errors alone, and the width of their central 95 % (`flatness_m`).
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    centre_rig_m: tuple[float, float, float]
    corners_rig_m: list[CornersRigMItem]
    distance_m: float
    distance_sigma_m: float
    expected_rms_m: float
    flatness_m: float
    normal: tuple[float, float, float]
    normal_sigma_deg: float
    outlier_fraction: float
    outliers: int
    pan_deg: float
    pan_sigma_deg: float
    pixels: int
    residual_rms_m: float
    tilt_deg: float
    tilt_sigma_deg: float


class PointDocument(Document):
    """A captured point. `sheet_row`, `sheet_column`: its position on the contact sheet, from 0."""

    model_config = ConfigDict(
        extra="forbid",
    )
    aim_ax_deg: float | None
    aim_ay_deg: float | None
    brackets: int
    cameras: list[Literal["left", "right", "wide"]]
    distance_m: float | None
    index: int
    rail_mm: float | None
    scan: int
    sheet_column: int
    sheet_row: int


class PositionStreamDocument(Document):
    """One of the controller's position streams."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left_x_v: float
    left_y_v: float
    right_x_v: float
    right_y_v: float
    stream: int
    updates_per_s: float


class Problem(Document):
    """An error (RFC 9457); `asked`, `found` and `remedy` are set when known."""

    asked: str | None = None
    detail: str
    found: str | None = None
    instance: str | None = None
    remedy: str | None = None
    status: int
    title: str
    type: str


class ProcessDocument(Document):
    """The server's process; null: not reported by the system.

    `cpu_share`: 1 is one fully used core. `services_opened_s`: since the process began.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    began_utc: str | None
    cores: int
    cpu_share: float | None
    database_mb: float
    memory_mb: float | None
    open_files: int | None
    open_files_limit: int
    services_opened_s: float | None
    up_s: float | None


class RailLimitsDocument(Document):
    """Range of the rail, from its middle."""

    model_config = ConfigDict(
        extra="forbid",
    )
    max_mm: float
    min_mm: float


class RailMove(Document):
    """Destination of the rig: a place by its name, or millimetres from the middle."""

    model_config = ConfigDict(
        extra="forbid",
    )
    place: str | None = None
    position_mm: Annotated[float | None, Field(ge=-1000000.0, le=1000000.0)] = None


class RailPlaceDocument(Document):
    """A named position on the rail."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: str
    position_mm: float


class RandomMapRequest(Document):
    """A random map: the same seed and settings give the same map."""

    model_config = ConfigDict(
        extra="forbid",
    )
    agent_radius_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.3
    kind: Literal["random"]
    largest_radius_m: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.8
    obstacles: Annotated[int, Field(ge=0, le=400)] = 40
    seed: Annotated[int, Field(ge=0, le=2147483647)] = 1
    size_m: Annotated[float, Field(ge=1.0, le=10000.0)] = 60.0
    smallest_radius_m: Annotated[float, Field(gt=0.0, le=1000.0)] = 0.6
    targets: Annotated[int, Field(ge=1, le=50)] = 5


ExposuresM = TypeAliasType("ExposuresM", Annotated[float, Field(gt=0.0, le=10000.0)])


RailPositionsMmItem = TypeAliasType("RailPositionsMmItem", Annotated[float, Field(ge=-2000.0, le=2000.0)])


LeftPxItem = TypeAliasType("LeftPxItem", Annotated[list[float], Field(max_length=2, min_length=2)])


RightPxItem = TypeAliasType("RightPxItem", Annotated[list[float], Field(max_length=2, min_length=2)])


class ReachDocument(Document):
    """Outlines of each eye's calibrated field, corners in wide px; they may extend beyond the image.

    `distance_m`: from the rig's origin, where the outlines are taken; null is infinity.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    calibration_id: str
    distance_m: float | None
    left_px: list[LeftPxItem]
    right_px: list[RightPxItem]


class ReadyProblem(Document):
    """A device or service that is missing."""

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    device: str


class RecordedBox(Document):
    """The box of a followed target in the wide picture; `late_ms`: latency of its detection."""

    model_config = ConfigDict(
        extra="forbid",
    )
    height_px: float
    late_ms: float
    slot: str
    width_px: float
    x_px: float
    y_px: float


class RecordedDepthDocument(Document):
    """Depth along the rig's z at the centre of the left fovea; None where too little could be matched.

    `verged_z_m`: depth at which the gazes cross. `known`: share of pixels with depth. `apart_ms`: time
    between the eyes' exposures. `backend`: the estimator; `network_sha256`: of its graph, None of a built-in.
    `looks`: number of fused looks.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    apart_ms: float
    backend: str
    known: float
    looks: int
    network_sha256: str | None
    picture_url: str
    sigma_m: float | None
    t_s: float
    verged_z_m: float | None
    z_m: float | None


FootprintPxItem = TypeAliasType(
    "FootprintPxItem", Annotated[tuple[float, float], Field(max_length=2, min_length=2)]
)


class RecordedFrameDocument(Document):
    """One frame and the pose of its exposure; None where the recording has none.

    `footprint_px`: the corners of a fovea in the wide picture, clockwise from the top left of its image.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: float | None
    ay_deg: float | None
    exposure_ms: float | None
    footprint_px: list[FootprintPxItem] | None
    index: int
    jpeg_url: str
    stream: str
    t_s: float
    volts_source: str | None
    x_v: float | None
    y_v: float | None


class RecordedStreamDocument(Document):
    """One camera of a recording. `published` = `written` + `dropped` + `waiting`; None where not counted.

    `frames`: those in the file. `losses`: dropped frames by reason. `bytes`: of its frames and their poses.
    `missing`: frames between the published ones that were not read or never came, not part of `published`.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    bits: int | None
    bytes: int | None
    dropped: int | None
    fps: float
    frames: int
    height: int | None
    losses: dict[str, int]
    missing: int | None
    name: str
    pixel_format: str | None
    published: int | None
    role: Literal["wide", "left", "right"] | None
    waiting: int
    width: int | None
    written: int | None


class RecordingPatch(Document):
    """Fields of a recording to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")]


class RecordingRequest(Document):
    """The cameras to record, for how long, and the name."""

    model_config = ConfigDict(
        extra="forbid",
    )
    compress: bool = False
    duration_s: Annotated[
        float | None,
        Field(
            description="It ends by itself after so long, at the latest; null: after 300 s.",
            ge=0.1,
            le=86400.0,
        ),
    ] = None
    label: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    name: Annotated[str, Field(max_length=1000)]
    numbered: bool = False
    packed: bool = False
    rate: Literal["full", "live"] = "full"
    roles: Annotated[list[Literal["wide", "left", "right"]], Field(max_length=3, min_length=1)] = [
        "wide",
        "left",
        "right",
    ]


class Rectangle(Document):
    """A rectangle of the wide image, px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    height_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    width_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    x_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]
    y_px: Annotated[float, Field(ge=-1000000.0, le=1000000.0)]


class ReferenceDepthRange(Document):
    """Comparison in a range of depths, the rig's own baseline against the reference.

    `expected_*`: error of either baseline's depth for a disparity error that is equal at all depths.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    bias_m: float
    depth_m: float
    expected_reference_m: float
    expected_short_m: float
    from_m: float
    reference_own_sigma_m: float
    reference_sigma_m: float
    relative_rms: float
    rms_m: float
    samples: int
    to_m: float


class ReferenceRequest(Document):
    """Settings of a reference.

    `scan`: that whose depth is compared; null: the scan nearest to the middle. `bracket`: index of the
    exposure. `across`: samples over the width of a view. `rail_sigma_m`: standard error of a position on the
    rail; 0: exact.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    across: Annotated[int, Field(ge=2, le=40)] = 10
    bracket: Annotated[int, Field(ge=0, le=99)] = 0
    rail_sigma_m: Annotated[float, Field(ge=0.0, le=0.05)] = 0.0001
    scan: Annotated[int | None, Field(ge=0, le=1000000)] = None


class ReferenceStop(Document):
    """A scan whose position on the rail is known."""

    model_config = ConfigDict(
        extra="forbid",
    )
    rail_m: float
    scan: int


class RegionDocument(Document):
    """The region of one target."""

    model_config = ConfigDict(
        extra="forbid",
    )
    area_m2: float
    ring_share: float | None
    target: int
    x_m: float
    y_m: float


PointsMItemItem = TypeAliasType("PointsMItemItem", Annotated[float, Field(ge=-10000000.0, le=10000000.0)])


PointsMItem = TypeAliasType(
    "PointsMItem", Annotated[list[PointsMItemItem], Field(max_length=2, min_length=2)]
)


TargetsMItemItem = TypeAliasType("TargetsMItemItem", Annotated[float, Field(ge=-10000000.0, le=10000000.0)])


TargetsMItem = TypeAliasType(
    "TargetsMItem", Annotated[list[TargetsMItemItem], Field(max_length=2, min_length=2)]
)


class RetentionApplied(Document):
    """The items moved to the trash or deleted for good."""

    model_config = ConfigDict(
        extra="forbid",
    )
    items: list[DueItem]
    size_bytes: int


class RetentionRequest(Document):
    """Digest of the preview to carry out."""

    model_config = ConfigDict(
        extra="forbid",
    )
    digest: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class RetentionRule(Document):
    """Limits of a kind: keep none older than `keep_days`, and the newest up to `keep_gb`; null: no limit."""

    model_config = ConfigDict(
        extra="forbid",
    )
    keep_days: Annotated[float | None, Field(gt=0.0, le=36500.0)] = None
    keep_gb: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None


class RetentionRules(Document):
    """The rules of a data directory; `automatic`: whether the server applies them once an hour."""

    model_config = ConfigDict(
        extra="forbid",
    )
    automatic: bool = False
    captures: RetentionRule | None = None
    clouds: RetentionRule | None = None
    exports: RetentionRule | None = None
    fixations: RetentionRule | None = None
    recordings: RetentionRule | None = None
    stills: RetentionRule | None = None


class RigBinningDocument(Document):
    """Binning of the cameras: sensor pixels along each side of a picture's pixel.

    `working_binning`: of looks, following, the loop and live views, until the rig is opened again.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    held_by: str | None
    in_force: Literal[1, 2] | None
    problem: str | None
    switch_s: float | None
    working_binning: Literal[1, 2]


class RigDraft(Document):
    """The values of a rig file that the set-up page edits; everything else in the file stays."""

    model_config = ConfigDict(
        extra="forbid",
    )
    baseline_mm: Annotated[float, Field(ge=-1000000.0, le=1000000.0)] = 200.0
    cameras: DraftCameras | None = None
    fovea_trigger: Literal["hardware", "software", "none"] = "hardware"
    markers: DraftMarkers | None = None
    mirrors: DraftMirrors | None = None
    name: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = (
        "FoveaCam Duo"
    )
    pan_tilt: DraftPanTilt | None = None
    rig_id: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = "my-rig"
    working_binning: Literal[1, 2] | None = None


class RigEntry(Document):
    """One rig of the list, with the state that its server reports now.

    `state`: null where it does not answer; `problem` then gives the reason. `driver`: who holds its lease.
    `picture_url`: its newest wide picture, read through this server.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    address: str
    driver: str | None
    id: str
    name: str
    picture_url: str
    problem: str | None
    problems: list[str]
    remedy: str | None
    rig_id: str | None
    scene: str | None
    simulated: bool | None
    source: Literal["this", "file", "announced"]
    state: str | None


class RigFileDocument(Document):
    """The rig file on the disk and the changes that saving would make.

    `hash`: of the file, null without one. `changes`: unified diff of saving. `meanwhile`: unified diff of
    changes by others since the draft began; empty: none. `versions`: number of earlier ones that can be
    restored. `command`: starts the server with it.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    changes: str
    command: str
    hash: str | None
    meanwhile: str
    path: str
    proposed: str
    versions: int


class RigFileEntry(Document):
    """A rig file that can be opened; `open`: the server has it open."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: str
    open: bool
    path: str
    problem: str | None


class RingDocument(Document):
    """Where an observer may stand about a target; `empty_because`: in words, why nowhere."""

    model_config = ConfigDict(
        extra="forbid",
    )
    area_m2: float
    d_max_m: float
    empty: bool
    empty_because: str | None
    inner_m: float
    outer_m: float
    resolution_mrad: float


class RingRequest(Document):
    """The feature to resolve, the resolution, and the nearest allowed distance (Eqs. 6-9)."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bound: Literal["inflated", "plain", "as_printed"] = "inflated"
    d_min_m: Annotated[float, Field(ge=0.0, le=1000000.0)] = 0.0
    feature_mm: Annotated[float, Field(ge=0.001, le=1000000.0)] = 20.0
    near_error_m: Annotated[float, Field(ge=0.0, le=1000000.0)] = 0.0
    pixels: Annotated[float, Field(ge=0.01, le=100000.0)] = 1.0
    px_per_deg: Annotated[float, Field(ge=0.001, le=100000.0)] = 502.0
    small_angle: bool = False


Role = TypeAliasType(
    "Role",
    Annotated[
        Literal["wide", "left", "right"],
        Field(description="Role of a camera in the rig: the wide camera, or the left or right fovea."),
    ],
)


class SampleDocument(Document):
    """One sample of a profile; `z_m` and its matching error are null where there is no depth."""

    model_config = ConfigDict(
        extra="forbid",
    )
    along_m: float
    z_m: float | None
    z_sigma_m: float | None


class SceneEntry(Document):
    """A scene of the simulated rig."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: str
    title: str


class ServiceTokenDocument(Document):
    """A token of a service, without its secret."""

    model_config = ConfigDict(
        extra="forbid",
    )
    created_by: str
    created_utc: str
    expires_utc: str | None
    id: str
    last_used_utc: str | None
    name: str
    owner: str | None
    prefix: str
    scopes: list[Literal["view", "operate", "administer"]]


class ServiceTokenList(Document):
    """The tokens, by name."""

    model_config = ConfigDict(
        extra="forbid",
    )
    tokens: list[ServiceTokenDocument]


class ServiceTokenRequest(Document):
    """A new token; `days`: its lifetime, null: unlimited."""

    model_config = ConfigDict(
        extra="forbid",
    )
    days: Annotated[int | None, Field(ge=1, le=3650)] = None
    name: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]
    scopes: Annotated[
        list[Literal["view", "operate", "administer"]],
        Field(max_length=3, min_length=1),
    ]


class SessionRequest(Document):
    """A new session."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]


DistanceM = TypeAliasType("DistanceM", Annotated[float, Field(gt=0.0, le=100000.0)])


class SetPoint(Document):
    """Where both eyes look; degrees of the rig frame, `ax_deg` > 0 to the right, `ay_deg` > 0 down."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: Annotated[float, Field(ge=-45.0, le=45.0)]
    ay_deg: Annotated[float, Field(ge=-45.0, le=45.0)]
    distance_m: DistanceM | Literal["infinity"] | None = None
    shift_deg: Annotated[float, Field(ge=-2.0, le=2.0)] = 0.0


Points = TypeAliasType("Points", Annotated[list[SetPoint], Field(max_length=10000)])


class SetPoints(Document):
    """Points one by one, in their order; accepted as text of the set-point language, kept written out."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["set_points"]
    points: Points | str


class SettleAxisDocument(Document):
    """Settling of one axis of one mirror."""

    model_config = ConfigDict(
        extra="forbid",
    )
    axis: Literal["x", "y"]
    eye: Literal["left", "right"]
    quality: float | None
    resonance_hz: float | None
    response_ms: float | None = None
    response_open_ms: float | None = None
    settle_1pct_ms: float | None
    settle_ms: float | None


class SettleDocument(Document):
    """The settle characterisation.

    `settle_us`: the time that the largest move takes on every axis. `applied`: whether it is in use.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    applied: bool = False
    axes: list[SettleAxisDocument]
    settle_us: int | None = None


class SettleOptions(Document):
    """`apply`: put the measured settle time in use, now and at every start."""

    model_config = ConfigDict(
        extra="forbid",
    )
    apply: bool = False


class SettleRun(Document):
    """Measure the mirrors' settle time."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: SettleOptions | None = None
    step: Literal["settle"]


class SettleTimeDocument(Document):
    """The wait of the rig after every move.

    `source`: `rig file`, or `measured` and the date. `rig_file_us`: the rig file's value. `measured`: the
    measured one in use; null: the rig file's is.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    measured: MeasuredSettleTime | None
    rig_file_us: int
    settle_us: int
    source: str


class SettleTimeRequest(Document):
    """The session whose settle time is to be used."""

    model_config = ConfigDict(
        extra="forbid",
    )
    session_id: Annotated[str, Field(max_length=64)]


class SightDocument(Document):
    """A point, with the targets seen from it unnoticed."""

    model_config = ConfigDict(
        extra="forbid",
    )
    targets: list[int]
    x_m: float
    y_m: float


class SignInDocument(Document):
    """The sign-in that the server requires, and the principal of the request."""

    model_config = ConfigDict(
        extra="forbid",
    )
    expires_utc: str | None
    kind: Literal["local", "shared_token", "user", "service", "nobody"]
    mode: Literal["open", "token", "users", "first_admin"]
    name: str | None
    rights: list[Literal["view", "operate", "administer"]]
    role: Literal["viewer", "operator", "admin"] | None


class SignInRequest(Document):
    """A name and its password."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[
        str,
        Field(examples=["anna"], max_length=64, pattern="^[a-z0-9][a-z0-9._@+-]{0,63}$"),
    ]
    password: Annotated[str, Field(examples=["correct horse battery"], max_length=256)]


class SilentBus(Document):
    """A bus that could not be searched, and why."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: str
    problem: str


class SimulatedFaults(Document):
    """The faults in force; none when all lists are empty and both knocks are zero."""

    model_config = ConfigDict(
        extra="forbid",
    )
    dead_axes: Annotated[list[Literal["left x", "left y", "right x", "right y"]], Field(max_length=4)] = []
    frozen: Annotated[list[Literal["wide", "left", "right"]], Field(max_length=3)] = []
    knocked_left: MountKnock | None = None
    knocked_right: MountKnock | None = None
    no_strobe: Annotated[list[Literal["left", "right"]], Field(max_length=2)] = []
    no_trigger: Annotated[list[Literal["left", "right"]], Field(max_length=2)] = []
    unplugged: Annotated[list[Literal["wide", "left", "right"]], Field(max_length=3)] = []


class SkippedPoint(Document):
    """A skipped point."""

    model_config = ConfigDict(
        extra="forbid",
    )
    index: int
    why: str


class SpanDocument(Document):
    """Accepted range, both ends included; `low` = `high`: the setting is fixed."""

    model_config = ConfigDict(
        extra="forbid",
    )
    high: float
    low: float


class SpreadDocument(Document):
    """Root mean square and largest difference, px."""

    model_config = ConfigDict(
        extra="forbid",
    )
    max: float
    rms: float


class StageDocument(Document):
    """Times of one stage in the last `window_s`, from its histogram; null: none.

    `queue`: wait of a command for the hardware thread; `request`: any request until its answer began.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    count: int
    median_ms: float | None
    p99_ms: float | None
    rate_hz: float
    stage: str
    window_s: float


class StandoffDocument(Document):
    """The ring, and the probability that an observer anywhere in the domain sees the target unnoticed."""

    model_config = ConfigDict(
        extra="forbid",
    )
    clear_at_inner: float
    clear_at_outer: float
    corridor_m2: float
    curve: CurveDocument
    domain_m2: float
    expected_area_m2: float
    ring: RingDocument
    success: float
    success_slope_per_m: float


class StandoffRequest(Document):
    """Where to stand about one target among random obstacles."""

    model_config = ConfigDict(
        extra="forbid",
    )
    clutter: ClutterRequest | None = None
    domain_m2: Annotated[float | None, Field(gt=0.0, le=1e30)] = None
    ring: RingRequest | None = None


class StartStepDocument(Document):
    """One step of the rig's start; `device`: `rig` (its file), `calibration`, `renderer`, or a device.

    `detail`, `remedy`: why it failed, and what to do; for a device that connected later, that it did; for the
    active renderer of a simulated rig, how many kernels are compiled. `left_s`: time left; null where
    unknown.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    device: str
    left_s: float | None = None
    remedy: str
    state: Literal["pending", "active", "done", "failed"]


class StartTimeDocument(Document):
    """One step of the rig's last opening; `after_s`: from the process' beginning to the step's."""

    model_config = ConfigDict(
        extra="forbid",
    )
    after_s: float | None
    device: str
    duration_s: float | None
    state: str


class StationDocument(Document):
    """A pan-tilt pose for calibration; `distance_m`: measured by tape, null when not measured."""

    model_config = ConfigDict(
        extra="forbid",
    )
    distance_m: float | None
    name: str
    pan_deg: float
    target: Literal["board", "markers"]
    tilt_deg: float


class SteerRequest(Document):
    """Direction at which both eyes point; in parallel without a distance."""

    model_config = ConfigDict(
        extra="forbid",
    )
    direction: Direction
    distance_m: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None


class SteeringDocument(Document):
    """The range of directions that the calibration covers."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_max_deg: float
    ax_min_deg: float
    ay_max_deg: float
    ay_min_deg: float


class StepDocument(Document):
    """One look of the vergence loop."""

    model_config = ConfigDict(
        extra="forbid",
    )
    compute_ms: float | None
    index: int
    left_ax_deg: float
    left_ay_deg: float
    phase: str
    residual_x_px: float | None
    residual_y_px: float | None
    right_ax_deg: float
    right_ay_deg: float
    score: float | None


class StillCamera(Document):
    """The frames of one camera: `came` of `asked`, stored as `files`; `detail`: why no more came.

    Exposure, volts and angles are of the stack's middle; `gain_db` and the times are of its frames.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    asked: int
    ax_deg: float | None
    ay_deg: float | None
    bits: int
    came: int
    camera: Literal["wide", "left", "right"]
    channels: int
    detail: str
    exposure_ms: float | None
    files: int
    first_t_ns: int | None
    gain_db: float | None
    height: int
    last_t_ns: int | None
    remedy: str
    width: int
    x_v: float | None
    y_v: float | None


class StillCheck(Document):
    """Whether every file is unchanged; `faults`: a sentence for each difference."""

    model_config = ConfigDict(
        extra="forbid",
    )
    faults: list[str]
    id: str
    sound: bool


class StillDocument(Document):
    """One still.

    `trouble`: why it cannot be read; `distance_m`: at which the gazes cross; None: they do not.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    archived: ArchivedDocument | None
    calibration_id: str | None
    cameras: list[StillCamera]
    codec: str | None
    created_utc: str | None
    distance_m: float | None
    folder: str
    id: str
    label: str
    licence: str
    name: str
    pan_deg: float | None
    rail_mm: float | None
    rig_id: str | None
    size_bytes: int
    stack_frames: int
    stack_keep: Literal["mean", "all"]
    state: Literal["held", "kept", "removed"]
    tilt_deg: float | None
    trouble: str
    url: str
    warnings: list[str]


class StillKeepRequest(Document):
    """Name and label of a held still to keep; fields left out stay."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str | None, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    name: Annotated[str | None, Field(max_length=1000)] = None


class StillPatch(Document):
    """Fields of a still to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str | None, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    licence: Annotated[str | None, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None


class StillRequest(Document):
    """Request of a still; the mirrors do not move."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cameras: Annotated[list[Literal["wide", "left", "right"]], Field(max_length=3, min_length=1)] = [
        "wide",
        "left",
        "right",
    ]
    codec: Literal["tiff", "png"] = "png"
    label: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    licence: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = "all rights reserved"
    name: Annotated[str | None, Field(max_length=1000)] = None
    save: bool = False
    stack_frames: Annotated[int, Field(ge=1, le=64)] = 5
    stack_keep: Literal["mean", "all"] = "mean"


class StopAnswer(Document):
    """The stop is engaged; `parked`: whether the mirrors' controller confirmed, after `parked_in_ms`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    engaged: bool
    parked: bool
    parked_in_ms: float


class StopDocument(Document):
    """Whether the stop is engaged."""

    model_config = ConfigDict(
        extra="forbid",
    )
    by: str | None
    engaged: bool
    since_utc: str | None


class SuggestionDocument(Document):
    """A good target for a first look; `score`: salience relative to the picture's best, which has 1.

    `verified`: both foveae have looked at it and verged; else it is chosen by the wide picture alone.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: float
    ay_deg: float
    score: float
    verified: bool
    x_px: float
    y_px: float


class SweepPoseDocument(Document):
    """One pose of a sweep, and the state of either eye."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: float
    ay_deg: float
    index: int
    left: Literal["centred", "rim", "refused", "waiting"]
    left_reason: str | None
    right: Literal["centred", "rim", "refused", "waiting"]
    right_reason: str | None


class TargetDocument(Document):
    """A stored point that was fixated; distance and point are null where only limits are known."""

    model_config = ConfigDict(
        extra="forbid",
    )
    alternatives: Annotated[list[AlternativeDocument], Field(validate_default=True)] = []
    ax_deg: float
    ay_deg: float
    basis: Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"] = "both_foveae"
    bound: BoundDocument | None = None
    cloud_id: str | None
    corrections: Annotated[list[CorrectionDocument], Field(validate_default=True)] = []
    created_utc: str
    distance_m: float | None
    distance_sigma_m: float | None
    distance_sigma_random_m: float | None = None
    fixation_id: str
    id: str
    label: str
    left_view: EyeViewDocument | None = None
    point_rig_m: tuple[float, float, float] | None
    right_view: EyeViewDocument | None = None
    x_px: float
    y_px: float


class TargetPatch(Document):
    """Fields of a target to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    label: Annotated[str, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")]


class TargetPlace(Document):
    """Direction and wide pixel of a fixation's target."""

    model_config = ConfigDict(
        extra="forbid",
    )
    ax_deg: float
    ay_deg: float
    x_px: float
    y_px: float


class ThreadDocument(Document):
    """Threads of one name; `busiest_share`: largest share of a core of one thread; null: not known (yet)."""

    model_config = ConfigDict(
        extra="forbid",
    )
    busiest_share: float | None
    count: int
    cpu_share: float | None
    flagged: bool
    name: str


class TimelineStream(Document):
    """Times of one camera's exposures, seconds from the recording's begin, ascending."""

    model_config = ConfigDict(
        extra="forbid",
    )
    fps: float
    height: int
    name: str
    role: Literal["wide", "left", "right"]
    t_s: list[float]
    width: int


Drop = TypeAliasType("Drop", Annotated[tuple[float, float, int], Field(max_length=3, min_length=3)])


Run = TypeAliasType("Run", Annotated[tuple[float, float], Field(max_length=2, min_length=2)])


class TrackDocument(Document):
    """One channel of a recording over time, seconds from its begin.

    `runs`: first and last message of each run; between two runs there is no message. `drops`: messages before
    and after an interval in a run that lacks some, and how many by the period; none for a stream without a
    period, or one that is complete by the recorder's counts.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    count: int
    drops: list[Drop]
    kind: Literal["frames", "telemetry", "boxes"]
    name: str
    period_s: float | None
    role: Literal["wide", "left", "right"] | None
    runs: list[Run]


class TrackLayout(Document):
    """One track of the timeline, in order; a track that is off has no pane."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[str, Field(max_length=300)]
    on: bool


class TracksDocument(Document):
    """All channels of a recording over time, from its index alone."""

    model_config = ConfigDict(
        extra="forbid",
    )
    duration_s: float
    recorded: str | None
    tracks: list[TrackDocument]


class TrailPoint(Document):
    """One hit: the place of a followed target at a time."""

    model_config = ConfigDict(
        extra="forbid",
    )
    distance_sigma_m: float
    t_s: float
    x_m: float
    y_m: float
    z_m: float


class TrashEmptied(Document):
    """Number of items that were deleted from the trash."""

    model_config = ConfigDict(
        extra="forbid",
    )
    deleted: int


class TriggerDocument(Document):
    """Highest rate of looks of both foveae: settle time, period of the slower camera, and a margin.

    `settle_source`: `rig file`, or `measured` and the date. `interval_ms`, `rate_hz`: null until the highest
    rates of both cameras are known.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    interval_ms: float | None
    rate_hz: float | None
    settle_source: str
    settle_us: int


class TriggerTestDocument(Document):
    """One trigger test; `id` is empty before the first."""

    model_config = ConfigDict(
        extra="forbid",
    )
    created_utc: str
    eyes: list[EyeTestDocument]
    id: str


class TruncationDocument(Document):
    """Loss of a recording that was cut off: bytes after its last complete record, and the reason."""

    model_config = ConfigDict(
        extra="forbid",
    )
    at_byte: int
    lost: str
    lost_bytes: int
    reason: str


class TryOrder(Document):
    """The device of the draft to identify on its port."""

    model_config = ConfigDict(
        extra="forbid",
    )
    device: Literal["controller", "pan_tilt"]


class TryResult(Document):
    """Result of a test in a sentence; `remedy`: what to do when it failed."""

    model_config = ConfigDict(
        extra="forbid",
    )
    good: bool
    remedy: str
    sentence: str


class UploadRequest(Document):
    """Request of an upload: the recording's name here, without a suffix, and its length."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[str, Field(max_length=1000)]
    size_bytes: Annotated[int, Field(ge=0, le=1000000000000000)]


class UserChange(Document):
    """Fields of a user to change."""

    model_config = ConfigDict(
        extra="forbid",
    )
    disabled: bool | None = None
    role: Literal["viewer", "operator", "admin"] | None = None


class UserDocument(Document):
    """A user."""

    model_config = ConfigDict(
        extra="forbid",
    )
    created_utc: str
    guessed_at: bool
    last_seen_utc: str | None
    name: str
    role: Literal["viewer", "operator", "admin"]
    state: Literal["active", "invited", "disabled"]


class UserList(Document):
    """All users, by name."""

    model_config = ConfigDict(
        extra="forbid",
    )
    users: list[UserDocument]


class UserRemoved(Document):
    """What happened to the tokens of a removed user: kept or revoked."""

    model_config = ConfigDict(
        extra="forbid",
    )
    tokens_kept: list[ServiceTokenDocument]
    tokens_revoked: list[ServiceTokenDocument]


class UserRequest(Document):
    """A new user; without a password, one who gets a one-time link to set it."""

    model_config = ConfigDict(
        extra="forbid",
    )
    name: Annotated[
        str,
        Field(examples=["anna"], max_length=64, pattern="^[a-z0-9][a-z0-9._@+-]{0,63}$"),
    ]
    password: Annotated[str | None, Field(examples=["correct horse battery"], max_length=256)] = None
    role: Literal["viewer", "operator", "admin"]


class UserSessionDocument(Document):
    """A browser in which a user is signed in."""

    model_config = ConfigDict(
        extra="forbid",
    )
    address: str
    browser: str
    created_utc: str
    current: bool
    expires_utc: str
    id: str
    last_seen_utc: str
    streams: int
    user: str


class UserSessionList(Document):
    """The sign-ins, newest first."""

    model_config = ConfigDict(
        extra="forbid",
    )
    sessions: list[UserSessionDocument]


Verdict = TypeAliasType(
    "Verdict",
    Annotated[
        Literal["passed", "failed", "not_done"],
        Field(description="Result of one check."),
    ],
)


class Verging(Document):
    """The distance at which both eyes meet, from the rig's origin."""

    model_config = ConfigDict(
        extra="forbid",
    )
    distance_m: DistanceM | Literal["infinity"] | None = None
    each_point: bool = False
    mode: Literal["scene", "given"] = "scene"


class ViewDocument(Document):
    """One live view."""

    age_ms: float | None
    description: str
    expected_hz: float | None
    frozen_since_ms: float | None
    height: int
    name: str
    picture_scale: int
    rate_hz: float
    slow_reason: str | None
    width: int


class ViewFlowDocument(Document):
    """Pictures of a view; `dropped`: replaced by a newer picture before the client took them.

    `expected_hz`, `slow_reason`: as of the live views.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    dropped: int
    expected_hz: float | None
    published: int
    rate_hz: float
    repeated: int
    sent: int
    slow_reason: str | None
    view: str


class VoltsRequest(Document):
    """Differential volts of each eye's mirror; an eye left out stays unchanged."""

    model_config = ConfigDict(
        extra="forbid",
    )
    left: EyeVolts | None = None
    right: EyeVolts | None = None


class WideDepthDocument(Document):
    """Figures of the wide depth, which is held on a grid of square cells."""

    model_config = ConfigDict(
        extra="forbid",
    )
    age_median_s: float | None
    cell_px: Annotated[int, Field(description="side of a cell, wide px")]
    columns: int
    farthest_m: Annotated[float | None, Field(description="95 % quantile of depth along z")]
    known_cells: int
    known_fraction: Annotated[float, Field(description="share of all cells that have a depth now")]
    nearest_m: Annotated[
        float | None,
        Field(description="5 % quantile of depth along z; null when nothing is known"),
    ]
    oldest_s: float | None
    ply_url: str
    png_url: str
    relative_sigma_median: Annotated[
        float | None,
        Field(description="median of sigma of depth over depth, with ageing"),
    ]
    rows: int
    sources: Annotated[dict[str, int], Field(description="cells by what measured them")]
    survey_job_id: Annotated[str | None, Field(description="the look around that is waiting or at work")]
    surveyed_fraction: Annotated[
        float | None,
        Field(
            description="share of the field that the last look around showed to a fovea; null before the first"
        ),
    ]


class WideFitDocument(Document):
    """A lens fitted to the samples; `accuracy_deg`: standard error of a pixel's angle over the image.

    `known_fraction`: share of the image whose pixels have a direction, and can be clicked: not where the
    lens model folds back or is not known well enough.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    accuracy_deg: float | None
    cx_px: float
    cy_px: float
    distortion: list[float]
    fov_x_deg: float
    fov_y_deg: float
    fx_px: float
    fy_px: float
    known_fraction: float = 1.0
    model: str
    rms_px: float


class WideLensDocument(Document):
    """The calibrated wide lens, for turning pixels into directions: OpenCV's k1 k2 p1 p2 k3."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cx_px: float
    cy_px: float
    distortion: list[float]
    fx_px: float
    fy_px: float
    height: int
    width: int


class WideOptions(Document):
    """Stage 1; `views`: number to take, `model`: lens model to use, `station`: where the board is shown."""

    model_config = ConfigDict(
        extra="forbid",
    )
    board: BoardOption | None = None
    model: Literal["five", "rational"] | None = None
    station: Annotated[str | None, Field(max_length=60, min_length=1)] = None
    views: Annotated[int | None, Field(ge=3, le=200)] = None


class WideRun(Document):
    """Measure the wide camera, or add views to those measured."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: WideOptions | None = None
    step: Literal["wide"]


class WideSampleDocument(Document):
    """One view of the board."""

    model_config = ConfigDict(
        extra="forbid",
    )
    centre_px: tuple[float, float]
    corners: int
    id: str
    rms_px: float | None
    thumbnail_url: str
    tilt_deg: float | None


class WideStageDocument(Document):
    """Present result of stage 1."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cells: list[list[int]] | None = None
    coverage_fraction: float
    fit: WideFitDocument | None
    other_model: WideFitDocument | None
    reason: str
    samples: list[WideSampleDocument]
    tilts_covered: int


class WindowLayout(Document):
    """A named layout of `/windows`; `layout`: the fragment (after #) of its address."""

    model_config = ConfigDict(
        extra="forbid",
    )
    layout: str
    name: str


class WindowLayoutRequest(Document):
    """A layout in the form of its address: `row-600(wide,column-500(left,right))`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    layout: Annotated[str, Field(max_length=600, min_length=1, pattern="^[a-z_0-9(),-]+$")]


class AcceptanceFindingDocument(Document):
    """A fault that was named. `subject`: what has it; empty for the whole rig."""

    model_config = ConfigDict(
        extra="forbid",
    )
    detail: str
    fault: Fault
    remedy: str
    subject: str


class AllOptions(Document):
    """All steps in order; `activate`: put the result in force.

    `apply_settle`: also put the measured settle time in use.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    activate: bool = False
    apply_settle: bool = True
    check: CheckOptions | None = None
    fit: FitOptions | None = None
    mirrors: MirrorsOptions | None = None
    settle: bool = True
    wide: WideOptions | None = None


class AllRun(Document):
    """Run all steps of a calibration."""

    model_config = ConfigDict(
        extra="forbid",
    )
    options: AllOptions | None = None
    step: Literal["all"]


class BackendComparisonDocument(Document):
    """Difference of two backends on one look; disparities in px of the rectified window."""

    model_config = ConfigDict(
        extra="forbid",
    )
    difference_url: str
    edges: list[float]
    first: ComparedBackend
    id: str
    known_both: float
    left_url: str
    limit_px: float
    median_px: float | None
    second: ComparedBackend
    shares: list[float]
    spread_px: float | None
    within_1: float | None
    within_2: float | None


class BatchDocument(Document):
    """A batch. `planned`, `done`: its products; null before its first run has ended.

    Equal requests share one batch: a further run makes the missing products. `download_url`: the products as
    one ZIP file; null before there are any.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    capture_ids: list[str]
    done: int | None
    download_url: str | None
    failed: list[BatchFailureDocument]
    id: str
    job_id: str | None
    kind: Literal["depth", "mosaic", "export", "evaluate"]
    picture_url: str | None
    planned: int | None
    url: str


class CalibrationDocument(Document):
    """A calibration and its standard errors."""

    model_config = ConfigDict(
        extra="forbid",
    )
    age_s: float
    baseline_m: float
    created_utc: str
    current: bool
    health: HealthDocument | None
    id: str
    kept: bool
    label: str
    mirror_sigma_deg: float
    origin: str
    parent_id: str | None
    rectify_sigma_px: float | None
    rig_id: str
    session_id: str | None
    wide: WideLensDocument


class CameraRangesDocument(Document):
    """Accepted ranges of a camera's settings; `pixel_formats` is empty before the camera was opened."""

    model_config = ConfigDict(
        extra="forbid",
    )
    black_level: SpanDocument
    exposure_auto: list[Literal["off", "once", "continuous"]]
    exposure_ms: SpanDocument
    frame_rate_auto: bool
    frame_rate_hz: SpanDocument
    gain_db: SpanDocument
    pixel_formats: list[Literal["Mono8", "Mono12", "Mono12p", "BayerRG8", "BayerRG12p", "RGB8"]]


class CaptureDocument(Document):
    """One capture. `why`: what ended a partial one, or the action that the operator is asked for."""

    model_config = ConfigDict(
        extra="forbid",
    )
    archived: ArchivedDocument | None
    calibration_id: str | None
    codec: str | None
    conditions: JsonObject | None
    created_utc: str | None
    folder: str
    id: str
    job_id: str | None
    label: str
    licence: str
    name: str
    plan: JsonObject | None
    points: CapturePoints
    progress: CaptureProgress | None
    removed: bool
    resumable: bool
    rig_id: str | None
    size_bytes: int
    state: Literal["starting", "running", "paused", "complete", "partial", "damaged"]
    url: str
    why: str


class ClosingDocument(Document):
    """The drift since the sweep, by nodes visited again, and whether it was corrected before the check.

    `rows_px`: vertical difference between the eyes that the drift caused.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    calibration_id: str
    corrected: bool
    detail: str
    eyes: list[ClosingEyeDocument]
    places: int
    rows_px: float


class ComparisonDocument(Document):
    """Differences of two calibrations: fovea px, and wide px for the wide camera."""

    model_config = ConfigDict(
        extra="forbid",
    )
    a: str
    b: str
    baseline_m: float
    disparity_difference_px: SpreadDocument
    distance_m: float
    epipolar_difference_px: SpreadDocument
    picture_url: str
    pointing_difference_px: SpreadDocument
    wide_px: SpreadDocument


class ControllerLinkDocument(Document):
    """The controller's link since it was connected; rates are of the last second."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bad_packets: int
    clock_drift_ppm: float | None
    clock_offset_ms: float
    crc: bool
    crc_errors: int
    lost_answers: int
    queued_bytes: int
    rtt_max_ms: float
    rtt_p50_ms: float
    rtt_p95_ms: float
    rtt_p99_ms: float
    rx_bytes: int
    rx_bytes_per_s: float
    rx_packets: int
    rx_packets_per_s: float
    streams: list[PositionStreamDocument]
    tx_bytes: int
    tx_bytes_per_s: float
    tx_packets: int
    tx_packets_per_s: float
    update_limit_hz: float


class CoverageDocument(Document):
    """Positions of the views of one scan in the wide image; shares and overlaps from 0 to 1."""

    model_config = ConfigDict(
        extra="forbid",
    )
    footprints: list[Footprints]
    outside_wide: int
    overlap_across: float | None
    overlap_down: float | None
    seen_both: float
    seen_either: float


class DatasetExport(Document):
    """The export of a capture to one format. `largest_bytes`: its size at most; null where it is impossible.

    `refusal`: why none can be made now.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    job_id: str | None
    kind: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]
    largest_bytes: int | None
    made: MadeExport | None
    progress: JobProgress | None
    refusal: Problem | None
    state: Literal["none", "building", "complete"]
    url: str


class DatasetExports(Document):
    """The exports of a capture, one for each format."""

    model_config = ConfigDict(
        extra="forbid",
    )
    capture_id: str
    exports: list[DatasetExport]
    name: str
    url: str


class DraftDocument(Document):
    """The draft, its file and its faults.

    `file_exists`: whether the file is there already. `changed`: whether saving would change the file.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    changed: bool
    draft: RigDraft
    faults: list[DraftFault]
    file_exists: bool
    path: str
    simulated: bool


class DriftCheckDocument(Document):
    """Result of a drift check, and whether it was applied."""

    model_config = ConfigDict(
        extra="forbid",
    )
    applied: bool
    calibration_id: str
    created_utc: str
    detail: str
    duration_s: float
    eyes: list[DriftEyeDocument]
    id: str
    locked: bool
    looks: int
    new_calibration_id: str | None
    residual_px: float | None
    vergence_known: bool


class EngineDocument(Document):
    """The load of the whole server at one moment; shares are of the last `window_s`."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cameras: list[CameraFlowDocument]
    edges: list[EdgeDocument]
    event_loop: EventLoopDocument
    flow_window_s: float
    hardware: HardwareLoadDocument
    parts: list[PartDocument]
    process: ProcessDocument
    stages: list[StageDocument]
    start: list[StartTimeDocument]
    threads: list[ThreadDocument]
    utc: str
    version: str
    views: list[ViewFlowDocument]
    window_s: float | None


class EstimateDocument(Document):
    """Time and space of a plan. `total_s` is the least that physics allows: `limit_s`, verging and moves."""

    model_config = ConfigDict(
        extra="forbid",
    )
    coverage: CoverageDocument
    distance_assumed: bool
    duration_high_s: float
    duration_low_s: float
    files: int
    free_bytes: int
    hand_moves: int
    kinds: list[KindDocument]
    limit_s: float
    plan: JsonObject
    points: int
    preparing_fixations: int
    preparing_high_s: float
    preparing_low_s: float
    rail_s: float
    raw_bytes: int
    reverge_s: float
    shots: int
    stored_bytes: int
    timed_captures: int
    total_s: float
    warnings: list[str]


class FitDocument(Document):
    """The last fit, and the models that were compared."""

    model_config = ConfigDict(
        extra="forbid",
    )
    calibration_id: str
    drift: JsonObject | None = None
    fields: list[FieldScoreDocument]
    models: list[ModelScoreDocument]
    paper: JsonObject | None
    parallax: JsonObject | None
    volts_roundtrip_max_lsb: float


class FixationDocument(Document):
    """The result of a fixation.

    `state`: how the vergence loop of both foveae ended; `basis`: how the distance is known, which may be by
    other means. Distance and point are null where `basis` is `bound` or null.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    alternatives: Annotated[list[AlternativeDocument], Field(validate_default=True)] = []
    basis: Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"] | None = None
    bound: BoundDocument | None = None
    calibration_id: str
    chosen_alternative: int | None = None
    cloud_id: str | None
    created_utc: str
    distance_m: float | None
    distance_sigma_m: float | None
    distance_sigma_random_m: float | None = None
    duration_ms: float | None
    id: str
    job_id: str
    left_view: EyeViewDocument | None = None
    point_rig_m: tuple[float, float, float] | None
    reason: str
    request: JsonObject
    residual_px: float | None
    right_view: EyeViewDocument | None = None
    score: float | None
    state: Literal["verged", "no_texture", "lost", "out_of_range", "timed_out"]
    steps: list[StepDocument]
    target: TargetPlace
    target_id: str | None


class FixationRequest(Document):
    """Request of a fixation: exactly one of pixel, rectangle and direction."""

    model_config = ConfigDict(
        extra="forbid",
    )
    corrects: Annotated[str | None, Field(max_length=64, min_length=1)] = None
    depth: bool = True
    direction: Direction | None = None
    frame_seq: Annotated[int | None, Field(ge=0, le=4294967295)] = None
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    pixel: Pixel | None = None
    rectangle: Rectangle | None = None
    within: DistanceLimits | None = None


class FollowRequest(Document):
    """Request to follow a target: exactly one of pixel, rectangle, direction and target_id."""

    model_config = ConfigDict(
        extra="forbid",
    )
    box_px: Annotated[int, Field(ge=16, le=400)] = 64
    direction: Direction | None = None
    frame_seq: Annotated[int | None, Field(ge=0, le=4294967295)] = None
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    pixel: Pixel | None = None
    priority: Annotated[float, Field(ge=0.1, le=10.0)] = 1.0
    rectangle: Rectangle | None = None
    target_id: Annotated[str | None, Field(max_length=64, min_length=1)] = None
    tracker: Literal["template", "filter"] = "template"


class FoundDevices(Document):
    """All cameras and serial ports on this machine's buses now."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cameras: list[FoundCameraDocument]
    ports: list[FoundPortDocument]
    silent: list[SilentBus]


class JobDocument(Document):
    """A job: long work that a request started."""

    model_config = ConfigDict(
        extra="forbid",
    )
    created_utc: str
    ended_utc: str | None
    id: str
    kind: str
    problem: Problem | None
    progress: JobProgress
    result_url: str | None
    started_utc: str | None
    state: Literal["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]


class LensFitDocument(Document):
    """A telephoto lens fitted to the samples."""

    model_config = ConfigDict(
        extra="forbid",
    )
    accuracy_deg: float | None
    cx_px: float
    cy_px: float
    distortion: list[float]
    fov_x_deg: float
    fov_y_deg: float
    fx_px: float
    fy_px: float
    known_fraction: float = 1.0
    model: str
    parameters: list[LensParameterDocument]
    rms_px: float


class LoopDocument(Document):
    """Present state of the loop; unknown values are null."""

    model_config = ConfigDict(
        extra="forbid",
    )
    axes: list[LoopAxisDocument]
    detail: str
    distance_m: float | None
    distance_sigma_m: float | None
    dragged: bool
    eyes: list[LoopEyeDocument]
    fine: bool | None
    job_id: str | None
    lead_ms: float | None
    looks: int
    paused: bool
    point_rig_m: tuple[float, float, float] | None
    rate_hz: float
    running: bool
    score_left: float | None
    score_right: float | None
    settings: LoopSettingsDocument
    status: Literal[
        "off",
        "initializing",
        "tracking",
        "low_score",
        "match_stale",
        "pair_skew",
        "tracker_lost",
        "out_of_reach",
        "frozen",
        "held",
        "manual",
        "trigger_fault",
        "auto_tune",
        "split",
        "waiting",
    ]
    target: LoopTargetDocument | None
    trigger: LoopTriggerDocument
    tune_job_id: str | None
    tuned: LoopTuneDocument | None


class LoopTargetRequest(Document):
    """Where to look: exactly one of pixel and direction."""

    model_config = ConfigDict(
        extra="forbid",
    )
    direction: Direction | None = None
    distance_m: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None
    frame_seq: Annotated[int | None, Field(ge=0, le=4294967295)] = None
    pixel: Pixel | None = None


class MadeMosaic(Document):
    """A finished mosaic.

    Pixel (x, y) is the direction ((x + u0_px) / f_px, (y + v0_px) / f_px, 1) from the eye at `eye_rig_m`.
    A pixel of the depth layer is `cell_px` of the picture; red * 65536 + green * 256 + blue of it, times
    `step_m`, is its depth along z; black is unknown.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    bracket: int
    cell_px: int
    depth: MosaicDepth
    depth_picture_url: str
    eye: Literal["left", "right"]
    eye_rig_m: tuple[float, float, float] | None
    f_px: float
    far_m: float | None
    glb_url: str | None
    height: int
    layers: list[MosaicLayer]
    made_utc: str
    matching: MosaicMatching
    near_m: float | None
    overview_url: str
    ply_url: str | None
    scan: int
    seams: MosaicSeams
    size_bytes: int
    step_m: float
    tiles: int
    u0_px: int
    v0_px: int
    views: int
    width: int


class MeasurementRequest(Document):
    """One point; two ends of a length or of a profile's line; two opposite corners of a plane's rectangle."""

    model_config = ConfigDict(
        extra="forbid",
    )
    kind: Literal["point", "length", "plane", "profile"]
    label: Annotated[str | None, Field(max_length=80, min_length=1, pattern="^[^\\x00-\\x1f\\x7f]*$")] = None
    points: Annotated[list[PlaceRequest], Field(max_length=2, min_length=1)]


class MirrorsDocument(Document):
    """Both mirrors and their controller."""

    model_config = ConfigDict(
        extra="forbid",
    )
    bad_packets: int
    clock_offset_ms: float | None
    connected: bool
    controller: ControllerDocument | None
    enabled: bool | None
    fault: str | None
    guarded: bool
    left: EyeDocument
    link: ControllerLinkDocument | None
    rail_wanted: bool
    right: EyeDocument
    rtt_p50_ms: float | None
    rtt_p99_ms: float | None
    rx_packets: int
    tx_packets: int


class MomentDocument(Document):
    """The frames of all cameras nearest to a time.

    `meeting_m`: distance at which the gazes cross, if any; `meeting_z_m`: its depth; `meeting_px`: its place
    in the wide picture. `boxes`: of the targets that were followed.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    boxes: list[RecordedBox]
    frames: dict[Literal["wide", "left", "right"], RecordedFrameDocument]
    meeting_m: float | None
    meeting_px: tuple[float, float] | None
    meeting_z_m: float | None
    t_s: float


class MosaicDocument(Document):
    """The state of a capture's mosaic, and the estimated size of one or why none is possible.

    `outdated`: points were added to the capture since. `in_scene`: its surface is in the 3D scene.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    brackets: list[int]
    capture_id: str
    in_scene: bool
    job_id: str | None
    made: MadeMosaic | None
    name: str
    needs: MosaicNeedsDocument | None
    outdated: bool
    progress: JobProgress | None
    refusal: Problem | None
    scans: list[int]
    state: Literal["none", "unfinished", "building", "complete"]
    url: str


class NetworkCheckDocument(Document):
    """Findings of a network's check on a pair with known disparities."""

    model_config = ConfigDict(
        extra="forbid",
    )
    compute_ms: float | None
    error_median_px: float | None
    findings: list[NetworkFindingDocument]
    name: str
    passed: bool
    sgbm_ms: float | None


class PanTiltDocument(Document):
    """The pan-tilt, which turns the whole rig: +pan to the right, +tilt down."""

    model_config = ConfigDict(
        extra="forbid",
    )
    awaits_zero: bool
    connected: bool
    fault: str | None
    homed: bool
    info: DeviceInfoDocument | None
    limits: PanTiltLimitsDocument | None
    moves_itself: bool
    moving: bool
    pan_deg: float | None
    present: bool
    stations: list[StationDocument]
    tilt_deg: float | None
    wanted_pan_deg: float | None
    wanted_tilt_deg: float | None


class PlayerLayout(Document):
    """Arrangement of the player. `panes`: as in the address of a window of views.

    `from_s`, `to_s`: the part of the recording that the timeline shows.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    boxes: bool
    depth: bool
    footprints: bool
    from_s: Annotated[float, Field(ge=0.0, le=1000000.0)]
    panes: Annotated[str, Field(max_length=1000)]
    speed: Annotated[float, Field(ge=0.1, le=16.0)]
    stereo: Literal["off", "left", "right", "anaglyph", "difference"]
    style: Literal["red_cyan", "red_blue", "cyan_red", "blue_red"]
    to_s: Annotated[float, Field(ge=0.0, le=1000000.0)]
    tracks: Annotated[list[TrackLayout], Field(max_length=200)]


class PointsDocument(Document):
    """The points of a capture; `rows`, `columns`: of the contact sheet."""

    model_config = ConfigDict(
        extra="forbid",
    )
    columns: int
    points: list[PointDocument]
    rows: int
    skipped: list[SkippedPoint]


class PresetCamera(Document):
    """The settings of one camera."""

    model_config = ConfigDict(
        extra="forbid",
    )
    black_level: float
    exposure_auto: AutoMode
    exposure_ms: float
    frame_rate_auto: bool
    frame_rate_hz: float
    gain_db: float
    pixel_format: PixelFormat
    role: Role


class ProfileDocument(Document):
    """Depth along a line; `along_m` is measured on a fronto-parallel surface at depth `median_z_m`.

    `shared_sigma_m`: standard error of Z that all samples share.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    end_rig_m: tuple[float, float, float]
    known_fraction: float
    median_z_m: float
    samples: list[SampleDocument]
    shared_sigma_m: float
    start_rig_m: tuple[float, float, float]


class RailDocument(Document):
    """The rail, which moves the whole rig sideways: + to its right."""

    model_config = ConfigDict(
        extra="forbid",
    )
    awaits_zero: bool
    connected: bool
    fault: str | None
    homed: bool
    info: DeviceInfoDocument | None
    limits: RailLimitsDocument | None
    moves_itself: bool
    moving: bool
    places: list[RailPlaceDocument]
    position_mm: float | None
    present: bool
    wanted_mm: float | None


class RasterPlan(Document):
    """What a raster capture takes, in which order; the points follow from it alone."""

    model_config = ConfigDict(
        extra="forbid",
    )
    exposures_ms: Annotated[list[ExposuresM], Field(max_length=16)] = []
    format: Literal["foveacam-raster-plan"] = "foveacam-raster-plan"
    points: Annotated[GridPoints | SetPoints | None, Field(discriminator="kind")] = None
    rail_positions_mm: Annotated[list[RailPositionsMmItem], Field(max_length=25)] = []
    stack_frames: Annotated[int, Field(ge=1, le=256)] = 1
    stack_keep: Literal["mean", "all"] = "mean"
    verging: Verging | None = None
    version: Literal[1] = 1
    wide: Literal["point", "scan", "none"] = "point"


class RecordingDocument(Document):
    """One recording. `why`: what ended it early. `playable`: whether it has frames to show.

    `ended`: the cause of its end; null in progress, and when unknown. In progress, `left_s`: time until it
    ends by itself; `room_bytes`: free space on the disk beyond the reserve, `room_s`: how long that lasts at
    its rate. `truncated`: what was cut off; the rest was recovered by scanning the file and is complete.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    archived: ArchivedDocument | None
    asked_s: float | None
    calibration_id: str | None
    calibration_problem: str | None
    created_utc: str | None
    duration_s: float
    ended: EndCause | None
    file: str
    id: str
    job_id: str | None
    label: str
    left_s: float | None
    name: str
    playable: bool
    removed: bool
    rig_id: str | None
    room_bytes: int | None
    room_s: float | None
    size_bytes: int
    state: Literal["starting", "recording", "ending", "complete", "partial", "truncated", "damaged"]
    streams: list[RecordedStreamDocument]
    truncated: TruncationDocument | None
    url: str
    why: str


class ReferenceComparison(Document):
    """The rig's own baseline against the reference; `wrong`: share of samples apart by more than 5 % of Z.

    Those are excluded from the rest. `stated_sigma_rel`: the reference's own standard error, median.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    bias_rel: float
    bins: list[ReferenceDepthRange]
    disparity_bias_px: float
    disparity_rms_px: float
    rms_m: float
    rms_rel: float
    samples: int
    stated_sigma_rel: float
    wrong: float


class RegionsDocument(Document):
    """The regions, and map, rings, regions and union as one GeoJSON document."""

    model_config = ConfigDict(
        extra="forbid",
    )
    areas: AreasDocument
    duration_ms: float
    empty_because: str | None
    geojson: JsonObject
    points: list[SightDocument]
    regions: list[RegionDocument]
    ring: RingDocument


class RegionsRequest(Document):
    """Request of the regions in which one can stand about the targets of a map."""

    model_config = ConfigDict(
        extra="forbid",
    )
    agent_radius_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.3
    map: JsonObject
    points_m: Annotated[list[PointsMItem] | None, Field(max_length=1000)] = None
    ring: RingRequest | None = None
    targets_m: Annotated[list[TargetsMItem] | None, Field(max_length=50)] = None


class RetentionPreview(Document):
    """Preview of what the rules would remove now; `digest`: identifies exactly these items.

    `file`: of the rules.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    digest: str
    file: str
    items: list[DueItem]
    rules: RetentionRules
    size_bytes: int


class RigFiles(Document):
    """The rig files that can be opened; `simulated`: whether the built-in simulated rig is open.

    `scenes`: those in which it can be opened by name; `scene`: the one that is open, null where it is not.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    files: list[RigFileEntry]
    replayed: bool
    scene: str | None
    scenes: list[SceneEntry]
    simulated: bool


class ServiceTokenCreated(Document):
    """The new token; its secret is shown this once."""

    model_config = ConfigDict(
        extra="forbid",
    )
    document: ServiceTokenDocument
    token: str


class StartDocument(Document):
    """The steps of the rig's last start, in their order."""

    model_config = ConfigDict(
        extra="forbid",
    )
    steps: list[StartStepDocument]


class SweepDocument(Document):
    """Stage 2 at one station: `done` of `nodes` poses."""

    model_config = ConfigDict(
        extra="forbid",
    )
    distance_m: float | None
    done: int
    nodes: int
    poses: list[SweepPoseDocument]
    station: str


class TimelineDocument(Document):
    """Times of all exposures of a recording. `calibrated`: whether depth can be computed from its poses."""

    model_config = ConfigDict(
        extra="forbid",
    )
    calibrated: bool
    duration_s: float
    streams: list[TimelineStream]


class UploadDocument(Document):
    """An upload.

    `part_bytes`: largest part; the next one begins at `received_bytes`. `recording`: set once the file is
    complete and readable; its `state` shows whether it was cut off.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    id: str
    name: str
    part_bytes: int
    received_bytes: int
    recording: RecordingDocument | None
    size_bytes: int


class UserCreated(Document):
    """The new user, and the link by which it sets a password; null when it has one."""

    model_config = ConfigDict(
        extra="forbid",
    )
    invitation: InvitationDocument | None
    user: UserDocument


class AcceptanceCheckDocument(Document):
    """Result of one check. `note`: why it was not made; `picture`: name of its picture, or null."""

    model_config = ConfigDict(
        extra="forbid",
    )
    figures: list[AcceptanceFigureDocument]
    findings: list[AcceptanceFindingDocument]
    name: str
    note: str
    picture: str | None
    title: str
    verdict: Verdict


class AcceptanceDocument(Document):
    """A whole acceptance run, or the part that was made before it was cancelled."""

    model_config = ConfigDict(
        extra="forbid",
    )
    accepted: bool
    calibration_id: str | None
    checks: list[AcceptanceCheckDocument]
    complete: bool
    created_utc: str
    duration_s: float
    id: str
    rig_id: str


class CameraDocument(Document):
    """Last status of a camera."""

    model_config = ConfigDict(
        extra="forbid",
    )
    connected: bool
    delivered: int
    dropped: int
    exposure_ms: float
    frame_age_ms: float | None
    frame_rate_hz: float
    height: int | None
    incomplete: int
    late: int
    link: CameraLinkDocument
    model: str
    px_per_deg: float | None
    ranges: CameraRangesDocument
    role: str
    serial: str
    settings: CameraSettingsDocument
    skipped: int
    underrun: int
    vendor: str
    version: str
    width: int | None


class CameraPreset(Document):
    """The settings of all cameras under a name."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cameras: list[PresetCamera]
    name: str
    saved_utc: str


class CamerasChangedDocument(Document):
    """The changed cameras, and the settings in which the foveae differ now."""

    model_config = ConfigDict(
        extra="forbid",
    )
    cameras: list[CameraDocument]
    divergence: list[DifferenceDocument]


class CaptureRequest(Document):
    """Request of a capture: its plan and name; an empty plan covers the whole field of the rig."""

    model_config = ConfigDict(
        extra="forbid",
    )
    codec: Literal["tiff", "png"] = "tiff"
    label: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = ""
    licence: Annotated[str, Field(max_length=400, pattern="^[^\\x00-\\x1f\\x7f]*$")] = "all rights reserved"
    name: Annotated[str, Field(max_length=1000)]
    plan: RasterPlan | None = None


class EstimateRequest(Document):
    """A plan to estimate; `distance_m` is used where the plan measures the distance at its start."""

    model_config = ConfigDict(
        extra="forbid",
    )
    codec: Literal["tiff", "png"] = "tiff"
    distance_m: Annotated[float | None, Field(gt=0.0, le=1000000.0)] = None
    plan: RasterPlan | None = None


class LayoutDocument(Document):
    """The stored arrangement. `state`: `none`, `kept`, or why it cannot be used; `why`: in words."""

    model_config = ConfigDict(
        extra="forbid",
    )
    layout: PlayerLayout | None
    state: Literal["none", "kept", "unreadable", "of another recording"]
    why: str


class LayoutRequest(Document):
    """An arrangement to store; `replace`: also over one that cannot be used."""

    model_config = ConfigDict(
        extra="forbid",
    )
    layout: PlayerLayout
    replace: bool = False


class LensDocument(Document):
    """The lens of a fovea by views of a board.

    For information: no calibration uses it. `reason`: which parameters the views determine, or why there is
    no fit.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    board: BoardDocument
    camera: Literal["left", "right"]
    coverage_fraction: float
    fit: LensFitDocument | None
    reason: str
    samples: list[WideSampleDocument]
    tilts_covered: int


class MadeReference(Document):
    """A finished reference: its request, its figures, its files.

    `samples`: with depth by the rig's own baseline; `referenced`: of those, with a reference. `outliers`:
    share of matches that contradicted the rest. `baseline_m`: median of the longest baselines.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    across: int
    baseline_m: float
    bracket: int
    comparison: ReferenceComparison
    made_utc: str
    matches: int
    noise_factor: float
    outliers: float
    png_url: str
    points: int
    rail_sigma_m: float
    referenced: int
    residual_px: float
    samples: int
    samples_url: str
    scan: int
    short_baseline_m: float
    stops: list[FoundStop]
    svg_url: str


class MeasurementDocument(Document):
    """One measurement; of `length`, `plane` and `profile` only that of its kind is set.

    `drawn_px`: its points, ends or corners in each view that can show them; a view other than the wide one
    draws them while it shows a look of `fixation_ids`, a raw fovea while the mirrors are at `gaze`.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    created_utc: str
    drawn_px: dict[Literal["wide", "left", "right", "anaglyph", "difference", "depth"], list[DrawnPxItem]]
    fixation_ids: list[str]
    gaze: GazeDocument | None = None
    id: str
    kind: Literal["point", "length", "plane", "profile"]
    label: str
    length: LengthDocument | None = None
    plane: PlaneDocument | None = None
    points: list[MeasuredPointDocument]
    profile: ProfileDocument | None = None


class Readiness(Document):
    """Whether a fixation could start now; `start`: the steps of the rig's start while it opens, else null."""

    model_config = ConfigDict(
        extra="forbid",
    )
    problems: list[ReadyProblem]
    ready: bool
    start: StartDocument | None = None


class ReferenceDocument(Document):
    """The state of a capture's reference, or why none is possible. `stops`: known positions on the rail.

    `outdated`: points were added to the capture since.
    """

    model_config = ConfigDict(
        extra="forbid",
    )
    brackets: list[int]
    capture_id: str
    job_id: str | None
    made: MadeReference | None
    name: str
    outdated: bool
    progress: JobProgress | None
    refusal: Problem | None
    state: Literal["none", "building", "complete"]
    stops: list[ReferenceStop]
    url: str


class RigDocument(Document):
    """The whole rig."""

    model_config = ConfigDict(
        extra="forbid",
    )
    baseline_m: float | None
    binning: RigBinningDocument | None
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    cameras: list[CameraDocument]
    clock: ClockDocument
    divergence: list[DifferenceDocument]
    mirrors: MirrorsDocument
    name: str
    problems: list[DeviceProblemDocument]
    rig_id: str | None
    scene: str | None
    simulated: bool
    state: str
    steering: SteeringDocument | None
    trigger: TriggerDocument | None


class SessionDocument(Document):
    """The measurements of one calibration, and their results."""

    model_config = ConfigDict(
        extra="forbid",
    )
    board: BoardDocument | None
    bytes: int
    calibrations: list[str]
    check: CheckDocument | None
    closing: ClosingDocument | None = None
    created_utc: str
    fit: FitDocument | None
    id: str
    label: str
    lenses: list[LensDocument]
    pictures: list[PictureDocument]
    problems: list[str]
    rig_id: str
    running: str | None
    settle: SettleDocument | None
    sweeps: list[SweepDocument]
    wide: WideStageDocument | None
