"""Schemas that several routes and services share.

Requests are strict: a string is no number, NaN is refused, unknown keys are refused.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from foveacam_server.quantities import Degrees, DistanceM, Metres, Pixels
from foveacam_server.runtime.stream_messages import U32

Label = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A name for people: no control characters."""

FrameSeq = Annotated[int, Field(ge=0, le=U32)]
"""Number of a picture as it goes over the views' WebSocket."""


class RequestModel(BaseModel):
    """Base class of requests."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class ResponseModel(BaseModel):
    """Base class of answers and of the data of events."""

    model_config = ConfigDict(extra="forbid")

    def as_json(self) -> dict[str, Any]:  # Any: a JSON object
        """Return it as a JSON object; fields that were never set are left out."""
        return self.model_dump(mode="json", exclude_unset=True)


class Problem(BaseModel):
    """An error (RFC 9457); `asked`, `found` and `remedy` are there when known."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None = None
    asked: str | None = None
    found: str | None = None
    remedy: str | None = None


class Pixel(RequestModel):
    """A point of the wide image, px; the centre of the first pixel is (0, 0)."""

    x_px: Pixels
    y_px: Pixels


class Rectangle(RequestModel):
    """A rectangle of the wide image, px."""

    x_px: Pixels
    y_px: Pixels
    width_px: Pixels
    height_px: Pixels


class Direction(RequestModel):
    """Axis-wise angles in the rig frame: tan ax = X/Z, tan ay = Y/Z; +x right, +y down."""

    ax_deg: Degrees
    ay_deg: Degrees


class DistanceLimits(RequestModel):
    """Limits of an answer's distance from the rig's origin; no `farthest_m`: no upper limit."""

    nearest_m: Metres
    farthest_m: DistanceM | None = None


class FixationRequest(RequestModel):
    """Exactly one of pixel, rectangle and direction."""

    pixel: Pixel | None = None
    rectangle: Rectangle | None = None
    direction: Direction | None = None
    label: Label | None = None
    depth: bool = True
    """Whether depth, cloud and mesh are computed afterwards."""
    within: DistanceLimits | None = None
    """Limits of the answer's distance."""
    corrects: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """Id of a fixation whose answer this one corrects: its target gets the new answer."""
    frame_seq: FrameSeq | None = None
    """Number of the wide picture on which the target was chosen, as the views' WebSocket gives it: a target
    that moves is followed from there. Pictures of the last 0.6 s are known; an older number has no effect."""


class SteerRequest(RequestModel):
    """Direction in which both eyes shall look; without a distance they look parallel."""

    direction: Direction
    distance_m: DistanceM | None = None


class LeaseRequest(RequestModel):
    """Name of the client that asks for the lease."""

    holder: Label
    take_over: bool = False


class TargetPatch(RequestModel):
    """Fields of a target to change."""

    label: Label


class JobProgress(ResponseModel):
    """Progress of a job: `done` of `total`."""

    done: int
    total: int
    eta_s: float | None
    note: str


