"""Schemas of the vergence loop."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Degrees, DistanceM, Pixels
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.looking.fixations.schema import Pixel
from foveacam_server.rig.schema import Direction
from foveacam_server.rig.stream_messages import FrameSeq

LoopAxisName = Literal["pan_x", "pan_y", "verge", "shift_y"]
LoopTrackerName = Literal["off", "template", "filter"]
"""Image tracker of the wide view; off: the target stays where it was chosen."""
LoopStatusName = Literal[
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
"""State of the loop. `split`: each eye follows a separate point; `waiting`: another job has the rig."""
EyeName = Literal["left", "right"]
LoopSettingsGroup = Literal["pan", "depth", "vertical", "match", "timing", "tracker", "prediction"]
Share = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Expansion = Annotated[float, Field(ge=1.0, le=4.0, allow_inf_nan=False)]
Gain = Annotated[float, Field(ge=0.0, le=2.0, allow_inf_nan=False)]
BoxSidePx = Annotated[int, Field(ge=16, le=400)]
Candidates = Annotated[int, Field(ge=8, le=200)]


class LoopGains(RequestModel):
    """Gains of one loop: kp without unit, ki per unit of loop time, kd in units of loop time."""

    kp: Gain
    ki: Gain
    kd: Gain


class LoopSettingsPatch(RequestModel):
    """Settings to change; fields left out stay."""

    sensitivity: Annotated[float, Field(ge=0.01, le=1.0, allow_inf_nan=False)] | None = None
    """Loop time per ms."""
    template_scale: Share | None = None
    """Scale of the search for the foveae in the wide view: 0 the view's own, 1 four times that."""
    min_score: Share | None = None
    """Correlation below which, in either eye, the loop does not correct."""
    correct_for_ms: Annotated[float, Field(ge=0.0, le=10_000.0, allow_inf_nan=False)] | None = None
    """Time after the choice of a target in which the loop corrects; 0: never; null: always."""
    expand_x: Expansion | None = None
    expand_y: Expansion | None = None
    """Width and height of the searched strip, in fields of view of a fovea."""
    pan: LoopGains | None = None
    depth: LoopGains | None = None
    vertical: LoopGains | None = None
    tracker: LoopTrackerName | None = None
    box_width_px: BoxSidePx | None = None
    box_height_px: BoxSidePx | None = None
    """Width and height of the tracker's template, wide px."""
    predict: bool | None = None
    """Whether to aim at the position of a tracked target predicted for mid-exposure."""
    lead_ms: Annotated[float, Field(ge=-50.0, le=50.0, allow_inf_nan=False)] | None = None
    """Added to the prediction time, to compensate an unmeasured delay."""
    most_hz: Annotated[float, Field(ge=0.5, le=1000.0, allow_inf_nan=False)] | None = None
    """Maximum rate of looks; null: as fast as the rig."""


class LoopSettingsDocument(ResponseModel):
    """All settings of the loop, as in `LoopSettingsPatch`."""

    sensitivity: float
    template_scale: float
    min_score: float
    correct_for_ms: float | None
    expand_x: float
    expand_y: float
    pan: LoopGains
    depth: LoopGains
    vertical: LoopGains
    tracker: LoopTrackerName
    box_width_px: int
    box_height_px: int
    predict: bool
    lead_ms: float
    most_hz: float | None


class LoopTargetRequest(RequestModel):
    """Where to look: exactly one of pixel and direction."""

    pixel: Pixel | None = None
    direction: Direction | None = None
    distance_m: DistanceM | None = None
    """Initial distance; without it a fixation searches for the target first."""
    frame_seq: FrameSeq | None = None
    """Sequence number of the wide picture on which the target was chosen, as in a fixation; without it the
    newest."""


class LoopPatch(RequestModel):
    """Pause, hold single axes, or set their commands; setting a command holds its axis from then on."""

    paused: bool | None = None
    held: dict[LoopAxisName, bool] | None = None
    command_deg: dict[LoopAxisName, Degrees] | None = None


class LoopDrag(RequestModel):
    """Pixel of the wide view at which both eyes point in parallel during a drag."""

    x_px: Pixels
    y_px: Pixels


