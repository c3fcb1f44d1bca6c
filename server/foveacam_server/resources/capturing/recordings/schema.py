"""Schemas of recordings, of their frames, depth and films."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from foveacam_pipeline.capture.recording.bounds import DEFAULT_S, LONGEST_S, EndCause
from foveacam_server.datasets.archived import ArchivedDocument
from foveacam_server.foundation.quantities import Seconds, Text
from foveacam_server.foundation.schema import RequestModel, ResponseModel

RoleName = Literal["wide", "left", "right"]
Rate = Literal["full", "live"]
RecordingState = Literal["starting", "recording", "ending", "complete", "partial", "truncated", "damaged"]
FilmFormat = Literal[
    "h264", "hevc", "vp9", "av1", "prores", "prores_hq", "prores_4444", "mpeg4", "png", "npy"
]
Show = Literal["wide", "left", "right", "side-by-side", "anaglyph"]


class RecordingRequest(RequestModel):
    """The cameras to record, for how long, and the name."""

    name: Annotated[str, Field(max_length=1000)]
    """Name of the file: up to 100 letters, digits, spaces, dots, dashes and underscores."""
    roles: Annotated[list[RoleName], Field(min_length=1, max_length=3)] = Field(
        default=["wide", "left", "right"]
    )
    duration_s: Annotated[
        Annotated[float, Field(ge=0.1, le=LONGEST_S)] | None,
        Field(description=f"It ends by itself after so long, at the latest; null: after {DEFAULT_S:g} s."),
    ] = None
    rate: Rate = "full"
    """`full`: look after look, with the wide camera's frames between them; `live`: what live views show."""
    label: Text = ""
    numbered: bool = False
    """Whether to append the first free number of four digits to the name."""
    compress: bool = False
    """Compress each frame losslessly by zlib; may be too slow for the full rate."""
    packed: bool = False
    """Pack grey pixels of twelve bits: two pixels in three bytes."""


class NameDocument(ResponseModel):
    """The name that a recording would get. `free`: whether it can be recorded now, else `why` not."""

    name: str
    free: bool
    why: str


class RecordingPatch(RequestModel):
    """Fields of a recording to change."""

    label: Text


class StreamCounts(ResponseModel):
    """The recorder's counts of one stream; None where an older recorder did not count."""

    model_config = ConfigDict(extra="ignore")

    published: int | None = None
    written: int | None = None
    dropped: int | None = None
    missing: int | None = None
    losses: dict[str, int] = Field(default={})
    fps: float = 0.0
    bytes: int | None = None


class RecordedStreamDocument(ResponseModel):
    """One camera of a recording. `published` = `written` + `dropped` + `waiting`; None where not counted.

    `frames`: those in the file. `losses`: dropped frames by reason. `bytes`: of its frames and their poses.
    `missing`: frames between the published ones that were not read or never came, not part of `published`.
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
    """Loss of a recording that was cut off: bytes after its last complete record, and the reason."""

    at_byte: int
    lost_bytes: int
    lost: str
    reason: str


class StreamFacts(ResponseModel):
    """One stream of a file; `packed`, `compressed`: how its frames are stored."""

    role: RoleName | None
    frames: int
    fps: float
    width: int
    height: int
    pixel_format: str
    bits: int
    packed: bool
    compressed: bool


class RigFacts(ResponseModel):
    """The rig named in a file."""

    rig_id: str
    name: str
    baseline_m: float
    calibration_id: str | None
    calibration_problem: str | None


class RecordingContents(ResponseModel):
    """Description of a recording's file; `slots`: names of the tracked boxes."""

    file: str
    bytes: int
    recorded: str | None
    app: str | None
    duration_s: float
    finalized: bool
    truncated: TruncationDocument | None
    rig: RigFacts | None
    slots: list[str]
    streams: dict[str, StreamFacts]


class RecordedFile(ResponseModel):
    """The file that `foveacam record` wrote; `why`: what ended it early."""

    file: str
    ended: EndCause
    why: str
    bytes: int
    streams: dict[str, StreamCounts]