class JobDocument(ResponseModel):
    """A job: long work that a request started."""

    id: str
    kind: str
    state: Literal["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]
    created_utc: str
    started_utc: str | None
    ended_utc: str | None
    progress: JobProgress
    result_url: str | None
    problem: Problem | None


class TargetPlace(ResponseModel):
    """Direction and wide pixel of a fixation's target."""

    ax_deg: float
    ay_deg: float
    x_px: float
    y_px: float


class StepDocument(ResponseModel):
    """One look of the vergence loop."""

    index: int
    phase: str
    left_ax_deg: float
    left_ay_deg: float
    right_ax_deg: float
    right_ay_deg: float
    residual_x_px: float | None
    residual_y_px: float | None
    score: float | None
    compute_ms: float | None


Basis = Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"]
"""How a distance is known: left against right; one fovea against the wide camera; inferred from measured
neighbours; not at all, only limits of it."""


class BoundDocument(ResponseModel):
    """Limits of a distance; `farthest_m` is null when there is none."""

    nearest_m: float
    farthest_m: float | None


class AlternativeDocument(ResponseModel):
    """One of several distances that a target may have; the probabilities of all add up to 1."""

    basis: Basis
    distance_m: float
    distance_sigma_m: float
    point_rig_m: tuple[float, float, float]
    probability: float


class EyeViewDocument(ResponseModel):
    """Whether a fovea sees the target at the end of a fixation; `reason`: why it does not."""

    sees_target: bool
    reason: str


class FixationDocument(ResponseModel):
    """The result of a fixation.

    `state`: how the vergence loop of both foveae ended; `basis`: how the distance is known, which may be by
    other means. Distance and point are null where `basis` is `bound` or null.
    """

    id: str
    job_id: str
    created_utc: str
    request: dict[str, Any]  # Any: as it was posted
    target: TargetPlace
    state: Literal["verged", "no_texture", "lost", "out_of_range", "timed_out"]
    reason: str
    distance_m: float | None
    distance_sigma_m: float | None
    point_rig_m: tuple[float, float, float] | None
    basis: Basis | None = None
    bound: BoundDocument | None = None
    alternatives: list[AlternativeDocument] = []
    chosen_alternative: int | None = None
    """Which of the alternatives the operator chose, counted from 0."""
    left_view: EyeViewDocument | None = None
    right_view: EyeViewDocument | None = None
    residual_px: float | None
    score: float | None
    duration_ms: float | None
    steps: list[StepDocument]
    calibration_id: str
    target_id: str | None
    cloud_id: str | None


class CorrectionDocument(ResponseModel):
    """A correction of an answer by the operator.

    `fixation_id`: the fixation that it ordered; of a choice, the one whose alternative was chosen.
    """

    kind: Literal["choice", "nearer", "farther", "rectangle", "click"]
    created_utc: str
    fixation_id: str
    alternative: int | None = None
    """Which alternative was chosen, counted from 0."""


class TargetDocument(ResponseModel):
    """A stored point that was fixated; distance and point are null where only limits are known."""

    id: str
    label: str
    fixation_id: str
    distance_m: float | None
    distance_sigma_m: float | None
    point_rig_m: tuple[float, float, float] | None
    basis: Basis = "both_foveae"
    bound: BoundDocument | None = None
    alternatives: list[AlternativeDocument] = []
    left_view: EyeViewDocument | None = None
    right_view: EyeViewDocument | None = None
    corrections: list[CorrectionDocument] = []
    """Oldest first."""
    ax_deg: float
    ay_deg: float
    x_px: float
    y_px: float
    cloud_id: str | None
    created_utc: str


class CloudDocument(ResponseModel):
    """The point cloud of a fixation; the files' axes are in server/README.md."""

    id: str
    fixation_id: str
    created_utc: str
    points: int
    centre_rig_m: tuple[float, float, float]
    z_min_m: float
    z_max_m: float
    sigma_median_m: float
    ply_url: str
    glb_url: str | None
    depth_url: str


class DepthDocument(ResponseModel):
    """Depth at one wide pixel."""

    x_px: float
    y_px: float
    distance_m: float
    distance_sigma_m: float
    point_rig_m: tuple[float, float, float]
    fixation_id: str
    age_s: float


class WideLensDocument(ResponseModel):
    """The calibrated wide lens, for turning pixels into directions: OpenCV's k1 k2 p1 p2 k3."""

    width: int
    height: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: list[float]


class HealthDocument(ResponseModel):
    """Errors of the calibration in force, as medians over recent ordinary fixations."""

    score: float | None
    verdict: Literal["good", "recalibrate", "unknown"]
    fixations: int
    vertical_px: float | None
    horizontal_px: float | None
    rows_px: float | None
    """Vertical difference between the directions of the two eyes."""
    detail: str


class CalibrationDocument(ResponseModel):
    """A calibration and its standard errors."""

    id: str
    label: str
    origin: str
    rig_id: str
    created_utc: str
    age_s: float
    baseline_m: float
    mirror_sigma_deg: float
    rectify_sigma_px: float | None
    wide: WideLensDocument
    current: bool
    """Whether it is in force."""
    kept: bool
    """Whether it is the user's own: those that ship with the program cannot be discarded."""
    parent_id: str | None
    """Id of the calibration that it corrects."""
    session_id: str | None
    """Id of the session that measured it."""
    health: HealthDocument | None
    """Only of the one in force."""


class EventDocument(ResponseModel):
    """An event."""

    id: int
    kind: str
    level: Literal["info", "warning", "error"]
    t_utc: str
    message: str
    data: dict[str, Any]  # Any: depends on the kind


class LeaseGrant(ResponseModel):
    """The granted lease; its token goes into the X-Lease header."""

    token: str
    holder: str
    expires_in_s: float


class LeaseDocument(ResponseModel):
    """The holder of the control lease; null: nobody, and anybody may move."""

    holder: str | None
    expires_in_s: float | None


class StopDocument(ResponseModel):
    """Whether the stop is engaged."""

    engaged: bool
    since_utc: str | None
    by: str | None


class StopAnswer(ResponseModel):
    """The stop is engaged; `parked` tells whether the mirrors' controller confirmed, after `parked_in_ms`."""

    engaged: bool
    parked: bool
    parked_in_ms: float
