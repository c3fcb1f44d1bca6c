"""Routes of acceptance runs: the rig measures itself on its markers."""

from typing import Annotated

from fastapi import Path
from fastapi.responses import JSONResponse, Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    LeaseHeader,
    PreferHeader,
    file_responses,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument, AcceptanceRequest
from foveacam_server.resources.calibrating.acceptances.service import Acceptances

router = GuardedRouter("/acceptances", tags=["calibrations"], reading=Right.VIEW, changing=Right.OPERATE)

AcceptanceId = Annotated[str, Path(max_length=64)]
PictureName = Annotated[str, Path(max_length=64)]


@router.post(
    "",
    status_code=202,
    summary="Run the acceptance",
    response_model=JobDocument,
    responses={
        200: {"model": AcceptanceDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def create(
    request: AcceptanceRequest,
    lease: Provided[Lease],
    acceptances: Provided[Acceptances],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a run of ten minutes or so; it moves mirrors and pan-tilt, and changes no calibration."""
    lease.check(x_lease)
    job = acceptances.submit(request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=acceptances.records.get)


@router.get("", summary="All acceptance runs, newest first")
def every(acceptances: Provided[Acceptances]) -> list[AcceptanceDocument]:
    """Return the results of all runs, those that were ended early too."""
    return acceptances.records.every()


@router.get("/{acceptance_id}", summary="One acceptance run", responses=problems(404))
def one(acceptance_id: AcceptanceId, acceptances: Provided[Acceptances]) -> AcceptanceDocument:
    """Return the result of one run."""
    return acceptances.records.get(acceptance_id)


@router.get(
    "/{acceptance_id}/report.html",
    summary="Report of an acceptance run",
    response_class=Response,
    responses=file_responses("text/html"),
)
def report(acceptance_id: AcceptanceId, acceptances: Provided[Acceptances]) -> Response:
    """Return the report: findings, figures with their limits, pictures, Table 2."""
    return Response(acceptances.records.report(acceptance_id), media_type="text/html; charset=utf-8")


@router.get(
    "/{acceptance_id}/pictures/{name}.png",
    summary="Picture of an acceptance run",
    response_class=Response,
    responses=file_responses("image/png"),
)
def picture(acceptance_id: AcceptanceId, name: PictureName, acceptances: Provided[Acceptances]) -> Response:
    """Return a picture of one check."""
    return Response(acceptances.records.picture(acceptance_id, name), media_type="image/png")