class LoopEyePlace(RequestModel):
    """The point of one fovea's picture that the loop keeps centred, fovea px."""

    x_px: Pixels
    y_px: Pixels


class LoopTuneRequest(RequestModel):
    """How to tune: by relays alone, or polished by CMA-ES afterwards."""

    polish: bool = False
    candidates: Candidates = 48


class LoopAxisDocument(ResponseModel):
    """One axis: its command and range, and its error in the last look that measured it, degrees."""

    axis: LoopAxisName
    command_deg: float
    error_deg: float | None
    least_deg: float
    most_deg: float
    held: bool


class LoopTargetDocument(ResponseModel):
    """Place and tracking state of the target, wide px."""

    x_px: float
    y_px: float
    state: Literal["fixed", "tracked", "lost"]
    tracker_score: float | None


class LoopEyeDocument(ResponseModel):
    """One eye that follows a separate point, fovea px; null where the point is not found."""

    eye: EyeName
    state: Literal["still", "tracking", "lost"]
    x_px: float | None
    y_px: float | None
    score: float | None


class LoopTriggerDocument(ResponseModel):
    """Exposures and trigger of the loop; one pulse exposes both foveae."""

    exposures: int
    failures: int
    in_a_row: int
    """Number of consecutive equal failures."""
    latched: bool
    """Whether the loop waits until the trigger is reset."""
    reason: str | None
    pair_skew_us: float
    """Time of the left exposure minus that of the right one."""
    after_trigger_us: float | None
    """Delay from the trigger pulse to the start of the exposure."""
    wide_age_ms: float | None
    """Delay of the wide frame's exposure after the foveae's."""


class LoopRelayDocument(ResponseModel):
    """Result of the relay test of one axis; `period_looks`: period of its oscillation."""

    axis: LoopAxisName
    amplitude_deg: float
    swing_deg: float
    period_looks: float
    ultimate_gain: float


class LoopStepDocument(ResponseModel):
    """Step response of one axis; a settling time is null where it did not settle."""

    axis: LoopAxisName
    settle_before_ms: float | None
    settle_ms: float | None
    overshoot_before: float
    overshoot: float


class LoopTuneDocument(ResponseModel):
    """The last tuning: its gains, the relay tests and step responses, and the costs before and after."""

    tuned_utc: str
    settings: LoopSettingsDocument
    relays: list[LoopRelayDocument]
    steps: list[LoopStepDocument]
    cost_before: float
    cost_relay: float
    cost: float
    candidates: int
    picture_url: str


class LoopDocument(ResponseModel):
    """Present state of the loop; unknown values are null."""

    running: bool
    job_id: str | None
    tune_job_id: str | None
    """The job that tunes now."""
    status: LoopStatusName
    detail: str
    """Remedy for the status; empty if none is needed."""
    paused: bool
    dragged: bool
    looks: int
    rate_hz: float
    lead_ms: float | None
    """Measured latency from the request of a look to the middle of its exposure."""
    target: LoopTargetDocument | None
    axes: list[LoopAxisDocument]
    distance_m: float | None
    distance_sigma_m: float | None
    point_rig_m: tuple[float, float, float] | None
    fine: bool | None
    """Whether the foveae were matched against each other; false: each only against the wide strip."""
    score_left: float | None
    score_right: float | None
    eyes: list[LoopEyeDocument]
    """Both eyes while each follows a separate point; empty otherwise."""
    trigger: LoopTriggerDocument
    settings: LoopSettingsDocument
    tuned: LoopTuneDocument | None


class LoopSample(ResponseModel):
    """One look of the loop's history; angles in the order of the axes."""

    look: int
    t_s: float
    status: LoopStatusName
    command_deg: tuple[float, float, float, float]
    error_deg: tuple[float, float, float, float] | None
    distance_m: float | None
    distance_sigma_m: float | None
    score: float | None


class LoopStatusChanged(ResponseModel):
    """Data of the event that the loop began, changed its status, or ended; `detail`: the reason."""

    status: LoopStatusName
    detail: str


class LoopTuned(ResponseModel):
    """Data of the event that the loop was tuned."""

    cost_before: float
    cost: float
