"""The shapes of requests and answers about recordings."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_pipeline.capture.recording.bounds import DEFAULT_S, LONGEST_S, EndCause
from foveacam_pipeline.stereo.estimator import DepthBackend
from foveacam_server.api.capture_models import Text
from foveacam_server.api.models import RequestModel, ResponseModel
from foveacam_server.quantities import Seconds

RoleName = Literal["wide", "left", "right"]
Rate = Literal["full", "live"]
Show = Literal["wide", "left", "right", "side-by-side", "anaglyph"]


class RecordingRequest(RequestModel):
    """What is to be recorded, and under which name."""

    name: Annotated[str, Field(max_length=1000)]
    """Becomes a file: up to 100 letters, digits, spaces, dots, dashes and underscores."""
    roles: Annotated[list[RoleName], Field(min_length=1, max_length=3)] = Field(
        default=["wide", "left", "right"]
    )
    duration_s: Annotated[
        Annotated[float, Field(ge=0.1, le=LONGEST_S)] | None,
        Field(description=f"It ends by itself after so long, at the latest; null: after {DEFAULT_S:g} s."),
    ] = None
    rate: Rate = "full"
    """Look after look with the wide camera's frames between them, or what live views show."""
    label: Text = ""


class RecordingPatch(RequestModel):
    """What may be changed of a recording."""

    label: Text


class RecordedStreamDocument(ResponseModel):
    """One camera of a recording. `published` = `written` + `dropped` + `waiting`; None where nobody counted.

    `frames`: those on the file. `losses`: dropped frames by reason. `bytes`: of its frames and their poses.
    `missing`: numbers between the published frames that nobody read or that never came, beside `published`.
    """

    name: str
    role: RoleName | None
    frames: int
    fps: float
    width: int | None
    height: int | None
    pixel_format: str | None
    bits: int | None
    published: int | None
    written: int | None
    dropped: int | None
    missing: int | None
    waiting: int
    losses: dict[str, int]
    bytes: int | None


class TruncationDocument(ResponseModel):
    """A recording that was cut off: how much was lost after its last whole record, and why."""

    at_byte: int
    lost_bytes: int
    lost: str
    reason: str


class RecordingDocument(ResponseModel):
    """One recording. `why`: what ended one before its time. `playable`: whether it has frames to show.

    `ended`: what ended it; null while it is made, and where nobody wrote it down. While it is made, `left_s`:
    until it ends by itself; `room_bytes`: what the disk has for it beyond what is kept free, `room_s`: how
    long that lasts at its rate.

    `truncated`: what was cut off; the rest is found by reading the file through, and is as good as any.
    """

    id: str
    name: str
    file: str
    label: str
    created_utc: str | None
    state: Literal["starting", "recording", "ending", "complete", "partial", "truncated", "damaged"]
    ended: EndCause | None
    why: str
    removed: bool
    duration_s: float
    asked_s: float | None
    left_s: float | None
    room_s: float | None
    room_bytes: int | None
    size_bytes: int
    rig_id: str | None
    calibration_id: str | None
    calibration_problem: str | None
    truncated: TruncationDocument | None
    streams: list[RecordedStreamDocument]
    playable: bool
    job_id: str | None
    url: str


class TimelineStream(ResponseModel):
    """When one camera was exposed, seconds from the recording's begin, ascending."""

    role: RoleName
    name: str
    fps: float
    width: int
    height: int
    t_s: list[float]


class TimelineDocument(ResponseModel):
    """When every frame of a recording was exposed. `calibrated`: whether its poses can become depth."""

    duration_s: float
    calibrated: bool
    streams: list[TimelineStream]


class RecordedFrameDocument(ResponseModel):
    """One frame and the pose of its exposure; None where the recording does not tell.

    `footprint_px`: the corners of a fovea in the wide picture, clockwise from the top left of its image.
    """

    stream: str
    index: int
    t_s: float
    exposure_ms: float | None
    x_v: float | None
    y_v: float | None
    volts_source: str | None
    ax_deg: float | None
    ay_deg: float | None
    footprint_px: list[tuple[float, float]] | None
    jpeg_url: str


class MomentDocument(ResponseModel):
    """The frames of all cameras nearest to a moment. `meeting_m`: how far away the gazes meet, if they do."""

    t_s: float
    frames: dict[RoleName, RecordedFrameDocument]
    meeting_m: float | None


class RecordedDepthDocument(ResponseModel):
    """Depth along the rig's z at the centre of the left fovea; None where too little could be matched.

    `verged_z_m`: where the gazes cross. `known`: share of pixels with depth. `apart_ms`: between the eyes'
    exposures. `backend`: what estimated it. `looks`: how many were fused.
    """

    t_s: float
    z_m: float | None
    sigma_m: float | None
    verged_z_m: float | None
    known: float
    apart_ms: float
    backend: DepthBackend
    looks: int
    picture_url: str


class FilmRequest(RequestModel):
    """A film (MP4) of one camera, of both foveae side by side or as an anaglyph, or of a part of it."""

    show: Show = "wide"
    fps: Annotated[float, Field(ge=0.1, le=240.0)] | None = None
    start_s: Seconds = 0.0
    end_s: Seconds | None = None


class FilmDocument(ResponseModel):
    """A film that was made."""

    name: str
    recording_id: str
    size_bytes: int
    url: str
