"""Schemas of calibration sessions, of the results of their steps, and of the data of their events."""

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.wide.dictionary_names import DictionaryName
from foveacam_server.foundation.quantities import Label
from foveacam_server.foundation.schema import RequestModel, ResponseModel

Eye = Literal["left", "right"]
EyeState = Literal["centred", "rim", "refused", "waiting"]
FitFigures = dict[str, Any]  # Any: values of a fit by name, shown by the page; they differ between versions


def eye_of(role: Role) -> Eye:
    """Return the name of the eye of a fovea camera."""
    return "left" if role is Role.LEFT else "right"


class SessionRequest(RequestModel):
    """A new session."""

    label: Label


class CombineRequest(RequestModel):
    """Sessions of one rig whose sweeps are to be fitted jointly. `label`: None: the number of poses."""

    sessions: Annotated[list[str], Field(min_length=2, max_length=50)]
    label: Label | None = None


class BoardDocument(ResponseModel):
    """The calibration board of stage 1: inner corners, sides in mm, and how a ChArUco board is drawn."""

    kind: Literal["charuco", "checkerboard"]
    columns: int
    rows: int
    square_mm: float
    marker_mm: float | None
    dictionary: DictionaryName = "4X4_50"
    legacy_pattern: bool = False


class WideSampleDocument(ResponseModel):
    """One view of the board."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    id: str
    thumbnail_url: str = Field(default_factory=str)  # the session's file holds none
    rms_px: float | None
    tilt_deg: float | None
    centre_px: tuple[float, float]
    corners: int


class WideFitDocument(ResponseModel):
    """A lens fitted to the samples; `accuracy_deg`: standard error of a pixel's angle over the image.

    `known_fraction`: share of the image whose pixels have a direction, and can be clicked: not where the
    lens model folds back or is not known well enough.
    """

    model: str
    rms_px: float
    fov_x_deg: float
    fov_y_deg: float
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: list[float]
    accuracy_deg: float | None
    known_fraction: float = 1.0


class LensParameterDocument(ResponseModel):
    """A parameter of a lens with its standard error; `assumed`: the views do not determine it."""

    name: str
    value: float
    sigma: float
    assumed: bool


class LensFitDocument(WideFitDocument):
    """A telephoto lens fitted to the samples."""

    parameters: list[LensParameterDocument]


class LensDocument(ResponseModel):
    """The lens of a fovea by views of a board.

    For information: no calibration uses it. `reason`: which parameters the views determine, or why there is
    no fit.
    """

    camera: Eye
    board: BoardDocument
    samples: list[WideSampleDocument]
    coverage_fraction: float
    tilts_covered: int
    fit: LensFitDocument | None
    reason: str


class WideStageDocument(ResponseModel):
    """Present result of stage 1."""

    samples: list[WideSampleDocument]
    coverage_fraction: float
    cells: list[list[int]] | None = None
    """Number of views with a corner of the board in each part of the picture, row by row."""
    tilts_covered: int
    fit: WideFitDocument | None
    other_model: WideFitDocument | None
    reason: str
    """Why this model was chosen, or why there is no fit."""


class SweepPoseDocument(ResponseModel):
    """One pose of a sweep, and the state of either eye."""

    index: int
    ax_deg: float
    ay_deg: float
    left: EyeState
    right: EyeState
    left_reason: str | None
    right_reason: str | None


class SweepDocument(ResponseModel):
    """Stage 2 at one station: `done` of `nodes` poses."""

    station: str
    distance_m: float | None
    nodes: int
    done: int
    poses: list[SweepPoseDocument]


class ModelScoreDocument(ResponseModel):
    """Leave-one-out error of a mirror model."""

    name: str
    order: int | None
    eye: Eye
    loo_deg: tuple[float, float]
    chosen: bool


class FieldScoreDocument(ResponseModel):
    """Leave-one-out error of a rectification."""

    name: str
    order: int
    eye: Eye
    loo_px: float
    chosen: bool


class MountDriftDocument(ResponseModel):
    """Drift of an eye's mount during the calibration; lengths in fovea px."""

    px_per_minute: float
    moved_px: float
    """Largest distance of the gaze from its last position."""
    sigma_px: float
    minutes: float
    pieces: int
    """Number of line segments of the drift."""
    visits: int
    """Measurements that repeat a node."""
    knocks_px: tuple[float, ...] = ()
    """Jumps of the gaze when the mount was knocked during a sweep; they were corrected."""


