"""Schemas of fixations, targets and corrections."""

from typing import Annotated, Any, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import DistanceM, Index, Label, Metres, Pixels
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.rig.schema import Direction
from foveacam_server.rig.stream_messages import FrameSeq

Basis = Literal["both_foveae", "fovea_and_wide", "surroundings", "bound"]
"""Basis of a distance: left against right; one fovea against the wide camera; inferred from measured
neighbours; unknown, with limits only."""
RangeSide = Literal["nearer", "farther"]
"""On which side of the corrected answer the true distance lies."""


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
    """Request of a fixation: exactly one of pixel, rectangle and direction."""

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
    """Sequence number, from the views' WebSocket, of the wide picture on which the target was chosen: a
    moving target is tracked from there. Works for pictures of the last 0.6 s; an older number has no
    effect."""


class FixationOrder(FixationRequest):
    """A request as stored with its job; `target_id`: the target that is looked at again."""

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
    """One of several distances that a target may have.

    The probabilities of all add up to 1, or to less where it may have none of them.
    """

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
    request: dict[str, Any]  # Any: JSON of the order, without unset fields
    target: TargetPlace
    state: Literal["verged", "no_texture", "lost", "out_of_range", "timed_out"]
    reason: str
    distance_m: float | None
    distance_sigma_m: float | None
    distance_sigma_random_m: float | None = None
    """The part of `distance_sigma_m` that differs from look to look; null where it is not known."""
    point_rig_m: tuple[float, float, float] | None
    basis: Basis | None = None
    bound: BoundDocument | None = None
    alternatives: list[AlternativeDocument] = Field(default=[])
    chosen_alternative: int | None = None
    """Index of the alternative that the operator chose, counted from 0."""
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
        """The request of the fixation."""
        return FixationOrder.model_validate(self.request)

    @property
    def answer(self) -> "FixationDocument":
        """The fixation, with the chosen alternative as its distance."""
        if self.chosen_alternative is None:
            return self
        chosen = self.alternatives[self.chosen_alternative]
        return self.model_copy(
            update=chosen.model_dump(exclude={"probability"}) | {"distance_sigma_random_m": None}
        )


class FixationEstimate(ResponseModel):
    """An estimate of a fixation's distance; the last one is the answer.

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
    distance_sigma_random_m: float | None = None
    """The part of `distance_sigma_m` that differs from look to look; null where it is not known."""
    point_rig_m: tuple[float, float, float] | None = None
    bound: BoundDocument | None = None


class CorrectionDocument(ResponseModel):
    """A correction of an answer by the operator.

    `fixation_id`: the fixation that it started; for a choice, the fixation whose alternative was chosen.
    """

    kind: Literal["choice", "nearer", "farther", "rectangle", "click"]
    created_utc: str
    fixation_id: str
    alternative: int | None = None
    """Index of the chosen alternative, counted from 0."""


class TargetDocument(ResponseModel):
    """A stored point that was fixated; distance and point are null where only limits are known."""

    id: str
    label: str
    fixation_id: str
    distance_m: float | None
    distance_sigma_m: float | None
    distance_sigma_random_m: float | None = None
    """The part of `distance_sigma_m` that differs from look to look; null where it is not known."""
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
    """Index of the fixation's alternative that is the true one, counted from 0."""

    alternative: Index


class CorrectionRequest(RequestModel):
    """On which side of the present answer the true distance lies."""

    direction: RangeSide


class FixationStep(ResponseModel):
    """Data of the event of one step."""

    fixation_id: str
    job_id: str
    step: StepDocument


class FixationSelectedEvent(ResponseModel):
    """A fixation whose drawing was clicked in the 3D pane."""

    fixation_id: str
