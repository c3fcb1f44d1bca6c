"""Routes of batches: products of several captures at once, as a job, and as one ZIP file."""

from typing import Annotated

from fastapi import Path
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.concurrency import run_in_threadpool

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.datasets.download import zip_stream
from foveacam_server.foundation.http.answers import (
    LONG_READ,
    IdempotencyHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.capturing.batches.schema import (
    BatchClusterDocument,
    BatchDocument,
    BatchRequest,
)
from foveacam_server.resources.capturing.batches.service import BatchService

router = GuardedRouter("/batches", tags=["batches"], reading=Right.VIEW, changing=Right.OPERATE)


BatchId = Annotated[str, Path(pattern=r"^(depth|mosaic|export|evaluate)-[0-9a-f]{12}$")]


@router.post(
    "",
    status_code=202,
    summary="Make products of several captures",
    response_model=JobDocument,
    responses={
        200: {"model": BatchDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def make(
    request: BatchRequest,
    batches: Provided[BatchService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue a batch, or the rest of an equal one, as a job that leaves the rig free."""
    job = await run_in_threadpool(batches.start, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=batches.get)


@router.get("", summary="All batches")
def every(batches: Provided[BatchService]) -> list[BatchDocument]:
    """Return all batches, by id."""
    return batches.every()


@router.get("/cluster", summary="The cluster for batches")
async def cluster(batches: Provided[BatchService]) -> BatchClusterDocument:
    """Return the scheduler's address from the server's settings."""
    return BatchClusterDocument(url=batches.cluster)


@router.get("/{batch_id}", summary="One batch", responses=problems(404))
def one(batch_id: BatchId, batches: Provided[BatchService]) -> BatchDocument:
    """Return how many products are made, and which failed with the reason."""
    return batches.get(batch_id)


@router.delete("/{batch_id}", status_code=204, summary="Remove a batch", responses=problems(404, 409))
def remove(batch_id: BatchId, batches: Provided[BatchService]) -> None:
    """Remove a batch with its products; the captures stay."""
    batches.remove(batch_id)


@router.get(
    "/{batch_id}/overview.png",
    summary="A batch as one picture",
    response_class=StoredFile,
    responses=stored_file_responses("image/png"),
)
def overview(batch_id: BatchId, batches: Provided[BatchService]) -> StoredFile:
    """Return a thumbnail for each capture, or the figures of an evaluation as bars."""
    path = batches.picture(batch_id)
    return StoredFile(path, media_type="image/png", headers={"Cache-Control": "no-cache"})


@router.get(
    "/{batch_id}/download.zip",
    summary="The products as one ZIP file",
    response_class=StreamingResponse,
    responses=file_responses("application/zip") | problems(409),
    dependencies=[LONG_READ],
)
def download(batch_id: BatchId, batches: Provided[BatchService]) -> StreamingResponse:
    """Send the folder of the batch with unchanged files."""
    headers = {"Content-Disposition": f'attachment; filename="{batch_id}.zip"'}
    stream = zip_stream(batches.folder(batch_id))
    return StreamingResponse(stream, media_type="application/zip", headers=headers)