class FitDocument(ResponseModel):
    """The last fit, and the models that were compared."""

    calibration_id: str
    models: list[ModelScoreDocument]
    fields: list[FieldScoreDocument]
    volts_roundtrip_max_lsb: float
    """Largest round-trip error volts -> angles -> volts over the calibrated field, steps of the DAC."""
    paper: FitFigures | None
    """The paper's model of the same data."""
    parallax: FitFigures | None
    """The parallax of Eq. 1, by station."""
    drift: dict[str, MountDriftDocument] | None = None
    """Corrected drift of each eye's mount; null when no nodes were visited again."""


class SettleAxisDocument(ResponseModel):
    """Settling of one axis of one mirror."""

    eye: Eye
    axis: Literal["x", "y"]
    settle_ms: float | None
    settle_1pct_ms: float | None
    response_ms: float | None = None
    """Time from the command until half of the step is done."""
    response_open_ms: float | None = None
    """The same with the drive filter wide open."""
    resonance_hz: float | None
    quality: float | None


class SettleDocument(ResponseModel):
    """The settle characterisation.

    `settle_us`: the time that the largest move takes on every axis. `applied`: whether it is in use.
    """

    axes: list[SettleAxisDocument]
    settle_us: int | None = None
    applied: bool = False


class CheckDocument(ResponseModel):
    """Errors of the fitted calibration at poses that no sweep visited."""

    calibration_id: str
    epipolar_rms_px: float | None
    epipolar_p95_px: float | None
    pointing_rms_px: float | None
    """Includes the measurement's own error, `pointing_sigma_px`."""
    pointing_sigma_px: float | None
    poses: int


class ClosingEyeDocument(ResponseModel):
    """Drift of an eye between its sweep and the check."""

    eye: Eye
    shift_deg: tuple[float, float]
    roll_deg: float
    moved_px: float
    sigma_px: float


class ClosingDocument(ResponseModel):
    """The drift since the sweep, by nodes visited again, and whether it was corrected before the check.

    `rows_px`: vertical difference between the eyes that the drift caused.
    """

    calibration_id: str
    corrected: bool
    places: int
    eyes: list[ClosingEyeDocument]
    rows_px: float
    detail: str


class PictureDocument(ResponseModel):
    """A picture of a step's result."""

    name: str
    title: str
    url: str


class SessionDocument(ResponseModel):
    """The measurements of one calibration, and their results."""

    id: str
    label: str
    rig_id: str
    created_utc: str
    bytes: int
    board: BoardDocument | None
    wide: WideStageDocument | None
    lenses: list[LensDocument]
    """Lenses of the foveae, as far as views were taken."""
    sweeps: list[SweepDocument]
    fit: FitDocument | None
    closing: ClosingDocument | None = None
    settle: SettleDocument | None
    check: CheckDocument | None
    pictures: list[PictureDocument]
    calibrations: list[str]
    running: str | None
    problems: list[str]
    """Files of the session that cannot be read, and why."""


class StepProgress(ResponseModel):
    """Data of `calibration.progress`: `done` of `total` of a step."""

    session_id: str | None
    step: str
    done: int
    total: int
    note: str


class WideSampleTaken(ResponseModel):
    """Data of `calibration.sample`: a new view of the board."""

    session_id: str | None
    id: str


class SweepPoseMeasured(ResponseModel):
    """Data of `calibration.pose`: a new pose of a sweep."""

    session_id: str | None
    station: str
    index: int
    left: EyeState
    right: EyeState


class CalibrationFitted(ResponseModel):
    """Data of `calibration.fitted`: a new calibration."""

    session_id: str | None
    calibration_id: str
