"""Routes of recordings: make, list, frames and depth of a moment, download, films."""

import asyncio
from pathlib import Path as FilePath
from typing import Annotated, Literal, Protocol

from fastapi import APIRouter, Depends, Path, Query
from fastapi.responses import FileResponse, JSONResponse, Response

from foveacam_hardware.contract import FoveaError, InvalidInput, Role, Sighting
from foveacam_pipeline.capture.recording.formats import FORMATS
from foveacam_pipeline.capture.recording.values import RecordedFrame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.estimator import DepthBackend
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_server.foundation.answers import (
    IdempotencyHeader,
    PreferHeader,
    file_responses,
    job_answer,
    opened_services,
    problems,
)
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.quantities import Seconds
from foveacam_server.foundation.schema import JobDocument, TrashEmptied
from foveacam_server.resources.recordings import moments
from foveacam_server.resources.recordings.documents import URL
from foveacam_server.resources.recordings.films import film_file, format_documents
from foveacam_server.resources.recordings.layout import read_layout, write_layout
from foveacam_server.resources.recordings.layout_schema import AnaglyphName, LayoutDocument, LayoutRequest
from foveacam_server.resources.recordings.schema import (
    FilmDocument,
    FilmRequest,
    FormatDocument,
    MomentDocument,
    NameDocument,
    RecordedDepthDocument,
    RecordingDocument,
    RecordingPatch,
    RecordingRequest,
    RoleName,
    TimelineDocument,
    TracksDocument,
)
from foveacam_server.resources.recordings.service import RecordingService
from foveacam_server.resources.recordings.tracks import tracks_document
from foveacam_server.rig.encoder import encode_jpeg

router = APIRouter(prefix="/recordings", tags=["recordings"])


class RecordingRouteServices(Protocol):
    """Services that these routes use."""

    recordings: RecordingService
    jobs: JobRunner


ServicesDep = Annotated[RecordingRouteServices, Depends(opened_services)]

RecordingId = Annotated[str, Path(max_length=100)]
Moment = Annotated[Seconds, Query(description="seconds from the recording's begin")]
ScaleQuery = Annotated[Literal["1", "2"], Query(description="full size, or half")]
BackendQuery = Annotated[
    DepthBackend, Query(description="sgbm: at full size; live: several times faster, coarser")
]
LooksQuery = Annotated[
    int, Query(ge=1, le=16, description="looks fused from this moment on, as long as the mirrors stand still")
]
StyleQuery = Annotated[AnaglyphName, Query(description="colours of the left and the right glass")]
QUALITY = 85
MEDIA_TYPES = {found.suffix: found.media_type for found in FORMATS.values()}
_EXPORTS = file_responses("video/mp4")
for _media_type in MEDIA_TYPES.values():
    _EXPORTS[200]["content"] |= file_responses(_media_type)[200]["content"]
_LASTING = {"Cache-Control": "private, max-age=3600"}
"""A recording never changes, so a page need not fetch its pictures again."""


