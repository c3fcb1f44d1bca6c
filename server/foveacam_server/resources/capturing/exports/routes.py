"""Routes of a capture's exports: make one as a job, list them, download and remove one."""

from fastapi.responses import JSONResponse
from starlette.concurrency import run_in_threadpool

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.datasets.capture_id import CaptureId
from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.http.answers import (
    LONG_READ,
    IdempotencyHeader,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.capturing.exports.schema import (
    DatasetExport,
    DatasetExportRequest,
    DatasetExports,
)
from foveacam_server.resources.capturing.exports.service import ExportService

router = GuardedRouter(
    "/captures/{capture_id}/exports", tags=["exports"], reading=Right.VIEW, changing=Right.OPERATE
)


@router.post(
    "",
    status_code=202,
    summary="Export a capture",
    response_model=JobDocument,
    responses={
        200: {"model": DatasetExport, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504, 507),
    },
)
async def make(
    capture_id: CaptureId,
    request: DatasetExportRequest,
    exports: Provided[ExportService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue an export as a job without the rig; refuse an impossible one, and one that might not fit.

    Where the same export of the unchanged dataset exists, the job ends at once with it.
    """
    job = await run_in_threadpool(exports.start, capture_id, request, idempotency_key=idempotency_key)
    return await job_answer(
        jobs, job, prefer=prefer, result=lambda _: exports.get_one(capture_id, request.kind)
    )


@router.get("", summary="A capture's exports", responses=problems(404))
def every(capture_id: CaptureId, exports: Provided[ExportService]) -> DatasetExports:
    """Return for each format the finished export, the progress of its job, or why none is possible."""
    return exports.get(capture_id)


@router.get(
    "/{kind}.zip",
    summary="Download an export",
    response_class=StoredFile,
    responses=stored_file_responses("application/zip"),
    dependencies=[LONG_READ],
)
def download(capture_id: CaptureId, kind: ExportFormat, exports: Provided[ExportService]) -> StoredFile:
    """Send a finished export as one ZIP file, also by ranges."""
    path = exports.require(capture_id, kind).path
    headers = {"Cache-Control": "no-cache"}
    return StoredFile(path, media_type="application/zip", filename=path.name, headers=headers)


@router.get("/{kind}", summary="One of a capture's exports", responses=problems(404))
def one(capture_id: CaptureId, kind: ExportFormat, exports: Provided[ExportService]) -> DatasetExport:
    """Return the export to one format, the progress of its job, or why none is possible."""
    return exports.get_one(capture_id, kind)


@router.delete("/{kind}", status_code=204, summary="Remove a capture's export", responses=problems(404, 409))
def remove(capture_id: CaptureId, kind: ExportFormat, exports: Provided[ExportService]) -> None:
    """Remove one export; the capture and its other exports stay."""
    exports.remove(capture_id, kind)
