"""Routes of fixations: point at a target, both foveae verge on it."""

from fastapi.responses import JSONResponse

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    LeaseHeader,
    Limit,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.clouds.schema import CloudDocument
from foveacam_server.resources.looking.fixations.schema import (
    FixationDocument,
    FixationEstimate,
    FixationRequest,
)
from foveacam_server.resources.looking.fixations.service import FixationService

router = GuardedRouter("/fixations", tags=["fixations"], reading=Right.VIEW, changing=Right.OPERATE)


@router.post(
    "",
    status_code=202,
    summary="Look there",
    response_model=JobDocument,
    responses={
        200: {"model": FixationDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def create(
    request: FixationRequest,
    lease: Provided[Lease],
    fixations: Provided[FixationService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a fixation as a job; `Prefer: wait=10` answers with the fixation itself when it ends in time."""
    lease.check(x_lease)
    job = fixations.foveate(request, source="rest", idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=fixations.table.get)


@router.get("", summary="Newest fixations, newest first")
def newest(fixations: Provided[FixationService], limit: Limit = 50) -> list[FixationDocument]:
    """Return the newest fixations."""
    return fixations.table.newest(limit)


@router.get("/estimates", summary="Estimates of the running fixations")
async def estimates(fixations: Provided[FixationService]) -> list[FixationEstimate]:
    """Return the newest estimate of each running fixation; its distance is null while nothing is known."""
    return fixations.estimates.newest()


@router.get("/{fixation_id}/estimate", summary="Newest estimate of a fixation", responses=problems(404))
def estimate(fixation_id: str, fixations: Provided[FixationService]) -> FixationEstimate:
    """Return the newest estimate of a running fixation, or the answer of one that has ended."""
    return fixations.newest_estimate(fixation_id)


@router.get("/{fixation_id}", summary="One fixation", responses=problems(404))
def one(fixation_id: str, fixations: Provided[FixationService]) -> FixationDocument:
    """Return one fixation with all its steps."""
    return fixations.table.get(fixation_id)


@router.post(
    "/{fixation_id}/full_resolution",
    status_code=202,
    summary="Look once more, at full resolution",
    response_model=JobDocument,
    responses={
        200: {"model": CloudDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def look_at_full_resolution(
    fixation_id: str,
    lease: Provided[Lease],
    fixations: Provided[FixationService],
    clouds: Provided[CloudCollection],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue one look of both foveae at the answer's point at binning 1; its result is the new cloud.

    Distance and target stay; cloud and depth map are replaced by those of this look, with four times as many
    points.
    """
    lease.check(x_lease)
    job = fixations.full_resolution.look(fixation_id, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=clouds.get)
