"""Routes of drift checks: looks into the scene that measure the eyes' drift since the calibration."""

from typing import Annotated

from fastapi import Path
from fastapi.responses import JSONResponse, Response

from foveacam_server.accounts.errors import require
from foveacam_server.accounts.requests import PrincipalDep
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
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
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument, DriftRequest
from foveacam_server.resources.calibrating.drift_checks.service import DriftChecks

router = GuardedRouter("/drift_checks", tags=["calibrations"], reading=Right.VIEW, changing=Right.OPERATE)


CheckId = Annotated[str, Path(max_length=64)]


@router.post(
    "",
    status_code=202,
    summary="Check the drift",
    response_model=JobDocument,
    responses={
        200: {"model": DriftCheckDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def create(
    request: DriftRequest,
    lease: Provided[Lease],
    drift: Provided[DriftChecks],
    jobs: Provided[JobRunner],
    principal: PrincipalDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a check; with `apply`, a significant drift is corrected and the result put in force."""
    if request.apply:
        require(principal, Right.ADMINISTER, asked="a drift check that puts a calibration in force")
    lease.check(x_lease)
    job = drift.submit(request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=drift.records.get)


@router.get("", summary="All drift checks, newest first")
def every(drift: Provided[DriftChecks]) -> list[DriftCheckDocument]:
    """Return the results of all checks."""
    return drift.records.every()


@router.get(
    "/trend.png",
    summary="Drift over time",
    response_class=Response,
    responses=file_responses("image/png"),
)
async def trend(computing: Provided[ComputeQueue], drift: Provided[DriftChecks]) -> Response:
    """Return a picture of both eyes' drift over time."""
    picture = await computing.run(drift.records.trend_picture)
    return Response(picture, media_type="image/png")


@router.get("/{check_id}", summary="One check", responses=problems(404))
def one(check_id: CheckId, drift: Provided[DriftChecks]) -> DriftCheckDocument:
    """Return the result of one check."""
    return drift.records.get(check_id)
