"""Routes of recordings: make, list, change, download, films."""

from functools import partial
from typing import Annotated, Literal

from fastapi import Path, Query
from fastapi.responses import JSONResponse
from starlette.concurrency import run_in_threadpool

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.recording.formats import FORMATS
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument, TrashEmptied
from foveacam_server.resources.capturing.recordings.films import film_file, format_documents
from foveacam_server.resources.capturing.recordings.schema import (
    FilmDocument,
    FilmRequest,
    FormatDocument,
    NameDocument,
    RecordingDocument,
    RecordingPatch,
    RecordingRequest,
)
from foveacam_server.resources.capturing.recordings.service import RecordingService

router = GuardedRouter("/recordings", tags=["recordings"], reading=Right.VIEW, changing=Right.OPERATE)


RecordingId = Annotated[str, Path(max_length=100)]
MEDIA_TYPES = {found.suffix: found.media_type for found in FORMATS.values()}
_EXPORTS = stored_file_responses("video/mp4")
for _media_type in MEDIA_TYPES.values():
    _EXPORTS[200]["content"] |= file_responses(_media_type)[200]["content"]


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
    recordings: Provided[RecordingService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Begin a recording as a job.

    It does not move or reserve the rig: other work goes on, and is recorded.
    """
    job = await run_in_threadpool(recordings.start, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=recordings.get)


@router.get("", summary="Recordings, newest first")
def every(
    recordings: Provided[RecordingService],
    text: Annotated[str, Query(max_length=200, description="words of name, label, id or state")] = "",
    removed: Annotated[Literal["true", "false"], Query(description="those in the trash")] = "false",
) -> list[RecordingDocument]:
    """Return all recordings, or those that contain every word of `text`."""
    return recordings.search(text=text, removed=removed == "true")


@router.get("/name", summary="The name that a recording would get")
def name(
    recordings: Provided[RecordingService],
    wanted: Annotated[str, Query(alias="name", max_length=1000)] = "",
    numbered: Annotated[Literal["true", "false"], Query(description="with the next free number")] = "true",
) -> NameDocument:
    """Return the name with its number, and whether a recording of that name can be made now."""
    return recordings.name_of(wanted, numbered=numbered == "true")


@router.get("/formats", summary="Formats of exports")
def formats() -> list[FormatDocument]:
    """Return every format, and whether this machine can write it."""
    return format_documents()


@router.delete("/trash", summary="Empty the trash")
@needs(Right.ADMINISTER)
def empty_trash(recordings: Provided[RecordingService]) -> TrashEmptied:
    """Delete the recordings in the trash for good, with their films."""
    return TrashEmptied(deleted=recordings.collection.empty_trash())


@router.get("/{recording_id}", summary="One recording", responses=problems(404))
def one(recording_id: RecordingId, recordings: Provided[RecordingService]) -> RecordingDocument:
    """Return one recording; in progress, with its counts so far."""
    return recordings.get(recording_id)


@router.patch(
    "/{recording_id}",
    summary="Describe a recording",
    responses=problems(404, 502),
)
def patch(
    recording_id: RecordingId, change: RecordingPatch, recordings: Provided[RecordingService]
) -> RecordingDocument:
    """Change a recording's label."""
    return recordings.edit(recording_id, label=change.label)


@router.delete(
    "/{recording_id}",
    status_code=204,
    summary="Put a recording in the trash",
    responses=problems(404, 409, 502),
)
def remove(recording_id: RecordingId, recordings: Provided[RecordingService]) -> None:
    """Move a recording to the trash, from which it can be restored."""
    recordings.remove(recording_id)


@router.post(
    "/{recording_id}/restore",
    summary="Restore a recording from the trash",
    responses=problems(404, 502),
)
def restore(recording_id: RecordingId, recordings: Provided[RecordingService]) -> RecordingDocument:
    """Restore a recording from the trash."""
    return recordings.restore(recording_id)


@router.post(
    "/{recording_id}/stop",
    summary="End a recording",
    responses=problems(404),
)
def stop(recording_id: RecordingId, recordings: Provided[RecordingService]) -> RecordingDocument:
    """End a recording; returns when its file is complete. No effect on one that has ended."""
    return recordings.stop(recording_id)


@router.get(
    "/{recording_id}/download.fcap",
    summary="The recording's file",
    response_class=StoredFile,
    responses={**stored_file_responses("application/octet-stream"), **problems(409)},
)
def download(recording_id: RecordingId, recordings: Provided[RecordingService]) -> StoredFile:
    """Send the unchanged file, or the part that a Range header asks for."""
    path = recordings.readable(recording_id).path
    if not path.exists():
        found, remedy = "its bytes are in the archive alone", "fetch it first"
        raise Busy(f"download {path.name}: {found}", found=found, remedy=remedy)
    return StoredFile(path, media_type="application/octet-stream", filename=path.name)


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
    recordings: Provided[RecordingService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue a film as a job; an existing equal film is reused."""
    job = await run_in_threadpool(
        recordings.films.start, recording_id, request, idempotency_key=idempotency_key
    )
    return await job_answer(jobs, job, prefer=prefer, result=partial(recordings.films.get, recording_id))


@router.get(
    "/{recording_id}/films/{name}",
    summary="A film that was made",
    response_class=StoredFile,
    responses=_EXPORTS,
)
def film(
    recording_id: RecordingId,
    name: Annotated[str, Path(max_length=100)],
    recordings: Provided[RecordingService],
) -> StoredFile:
    """Send a film."""
    kept = recordings.readable(recording_id)
    path = film_file(recordings.collection, kept, name)
    return StoredFile(path, media_type=MEDIA_TYPES[path.suffix], filename=f"{kept.name} {name}")
