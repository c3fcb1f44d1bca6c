"""Routes of the player: a recording's times, arrangement, frames, stereo pictures and depth."""

from pathlib import Path as FilePath
from typing import Annotated, Literal

from fastapi import Depends, Path, Query
from fastapi.responses import Response

from foveacam_hardware.contract import FoveaError, InvalidInput, Role, Sighting
from foveacam_pipeline.capture.recording.observations import observation_of, stream_of
from foveacam_pipeline.capture.recording.values import RecordedFrame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import file_responses, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.quantities import Seconds
from foveacam_server.resources.capturing.recordings import moments
from foveacam_server.resources.capturing.recordings.depth import DepthOrder
from foveacam_server.resources.capturing.recordings.documents import URL, tracks_document
from foveacam_server.resources.capturing.recordings.layout import (
    AnaglyphName,
    LayoutDocument,
    LayoutRequest,
    read_layout,
    write_layout,
)
from foveacam_server.resources.capturing.recordings.routes import (
    RecordingId,
)
from foveacam_server.resources.capturing.recordings.schema import (
    MomentDocument,
    RecordedDepthDocument,
    RoleName,
    TimelineDocument,
    TracksDocument,
)
from foveacam_server.resources.capturing.recordings.service import RecordingService
from foveacam_server.rig.encoder import encode_jpeg

router = GuardedRouter("/recordings", tags=["recordings"], reading=Right.VIEW, changing=Right.OPERATE)

Moment = Annotated[Seconds, Query(description="seconds from the recording's begin")]
ScaleQuery = Annotated[Literal["1", "2"], Query(description="full size, or half")]
BackendQuery = Annotated[
    str,
    Query(
        max_length=40,
        pattern="^[a-z0-9][a-z0-9_-]*$",
        description="sgbm: at full size; live: several times faster, coarser; or a network by its name",
    ),
]
ResearchQuery = Annotated[bool, Query(description="confirms research, as the licence of some networks wants")]
LooksQuery = Annotated[
    int, Query(ge=1, le=16, description="looks fused from this moment on, as long as the mirrors stand still")
]


def _depth_order(
    backend: BackendQuery = "sgbm", looks: LooksQuery = 1, *, research_confirmed: ResearchQuery = False
) -> DepthOrder:
    return DepthOrder(backend=backend, research_confirmed=research_confirmed, looks=looks)


OrderDep = Annotated[DepthOrder, Depends(_depth_order)]
StyleQuery = Annotated[AnaglyphName, Query(description="colours of the left and the right glass")]
QUALITY = 85
_LASTING = {"Cache-Control": "private, max-age=3600"}
"""Cache header of a recording's pictures, which never change."""


@router.get(
    "/{recording_id}/timeline",
    summary="Exposure times of all frames",
    responses=problems(404, 409),
)
def timeline(recording_id: RecordingId, recordings: Provided[RecordingService]) -> TimelineDocument:
    """Return the exposure times of all frames, by camera."""
    with recordings.opened.reading(_path(recordings, recording_id)) as recording:
        return moments.timeline_document(recording)


@router.get(
    "/{recording_id}/tracks",
    summary="All channels over time, in short",
    responses=problems(404, 409),
)
def tracks(recording_id: RecordingId, recordings: Provided[RecordingService]) -> TracksDocument:
    """Return runs, gaps and drops of every channel, from the file's index alone."""
    streams = recordings.get(recording_id).streams
    whole = {stream.name for stream in streams if stream.dropped == 0 and stream.missing == 0}
    with recordings.opened.reading(_path(recordings, recording_id)) as recording:
        return tracks_document(recording, whole=whole)


@router.get(
    "/{recording_id}/layout",
    summary="Stored arrangement of the player",
    responses=problems(404, 409),
)
def layout(recording_id: RecordingId, recordings: Provided[RecordingService]) -> LayoutDocument:
    """Return the arrangement stored beside the recording, or why it cannot be used."""
    return read_layout(recordings.readable(recording_id))


@router.put(
    "/{recording_id}/layout",
    summary="Store the arrangement of the player",
    responses=problems(404, 409, 502),
)
def keep_layout(
    recording_id: RecordingId, change: LayoutRequest, recordings: Provided[RecordingService]
) -> LayoutDocument:
    """Store the arrangement beside the recording.

    One that cannot be used is overwritten only with `replace`.
    """
    return write_layout(recordings.readable(recording_id), change)


