"""Routes of a capture's reference, its depth over the rail's long baselines: compute it, figures, files."""

from typing import Literal, Protocol

from fastapi.responses import JSONResponse, Response
from starlette.concurrency import run_in_threadpool

from foveacam_pipeline.capture.dataset.reference_folder import REFERENCE_PICTURE, REFERENCE_SAMPLES
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.datasets.capture_id import CaptureId
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.capturing.references.schema import ReferenceDocument, ReferenceRequest
from foveacam_server.resources.capturing.references.service import ReferenceService, reference_file

router = GuardedRouter(
    "/captures/{capture_id}/reference", tags=["references"], reading=Right.VIEW, changing=Right.OPERATE
)


class StoredCaptures(Protocol):
    """Access of the routes to the stored captures."""

    def get(self, capture_id: str) -> StoredCapture:
        """Return one capture; raise `NotFound`."""
        ...


class CaptureSource(Protocol):
    """The service that holds the collection of captures."""

    @property
    def collection(self) -> StoredCaptures:
        """The stored captures."""
        ...


_MEDIA = {"svg": "image/svg+xml", "png": "image/png", "csv": "text/csv"}


@router.post(
    "",
    status_code=202,
    summary="Make a capture's reference",
    response_model=JobDocument,
    responses={
        200: {"model": ReferenceDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def make(
    capture_id: CaptureId,
    references: Provided[ReferenceService],
    jobs: Provided[JobRunner],
    request: ReferenceRequest | None = None,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
) -> JSONResponse:
    """Queue a reference as a job without the rig; refuse at once one that the capture's index rules out.

    An older reference of the capture stays until the new one is finished.
    """
    job = await run_in_threadpool(
        references.start, capture_id, request or ReferenceRequest(), idempotency_key=idempotency_key
    )
    return await job_answer(jobs, job, prefer=prefer, result=lambda _: references.get(capture_id))


@router.get("", summary="A capture's reference", response_model=ReferenceDocument, responses=problems(404))
def one(capture_id: CaptureId, references: Provided[ReferenceService]) -> ReferenceDocument:
    """Return the reference's figures and files, its job's progress, or why none is possible."""
    return references.get(capture_id)


@router.delete("", status_code=204, summary="Remove a capture's reference", responses=problems(404, 409, 502))
def remove(capture_id: CaptureId, references: Provided[ReferenceService]) -> None:
    """Remove the files of the reference; the capture stays."""
    references.remove(capture_id)


@router.get(
    f"/{REFERENCE_PICTURE}.{{form}}",
    summary="The comparison as a picture",
    response_class=Response,
    responses=file_responses("image/svg+xml"),
)
def picture(
    capture_id: CaptureId, form: Literal["svg", "png"], captures: Provided[CaptureSource]
) -> Response:
    """Return the error of the rig's own depth against the reference, over depth."""
    return _sent(captures, capture_id, f"{REFERENCE_PICTURE}.{form}")


@router.get(
    f"/{REFERENCE_SAMPLES}",
    summary="The samples as a table",
    response_class=Response,
    responses=file_responses("text/csv"),
)
def samples(capture_id: CaptureId, captures: Provided[CaptureSource]) -> Response:
    """Return one row per sample: position, depth by the rig and by the reference, and their errors."""
    return _sent(captures, capture_id, REFERENCE_SAMPLES)


def _sent(captures: CaptureSource, capture_id: str, name: str) -> Response:
    content = reference_file(captures.collection.get(capture_id), name)
    return Response(
        content, media_type=_MEDIA[name.rpartition(".")[2]], headers={"Cache-Control": "no-cache"}
    )
