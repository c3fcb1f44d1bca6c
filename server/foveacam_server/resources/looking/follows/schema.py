"""Schemas of followed targets."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Label, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.looking.fixations.schema import Pixel, Rectangle
from foveacam_server.rig.schema import Direction
from foveacam_server.rig.stream_messages import FrameSeq

FollowedState = Literal["finding", "followed", "lost", "out_of_field"]
"""Being verged on first; seen in the last looks; searched for; where the mirrors cannot turn."""
TrackerName = Literal["template", "filter"]
"""Image tracker of the wide view: correlation with the target's picture, or a filter that learns."""
Priority = Annotated[float, Field(ge=0.1, le=10.0, allow_inf_nan=False)]
"""Share of the looks against that of the other targets."""
BoxSide = Annotated[int, Field(ge=16, le=400)]
"""Side of what the image tracker learns, wide px."""


class FollowRequest(RequestModel):
    """Exactly one of pixel, rectangle, direction and target_id."""

    pixel: Pixel | None = None
    rectangle: Rectangle | None = None
    """The image tracker learns what is in it."""
    direction: Direction | None = None
    target_id: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """A target of an earlier fixation: it is looked for where it was."""
    label: Label | None = None
    tracker: TrackerName = "template"
    priority: Priority = 1.0
    box_px: BoxSide = 64
    """Side of the box about a point; a rectangle has its own."""
    frame_seq: FrameSeq | None = None
    """Number of the wide picture on which the target was chosen, as in a fixation; else it is the newest."""


class FollowPatch(RequestModel):
    """What to change of a followed target."""

    label: Label | None = None
    tracker: TrackerName | None = None
    priority: Priority | None = None


class FollowedDocument(ResponseModel):
    """A followed target as it is now; what is not known yet is null."""

    id: str
    label: str
    state: FollowedState
    tracker: TrackerName
    priority: float
    created_utc: str
    x_px: float | None = None
    y_px: float | None = None
    """Where the wide view shows it, px."""
    point_rig_m: tuple[float, float, float] | None = None
    velocity_rig_m_s: tuple[float, float, float] | None = None
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    speed_m_s: float | None = None
    looks: int = 0
    hits: int = 0
    """Looks that showed it."""
    rate_hz: float = 0.0
    """Hits a second over the last two seconds."""
    age_s: float | None = None
    """Time since the last hit."""
    score: float | None = None
    """Correlation of the weaker fovea with the target's picture in the last hit, -1 to 1."""
    wide_score: float | None = None
    """How well the image tracker fits; null while it does not find the target."""


class FollowRoundRequest(RequestModel):
    """One look at each followed target, kept as a dataset."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    label: Text = ""


class FollowRoundTaken(ResponseModel):
    """Data of the event that a round was captured."""

    capture_id: str
    name: str
    targets: int


class TrailPoint(ResponseModel):
    """Where a followed target was: one hit."""

    t_s: float
    """Time on the rig's clock, s."""
    x_m: float
    y_m: float
    z_m: float
    distance_sigma_m: float


class FollowEnded(ResponseModel):
    """Data of the event that a target is followed no more."""

    id: str
    label: str
    reason: str


class FollowChanged(ResponseModel):
    """Data of an event about a followed target's state."""

    id: str
    label: str
    state: FollowedState
    distance_m: float | None
