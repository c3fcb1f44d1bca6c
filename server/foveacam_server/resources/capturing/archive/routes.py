"""Routes of the archive: send a capture, a recording or a still to it, fetch one from it."""

from functools import partial
from typing import Annotated

from fastapi import Path
from fastapi.responses import JSONResponse
from starlette.concurrency import run_in_threadpool

from foveacam_pipeline.storage.archive import ItemKind
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument, ResponseModel
from foveacam_server.resources.capturing.archive.schema import ArchiveDocument, ArchiveRequest
from foveacam_server.resources.capturing.archive.service import ArchiveService
from foveacam_server.resources.capturing.captures.schema import CaptureDocument
from foveacam_server.resources.capturing.recordings.schema import RecordingDocument
from foveacam_server.resources.capturing.stills.schema import StillDocument

router = GuardedRouter(tags=["archive"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("/archive", summary="The archive of this server")
def archive(archive_service: Provided[ArchiveService]) -> ArchiveDocument:
    """Return the address of the archive of captures, recordings and stills."""
    return archive_service.describe()


def _add_kind(kind: ItemKind, noun: str, document: type[ResponseModel], *, id_length: int) -> None:
    """Add the routes that send and fetch one kind of item, named after its noun."""
    item_id_path = Path(alias=f"{noun}_id", max_length=id_length)
    responses = {
        200: {"model": document, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    }

    async def send(
        item_id: Annotated[str, item_id_path],
        request: ArchiveRequest,
        archive: Provided[ArchiveService],
        jobs: Provided[JobRunner],
        prefer: PreferHeader = None,
        idempotency_key: IdempotencyHeader = None,
    ) -> JSONResponse:
        """Queue the upload as a job; files that the archive already has are not sent again."""
        job = await run_in_threadpool(
            archive.archive, kind, item_id, request, idempotency_key=idempotency_key
        )
        return await job_answer(jobs, job, prefer=prefer, result=partial(archive.document, kind))

    async def fetch(
        item_id: Annotated[str, item_id_path],
        archive: Provided[ArchiveService],
        jobs: Provided[JobRunner],
        prefer: PreferHeader = None,
        idempotency_key: IdempotencyHeader = None,
    ) -> JSONResponse:
        """Queue the download of the files that are not on this machine, as a job."""
        job = await run_in_threadpool(archive.fetch, kind, item_id, idempotency_key=idempotency_key)
        return await job_answer(jobs, job, prefer=prefer, result=partial(archive.document, kind))

    for endpoint, name, summary in (
        (send, "archive", f"Send a {noun} to the archive"),
        (fetch, "fetch", f"Fetch a {noun} from the archive"),
    ):
        router.add_api_route(
            f"/{kind}/{{{noun}_id}}/{name}",
            endpoint,
            methods=["POST"],
            name=f"{name}_{noun}",
            status_code=202,
            summary=summary,
            response_model=JobDocument,
            responses=responses,
        )


_add_kind("captures", "capture", CaptureDocument, id_length=255)
_add_kind("recordings", "recording", RecordingDocument, id_length=100)
_add_kind("stills", "still", StillDocument, id_length=100)
