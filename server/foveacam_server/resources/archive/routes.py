"""Routes of the archive: send a capture or a recording there, fetch it."""

import asyncio
from typing import Annotated, Protocol

from fastapi import APIRouter, Depends, Path
from fastapi.responses import JSONResponse

from foveacam_server.datasets.capture_id import CaptureId
from foveacam_server.foundation.answers import (
    IdempotencyHeader,
    PreferHeader,
    job_answer,
    opened_services,
    problems,
)
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.archive.schema import ArchiveDocument, ArchiveRequest
from foveacam_server.resources.archive.service import ArchiveService
from foveacam_server.resources.captures.schema import CaptureDocument
from foveacam_server.resources.recordings.schema import RecordingDocument

router = APIRouter(tags=["archive"])


class ArchiveRouteServices(Protocol):
    """Services that these routes use."""

    archive: ArchiveService
    jobs: JobRunner


ServicesDep = Annotated[ArchiveRouteServices, Depends(opened_services)]
RecordingId = Annotated[str, Path(max_length=100)]
_PROBLEMS = problems(404, 409, 502, 503, 504)
_CAPTURE = {200: {"model": CaptureDocument, "description": "ended in time"}, **_PROBLEMS}
_RECORDING = {200: {"model": RecordingDocument, "description": "ended in time"}, **_PROBLEMS}


@router.get("/archive", summary="The archive of this server")
def archive(services: ServicesDep) -> ArchiveDocument:
    """Return where captures and recordings are archived."""
    return services.archive.describe()


@router.post(
    "/captures/{capture_id}/archive",
    status_code=202,
    summary="Send a capture to the archive",
    response_model=JobDocument,
    responses=_CAPTURE,
)
async def archive_capture(
    capture_id: CaptureId,
    request: ArchiveRequest,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue the upload as a job; what the archive has already is not sent again."""
    held = services.archive
    job = await asyncio.to_thread(
        held.archive, "captures", capture_id, request, idempotency_key=idempotency_key
    )
    return await job_answer(services, job, prefer=prefer, result=held.result("captures"))


@router.post(
    "/captures/{capture_id}/fetch",
    status_code=202,
    summary="Fetch a capture from the archive",
    response_model=JobDocument,
    responses=_CAPTURE,
)
async def fetch_capture(
    capture_id: CaptureId,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue the download of the files that are not on this machine, as a job."""
    held = services.archive
    job = await asyncio.to_thread(held.fetch, "captures", capture_id, idempotency_key=idempotency_key)
    return await job_answer(services, job, prefer=prefer, result=held.result("captures"))


@router.post(
    "/recordings/{recording_id}/archive",
    status_code=202,
    summary="Send a recording to the archive",
    response_model=JobDocument,
    responses=_RECORDING,
)
async def archive_recording(
    recording_id: RecordingId,
    request: ArchiveRequest,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue the upload as a job; what the archive has already is not sent again."""
    held = services.archive
    job = await asyncio.to_thread(
        held.archive, "recordings", recording_id, request, idempotency_key=idempotency_key
    )
    return await job_answer(services, job, prefer=prefer, result=held.result("recordings"))


@router.post(
    "/recordings/{recording_id}/fetch",
    status_code=202,
    summary="Fetch a recording from the archive",
    response_model=JobDocument,
    responses=_RECORDING,
)
async def fetch_recording(
    recording_id: RecordingId,
    services: ServicesDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue the download of its file, as a job."""
    held = services.archive
    job = await asyncio.to_thread(held.fetch, "recordings", recording_id, idempotency_key=idempotency_key)
    return await job_answer(services, job, prefer=prefer, result=held.result("recordings"))