@router.get(
    "/{recording_id}/frames",
    summary="The frames of a moment, with their poses",
    responses=problems(404, 409),
)
def frames(
    recording_id: RecordingId,
    recordings: Provided[RecordingService],
    t_s: Moment = 0.0,
    role: Annotated[RoleName | None, Query(description="of `index`, in the place of `t_s`")] = None,
    index: Annotated[
        str | None, Query(pattern=r"^-?\d{1,9}$", description="number of a frame; -1 is the last")
    ] = None,
) -> MomentDocument:
    """Return all cameras' frames nearest to a time, or to a frame of one camera, with poses and outlines."""
    if (role is None) != (index is None):
        raise InvalidInput("frames: role and index go together; give both, or t_s alone")
    with recordings.opened.reading(_path(recordings, recording_id)) as recording:
        if role is not None and index is not None:
            t_s = moments.frame_time_s(recording, Role(role), int(index))
        return moments.moment_document(recording, recording_id, t_s=t_s)


@router.get(
    "/{recording_id}/frames/{role}/{index}.jpg",
    summary="One frame as JPEG",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def frame(
    recording_id: RecordingId,
    role: RoleName,
    index: Annotated[int, Path(ge=0, le=1_000_000_000)],
    recordings: Provided[RecordingService],
    scale: ScaleQuery = "1",
) -> Response:
    """Return one frame of one camera."""
    with recordings.opened.reading(_path(recordings, recording_id)) as recording:
        found = recording.frame(stream_of(recording, Role(role)).name, index)
    return _jpeg(
        encode_jpeg(found.image, reduction=2 if scale == "2" else 1, bits=found.bits, quality=QUALITY)
    )


@router.get(
    "/{recording_id}/anaglyph.jpg",
    summary="Both foveae of a moment in red and cyan",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def anaglyph(
    recording_id: RecordingId,
    recordings: Provided[RecordingService],
    t_s: Moment = 0.0,
    style: StyleQuery = "red_cyan",
) -> Response:
    """Return both foveae as an anaglyph, rectified where poses and calibration were recorded."""
    pair, look = _pair(recordings, recording_id, t_s)
    return _jpeg(encode_jpeg(moments.anaglyph(pair, look, AnaglyphStyle(style)), quality=QUALITY))


@router.get(
    "/{recording_id}/difference.jpg",
    summary="The left fovea of a moment minus the right one",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def difference(
    recording_id: RecordingId, recordings: Provided[RecordingService], t_s: Moment = 0.0
) -> Response:
    """Return left minus right about middle grey, rectified where poses and calibration were recorded."""
    return _jpeg(encode_jpeg(moments.difference(*_pair(recordings, recording_id, t_s)), quality=QUALITY))


@router.get("/{recording_id}/depth", summary="Depth of a moment, recomputed", responses=problems(404, 409))
def depth(
    recording_id: RecordingId,
    recordings: Provided[RecordingService],
    order: OrderDep,
    t_s: Moment = 0.0,
) -> RecordedDepthDocument:
    """Match both foveae by their recorded poses and calibration; refused where these are missing."""
    path = _path(recordings, recording_id)
    found = recordings.depth.at(path, t_s=t_s, order=order)
    with recordings.opened.reading(path) as recording:
        at_s = (found.t_ns - recording.span_ns[0]) / 1e9
    return RecordedDepthDocument(
        t_s=round(at_s, 6),
        z_m=_rounded(found.z_m),
        sigma_m=_rounded(found.sigma_m),
        verged_z_m=_rounded(found.verged_z_m),
        known=round(found.known, 4),
        apart_ms=round(found.apart_ms, 3),
        backend=order.backend,
        network_sha256=found.sha256,
        looks=found.looks,
        picture_url=f"{URL}/{recording_id}/depth.jpg?t_s={at_s:.6f}&backend={order.backend}&looks={order.looks}"
        + ("&research_confirmed=true" if order.research_confirmed else ""),
    )


@router.get(
    "/{recording_id}/depth.jpg",
    summary="Depth of a moment as a picture",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def depth_picture(
    recording_id: RecordingId,
    recordings: Provided[RecordingService],
    order: OrderDep,
    t_s: Moment = 0.0,
) -> Response:
    """Return depth as colours, with a scale in metres."""
    path = _path(recordings, recording_id)
    found = recordings.depth.at(path, t_s=t_s, order=order)
    return _jpeg(found.picture)


def _path(recordings: RecordingService, recording_id: str) -> FilePath:
    return recordings.readable(recording_id).path


def _pair(
    recordings: RecordingService, recording_id: str, t_s: float
) -> tuple[tuple[RecordedFrame, RecordedFrame], tuple[Sighting, Calibration] | None]:
    """Return both foveae's frames at a time, with an observation where they can be rectified."""
    with recordings.opened.reading(_path(recordings, recording_id)) as recording:
        pair = moments.pair_at(recording, t_s)
        try:
            return pair, observation_of(recording, pair)
        except FoveaError:
            return pair, None


def _jpeg(content: bytes) -> Response:
    return Response(content, media_type="image/jpeg", headers=_LASTING)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 5)