@router.post(
    "",
    status_code=202,
    summary="Record what the cameras deliver",
    response_model=JobDocument,
    responses={
        200: {"model": RecordingDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def create(
    request: RecordingRequest,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Begin a recording as a job. It moves nothing and holds nothing: other work goes on, and is recorded."""
    job = await asyncio.to_thread(services.recordings.start, request, idempotency_key=idempotency_key)
    return await job_answer(services, job, prefer=prefer, result=services.recordings.get_by_url)


@router.get("", summary="Recordings, newest first")
def every(
    services: ServicesDep,
    text: Annotated[str, Query(max_length=200, description="words of name, label, id or state")] = "",
    removed: Annotated[Literal["true", "false"], Query(description="those in the trash")] = "false",
) -> list[RecordingDocument]:
    """Return all recordings, or those that hold every word of `text`."""
    return services.recordings.search(text=text, removed=removed == "true")


@router.get("/name", summary="The name that a recording would get")
def name(
    services: ServicesDep,
    wanted: Annotated[str, Query(alias="name", max_length=1000)] = "",
    numbered: Annotated[Literal["true", "false"], Query(description="with the next free number")] = "true",
) -> NameDocument:
    """Return the name with its number, and whether something can be recorded under it now."""
    return services.recordings.name_of(wanted, numbered=numbered == "true")


@router.get("/formats", summary="Formats of exports")
def formats() -> list[FormatDocument]:
    """Return every format, and whether this machine can write it."""
    return format_documents()


@router.delete("/trash", summary="Empty the trash")
def empty_trash(services: ServicesDep) -> TrashEmptied:
    """Delete for good what was removed, and the films made of it."""
    return TrashEmptied(deleted=services.recordings.collection.empty_trash())


@router.get("/{recording_id}", summary="One recording", responses=problems(404))
def one(recording_id: RecordingId, services: ServicesDep) -> RecordingDocument:
    """Return one recording; while it is being made, with its counts so far."""
    return services.recordings.get(recording_id)


@router.patch(
    "/{recording_id}",
    summary="Describe a recording",
    responses=problems(404, 502),
)
def patch(recording_id: RecordingId, change: RecordingPatch, services: ServicesDep) -> RecordingDocument:
    """Change its label."""
    return services.recordings.edit(recording_id, label=change.label)


@router.delete(
    "/{recording_id}",
    status_code=204,
    summary="Put a recording in the trash",
    responses=problems(404, 409, 502),
)
def remove(recording_id: RecordingId, services: ServicesDep) -> None:
    """Move it to the trash, from which it can be restored."""
    services.recordings.remove(recording_id)


@router.post(
    "/{recording_id}/restore",
    summary="Take a recording out of the trash",
    responses=problems(404, 502),
)
def restore(recording_id: RecordingId, services: ServicesDep) -> RecordingDocument:
    """Undo its removal."""
    return services.recordings.restore(recording_id)


@router.post(
    "/{recording_id}/stop",
    summary="End a recording",
    responses=problems(404),
)
def stop(recording_id: RecordingId, services: ServicesDep) -> RecordingDocument:
    """End it, and answer when its file is complete; one that has ended stays as it is."""
    return services.recordings.stop(recording_id)


@router.get(
    "/{recording_id}/download.fcap",
    summary="The recording's file",
    response_class=FileResponse,
    responses={**file_responses("application/octet-stream"), **problems(409)},
)
def download(recording_id: RecordingId, services: ServicesDep) -> FileResponse:
    """Send the file as it is, or the part that a Range header asks for."""
    path = services.recordings.readable(recording_id).path
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.get(
    "/{recording_id}/timeline",
    summary="When every frame was exposed",
    responses=problems(404, 409),
)
def timeline(recording_id: RecordingId, services: ServicesDep) -> TimelineDocument:
    """Return the moments of all frames, by camera."""
    with services.recordings.opened.reading(_path(services, recording_id)) as recording:
        return moments.timeline_document(recording)


@router.get(
    "/{recording_id}/tracks",
    summary="All channels over time, in short",
    responses=problems(404, 409),
)
def tracks(recording_id: RecordingId, services: ServicesDep) -> TracksDocument:
    """Return runs, gaps and drops of every channel, from the file's index alone."""
    streams = services.recordings.get(recording_id).streams
    whole = {stream.name for stream in streams if stream.dropped == 0 and stream.missing == 0}
    with services.recordings.opened.reading(_path(services, recording_id)) as recording:
        return tracks_document(recording, whole=whole)


@router.get(
    "/{recording_id}/layout",
    summary="How the player was arranged",
    responses=problems(404, 409),
)
def layout(recording_id: RecordingId, services: ServicesDep) -> LayoutDocument:
    """Return the arrangement that is kept beside the recording, or why it cannot be used."""
    return read_layout(services.recordings.readable(recording_id))


@router.put(
    "/{recording_id}/layout",
    summary="Keep how the player is arranged",
    responses=problems(404, 409, 502),
)
def keep_layout(recording_id: RecordingId, change: LayoutRequest, services: ServicesDep) -> LayoutDocument:
    """Keep it beside the recording. One that cannot be used is overwritten with `replace` alone."""
    return write_layout(services.recordings.readable(recording_id), change)


@router.get(
    "/{recording_id}/frames",
    summary="The frames of a moment, with their poses",
    responses=problems(404, 409),
)
def frames(
    recording_id: RecordingId,
    services: ServicesDep,
    t_s: Moment = 0.0,
    role: Annotated[RoleName | None, Query(description="of `index`, in the place of `t_s`")] = None,
    index: Annotated[
        str | None, Query(pattern=r"^-?\d{1,9}$", description="number of a frame; -1 is the last")
    ] = None,
) -> MomentDocument:
    """Return what all cameras saw nearest to a moment, or to a frame of one of them: poses and outlines."""
    if (role is None) != (index is None):
        raise InvalidInput("frames: role and index go together; give both, or t_s alone")
    with services.recordings.opened.reading(_path(services, recording_id)) as recording:
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
    services: ServicesDep,
    scale: ScaleQuery = "1",
) -> Response:
    """Return one frame of one camera."""
    with services.recordings.opened.reading(_path(services, recording_id)) as recording:
        found = recording.frame(moments.stream_of(recording, Role(role)).name, index)
    return _jpeg(encode_jpeg(found.image, scale=2 if scale == "2" else 1, bits=found.bits, quality=QUALITY))


@router.get(
    "/{recording_id}/anaglyph.jpg",
    summary="Both foveae of a moment in red and cyan",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def anaglyph(
    recording_id: RecordingId, services: ServicesDep, t_s: Moment = 0.0, style: StyleQuery = "red_cyan"
) -> Response:
    """Return both foveae over each other, rectified where poses and calibration were recorded."""
    pair, look = _pair(services, recording_id, t_s)
    return _jpeg(encode_jpeg(moments.anaglyph(pair, look, AnaglyphStyle(style)), quality=QUALITY))


@router.get(
    "/{recording_id}/difference.jpg",
    summary="The left fovea of a moment minus the right one",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def difference(recording_id: RecordingId, services: ServicesDep, t_s: Moment = 0.0) -> Response:
    """Return their difference about middle grey, rectified where poses and calibration were recorded."""
    return _jpeg(encode_jpeg(moments.difference(*_pair(services, recording_id, t_s)), quality=QUALITY))


@router.get("/{recording_id}/depth", summary="Depth of a moment, computed anew", responses=problems(404, 409))
def depth(
    recording_id: RecordingId,
    services: ServicesDep,
    t_s: Moment = 0.0,
    backend: BackendQuery = "sgbm",
    looks: LooksQuery = 1,
) -> RecordedDepthDocument:
    """Match both foveae by their recorded poses and calibration; refused where these are missing."""
    path = _path(services, recording_id)
    found = services.recordings.depth.at(path, t_s=t_s, backend=backend, looks=looks)
    with services.recordings.opened.reading(path) as recording:
        at_s = (found.t_ns - recording.span_ns[0]) / 1e9
    return RecordedDepthDocument(
        t_s=round(at_s, 6),
        z_m=_rounded(found.z_m),
        sigma_m=_rounded(found.sigma_m),
        verged_z_m=_rounded(found.verged_z_m),
        known=round(found.known, 4),
        apart_ms=round(found.apart_ms, 3),
        backend=backend,
        looks=found.looks,
        picture_url=f"{URL}/{recording_id}/depth.jpg?t_s={at_s:.6f}&backend={backend}&looks={looks}",
    )


@router.get(
    "/{recording_id}/depth.jpg",
    summary="Depth of a moment as a picture",
    response_class=Response,
    responses={**file_responses("image/jpeg"), **problems(409)},
)
def depth_picture(
    recording_id: RecordingId,
    services: ServicesDep,
    t_s: Moment = 0.0,
    backend: BackendQuery = "sgbm",
    looks: LooksQuery = 1,
) -> Response:
    """Return depth as colours, with a scale in metres."""
    path = _path(services, recording_id)
    found = services.recordings.depth.at(path, t_s=t_s, backend=backend, looks=looks)
    return _jpeg(found.picture)


@router.post(
    "/{recording_id}/films",
    status_code=202,
    summary="Make a film, or another export",
    response_model=JobDocument,
    responses={
        200: {"model": FilmDocument, "description": "made in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def make_film(
    recording_id: RecordingId,
    request: FilmRequest,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue a film as a job; the same one is not made twice."""
    recordings = services.recordings
    job = await asyncio.to_thread(
        recordings.films.start, recording_id, request, idempotency_key=idempotency_key
    )
    return await job_answer(services, job, prefer=prefer, result=recordings.films.get_by_url)


@router.get(
    "/{recording_id}/films/{name}",
    summary="A film that was made",
    response_class=FileResponse,
    responses=_EXPORTS,
)
def film(
    recording_id: RecordingId, name: Annotated[str, Path(max_length=100)], services: ServicesDep
) -> FileResponse:
    """Send a film."""
    recordings = services.recordings
    kept = recordings.readable(recording_id)
    path = film_file(recordings.collection, kept, name)
    return FileResponse(path, media_type=MEDIA_TYPES[path.suffix], filename=f"{kept.name} {name}")


def _path(services: RecordingRouteServices, recording_id: str) -> FilePath:
    return services.recordings.readable(recording_id).path


def _pair(
    services: RecordingRouteServices, recording_id: str, t_s: float
) -> tuple[tuple[RecordedFrame, RecordedFrame], tuple[Sighting, Calibration] | None]:
    """Return both foveae of a moment, and as an observation where they can be rectified."""
    with services.recordings.opened.reading(_path(services, recording_id)) as recording:
        pair = moments.pair_at(recording, t_s)
        try:
            return pair, moments.observation_of(recording, pair)
        except FoveaError:
            return pair, None


def _jpeg(content: bytes) -> Response:
    return Response(content, media_type="image/jpeg", headers=_LASTING)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 5)
