"""The shapes of requests and answers.

Requests are strict: a string is no number, NaN is none, unknown keys are refused.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from foveacam_server.quantities import Degrees, DistanceM, Metres, Pixels

Label = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A name for people: no control characters."""

FrameSeq = Annotated[int, Field(ge=0, le=0xFFFF_FFFF)]
"""Number of a picture as it goes over the views' WebSocket."""


class RequestModel(BaseModel):
    """Root of what is sent to the server."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class ResponseModel(BaseModel):
    """Root of what the server answers, and of the data of its events."""

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
    """Distances from the rig's origin that an answer may have; no `farthest_m`: any beyond the nearest."""

    nearest_m: Metres
    farthest_m: DistanceM | None = None


class FixationRequest(RequestModel):
    """Exactly one of pixel, rectangle and direction."""

    pixel: Pixel | None = None
    rectangle: Rectangle | None = None
    direction: Direction | None = None
    label: Label | None = None
    depth: bool = True
    """Whether depth, cloud and mesh are worked out afterwards."""
    within: DistanceLimits | None = None
    """Which distances the answer may have."""
    corrects: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """Id of a fixation whose answer this one corrects: its target takes the new answer."""
    frame_seq: FrameSeq | None = None
    """Number of the wide picture on which the target was chosen, as the views' WebSocket gives it: a target
    that moves is followed from there. Pictures of the last 0.6 s are known; an older number has no effect."""


class SteerRequest(RequestModel):
    """Where both eyes shall look; without a distance they look parallel."""

    direction: Direction
    distance_m: DistanceM | None = None


class LeaseRequest(RequestModel):
    """Who asks for the lease."""

    holder: Label
    take_over: bool = False


class TargetPatch(RequestModel):
    """What may be changed of a target."""

    label: Label


class JobProgress(ResponseModel):
    """How far a job is: `done` of `total`."""

    done: int
    total: int
    eta_s: float | None
    note: str


class JobDocument(ResponseModel):
    """One piece of long work."""

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
    """Where a fixation was aimed: direction and wide pixel."""

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
    """What one fovea shows at the end of a fixation; `reason` says why it does not see the target."""

    sees_target: bool
    reason: str


class FixationDocument(ResponseModel):
    """The answer to one target.

    `state` is how the closed loop of both foveae ended, `basis` how the distance is known, which may be by
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
    """What the operator corrected of an answer, and when.

    `fixation_id`: the fixation that was ordered by it; of a choice, the one whose alternative was chosen.
    """

    kind: Literal["choice", "nearer", "farther", "rectangle", "click"]
    created_utc: str
    fixation_id: str
    alternative: int | None = None
    """Which alternative was chosen, counted from 0."""


class TargetDocument(ResponseModel):
    """A point that was looked at and kept; distance and point are null where only limits are known."""

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
    """The shape around one fixation; the files' axes are in server/README.md."""

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
    """What ordinary fixations say of the calibration in force; medians over the recent ones."""

    score: float | None
    verdict: Literal["good", "recalibrate", "unknown"]
    fixations: int
    vertical_px: float | None
    horizontal_px: float | None
    rows_px: float | None
    """How far apart in height the two eyes look."""
    detail: str


class CalibrationDocument(ResponseModel):
    """A calibration, and how far to trust it."""

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
    """Whether it is one of one's own: what ships with the program cannot be discarded."""
    parent_id: str | None
    """What it was corrected from."""
    session_id: str | None
    """The session that measured it."""
    health: HealthDocument | None
    """Known of the one in force alone."""


class EventDocument(ResponseModel):
    """One line of the event log."""

    id: int
    kind: str
    level: Literal["info", "warning", "error"]
    t_utc: str
    message: str
    data: dict[str, Any]  # Any: depends on the kind


class LeaseGrant(ResponseModel):
    """What the holder of the lease gets; the token goes into the X-Lease header."""

    token: str
    holder: str
    expires_in_s: float


class LeaseDocument(ResponseModel):
    """Who holds the control lease; null: nobody, and anybody may move."""

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
