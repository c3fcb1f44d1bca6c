"""Schemas of followed targets."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Label, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.looking.fixations.schema import Pixel, Rectangle
from foveacam_server.rig.schema import Direction
from foveacam_server.rig.stream_messages import FrameSeq

FollowedState = Literal["finding", "followed", "lost", "out_of_field"]
"""`finding`: first verged on; `followed`: seen in the last looks; `lost`: searched for; `out_of_field`:
beyond the mirrors' range."""
TrackerName = Literal["template", "filter"]
"""Image tracker of the wide view: correlation with a template, or a kernelised correlation filter."""
Priority = Annotated[float, Field(ge=0.1, le=10.0, allow_inf_nan=False)]
"""Weight of a target's share of the looks relative to the other targets'."""
BoxSide = Annotated[int, Field(ge=16, le=400)]
"""Side of the image tracker's template, wide px."""


class FollowRequest(RequestModel):
    """Request to follow a target: exactly one of pixel, rectangle, direction and target_id."""

    pixel: Pixel | None = None
    rectangle: Rectangle | None = None
    """The image tracker takes its content as template."""
    direction: Direction | None = None
    target_id: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """Id of a target of an earlier fixation, which is searched for at its last place."""
    label: Label | None = None
    tracker: TrackerName = "template"
    priority: Priority = 1.0
    box_px: BoxSide = 64
    """Side of the tracker's box about a point; no effect for a rectangle."""
    frame_seq: FrameSeq | None = None
    """Sequence number of the wide picture on which the target was chosen, as in a fixation; without it the
    newest."""


class FollowPatch(RequestModel):
    """Changes of a followed target; fields left out stay."""

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
    """Its wide pixel."""
    point_rig_m: tuple[float, float, float] | None = None
    velocity_rig_m_s: tuple[float, float, float] | None = None
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    speed_m_s: float | None = None
    looks: int = 0
    hits: int = 0
    """Number of looks in which it was found."""
    rate_hz: float = 0.0
    """Hits per second over the last two seconds."""
    age_s: float | None = None
    """Time since the last hit."""
    score: float | None = None
    """Correlation of the weaker fovea with the target's picture in the last hit, -1 to 1."""
    wide_score: float | None = None
    """Score of the image tracker; null while it does not find the target."""


class FollowRoundRequest(RequestModel):
    """One look at each followed target, kept as a dataset."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    label: Text = ""


class FollowRoundTaken(ResponseModel):
    """Data of the event that a round of followed targets was captured."""

    capture_id: str
    name: str
    targets: int


class TrailPoint(ResponseModel):
    """One hit: the place of a followed target at a time."""

    t_s: float
    """Time on the rig's clock, s."""
    x_m: float
    y_m: float
    z_m: float
    distance_sigma_m: float


class FollowEnded(ResponseModel):
    """Data of the event that following a target has ended."""

    id: str
    label: str
    reason: str


class FollowChanged(ResponseModel):
    """Data of an event about a followed target's state."""

    id: str
    label: str
    state: FollowedState
    distance_m: float | None