class RecordingDocument(ResponseModel):
    """One recording. `why`: what ended it early. `playable`: whether it has frames to show.

    `ended`: the cause of its end; null in progress, and when unknown. In progress, `left_s`: time until it
    ends by itself; `room_bytes`: free space on the disk beyond the reserve, `room_s`: how long that lasts at
    its rate. `truncated`: what was cut off; the rest was recovered by scanning the file and is complete.
    """

    id: str
    name: str
    file: str
    label: str
    created_utc: str | None
    state: RecordingState
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
    archived: ArchivedDocument | None
    url: str


class TimelineStream(ResponseModel):
    """Times of one camera's exposures, seconds from the recording's begin, ascending."""

    role: RoleName
    name: str
    fps: float
    width: int
    height: int
    t_s: list[float]


class TrackDocument(ResponseModel):
    """One channel of a recording over time, seconds from its begin.

    `runs`: first and last message of each run; between two runs there is no message. `drops`: messages before
    and after an interval in a run that lacks some, and how many by the period; none for a stream without a
    period, or one that is complete by the recorder's counts.
    """

    name: str
    kind: Literal["frames", "telemetry", "boxes"]
    role: RoleName | None
    count: int
    period_s: float | None
    runs: list[tuple[float, float]]
    drops: list[tuple[float, float, int]]


class TracksDocument(ResponseModel):
    """All channels of a recording over time, from its index alone."""

    duration_s: float
    recorded: str | None
    tracks: list[TrackDocument]


class TimelineDocument(ResponseModel):
    """Times of all exposures of a recording. `calibrated`: whether depth can be computed from its poses."""

    duration_s: float
    calibrated: bool
    streams: list[TimelineStream]


class RecordedFrameDocument(ResponseModel):
    """One frame and the pose of its exposure; None where the recording has none.

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


class RecordedBox(ResponseModel):
    """The box of a followed target in the wide picture; `late_ms`: latency of its detection."""

    slot: str
    x_px: float
    y_px: float
    width_px: float
    height_px: float
    late_ms: float


class MomentDocument(ResponseModel):
    """The frames of all cameras nearest to a time.

    `meeting_m`: distance at which the gazes cross, if any; `meeting_z_m`: its depth; `meeting_px`: its place
    in the wide picture. `boxes`: of the targets that were followed.
    """

    t_s: float
    frames: dict[RoleName, RecordedFrameDocument]
    meeting_m: float | None
    meeting_z_m: float | None
    meeting_px: tuple[float, float] | None
    boxes: list[RecordedBox]


class RecordedDepthDocument(ResponseModel):
    """Depth along the rig's z at the centre of the left fovea; None where too little could be matched.

    `verged_z_m`: depth at which the gazes cross. `known`: share of pixels with depth. `apart_ms`: time
    between the eyes' exposures. `backend`: the estimator; `network_sha256`: of its graph, None of a built-in.
    `looks`: number of fused looks.
    """

    t_s: float
    z_m: float | None
    sigma_m: float | None
    verged_z_m: float | None
    known: float
    apart_ms: float
    backend: str
    network_sha256: str | None
    looks: int
    picture_url: str


class FormatDocument(ResponseModel):
    """A format of exports; `available`: whether this machine can write it, else `why` not."""

    name: str
    title: str
    suffix: str
    available: bool
    why: str


class FilmRequest(RequestModel):
    """Request of an export: one camera, or both foveae side by side or as an anaglyph; whole or a part.

    `format`: `png` gives a ZIP of pictures with their times, `npy` an array of one camera's pixels at full
    depth. `fps`: resampled in time; null: every frame, at the recorded rate. `undistorted`: for the wide
    camera only.
    """

    show: Show = "wide"
    format: FilmFormat = "h264"
    undistorted: bool = False
    fps: Annotated[float, Field(ge=0.1, le=240.0)] | None = None
    start_s: Seconds = 0.0
    end_s: Seconds | None = None


class FilmOrder(FilmRequest):
    """A film's request as stored with its job."""

    recording_id: str


class FilmFacts(ResponseModel):
    """The film that `foveacam recording export` made."""

    file: str
    shows: str
    codec: str
    fps: float
    frames: int
    width: int
    height: int
    bytes: int


class FilmDocument(ResponseModel):
    """A finished film."""

    name: str
    recording_id: str
    size_bytes: int
    url: str


class RecordingChange(ResponseModel):
    """Data of an event about a recording."""

    recording_id: str


class RecordingEnded(RecordingChange):
    """Data of the event that a recording has ended; `why`: what ended it early."""

    name: str
    ended: EndCause
    why: str
