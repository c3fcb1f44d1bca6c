"""Schemas of fixations, targets and corrections."""

from typing import Annotated, Any, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import DistanceM, Index, Label, Metres, Pixels
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.rig.schema import Direction
from foveacam_server.rig.stream_messages import FrameSeq

Basis = Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"]
"""How a distance is known: left against right; one fovea against the wide camera; inferred from measured
neighbours; not at all, only limits of it."""
RangeSide = Literal["nearer", "farther"]
"""Where the target is in truth, seen from the answer that is corrected."""


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


class FixationOrder(FixationRequest):
    """A request as it is stored, with its origin; `target_id`: the target that is looked at again."""

    label: str | None = None
    source: str | None = None
    correction: RangeSide | None = None
    target_id: str | None = None

    def as_json(self) -> dict[str, Any]:  # Any: a JSON object
        """Return it as a JSON object; fields that were never set are left out."""
        return self.model_dump(mode="json", exclude_unset=True)


class TargetPatch(RequestModel):
    """Fields of a target to change."""

    label: Label


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
    request: dict[str, Any]  # Any: JSON of the order, without what was not set
    target: TargetPlace
    state: Literal["verged", "no_texture", "lost", "out_of_range", "timed_out"]
    reason: str
    distance_m: float | None
    distance_sigma_m: float | None
    point_rig_m: tuple[float, float, float] | None
    basis: Basis | None = None
    bound: BoundDocument | None = None
    alternatives: list[AlternativeDocument] = Field(default=[])
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

    @property
    def order(self) -> FixationOrder:
        """What was asked for."""
        return FixationOrder.model_validate(self.request)

    @property
    def answer(self) -> "FixationDocument":
        """The fixation with the alternative that the operator chose as its distance."""
        if self.chosen_alternative is None:
            return self
        chosen = self.alternatives[self.chosen_alternative]
        return self.model_copy(update=chosen.model_dump(exclude={"probability"}))


class FixationEstimate(ResponseModel):
    """What is known of a fixation's distance so far; the last one is the answer.

    `step`: looks until then, 0 before the first. `elapsed_ms`: since the fixation was asked for. Basis,
    distance and limits are null while nothing is known.
    """

    fixation_id: str
    job_id: str
    step: int
    elapsed_ms: float
    basis: Basis | None = None
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    point_rig_m: tuple[float, float, float] | None = None
    bound: BoundDocument | None = None


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
    alternatives: list[AlternativeDocument] = Field(default=[])
    left_view: EyeViewDocument | None = None
    right_view: EyeViewDocument | None = None
    corrections: list[CorrectionDocument] = Field(default=[])
    """Oldest first."""
    ax_deg: float
    ay_deg: float
    x_px: float
    y_px: float
    cloud_id: str | None
    created_utc: str


class ChoiceRequest(RequestModel):
    """Which alternative of the fixation is the true one, counted from 0."""

    alternative: Index


class CorrectionRequest(RequestModel):
    """Where the target is in truth, seen from the present answer."""

    direction: RangeSide


class FixationStep(ResponseModel):
    """Data of the event of one step."""

    fixation_id: str
    job_id: str
    step: StepDocument


class FixationSelectedEvent(ResponseModel):
    """A fixation whose drawing was clicked in the 3D pane."""

    fixation_id: str
