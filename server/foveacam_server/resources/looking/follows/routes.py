"""Routes of followed targets."""

from fastapi import Response
from fastapi.responses import JSONResponse

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    LeaseHeader,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.looking.follows.rounds import FollowRounds
from foveacam_server.resources.looking.follows.schema import (
    FollowedDocument,
    FollowPatch,
    FollowRequest,
    FollowRoundRequest,
    FollowRoundTaken,
    TrailPoint,
)
from foveacam_server.resources.looking.follows.service import FollowService

router = GuardedRouter("/follows", tags=["follows"], reading=Right.VIEW, changing=Right.OPERATE)


@router.post("", status_code=201, summary="Follow a target", responses=problems(404, 409, 503))
def create(
    request: FollowRequest,
    lease: Provided[Lease],
    follows: Provided[FollowService],
    x_lease: LeaseHeader = None,
) -> FollowedDocument:
    """Follow a further target, 8 at most: both foveae verge on it, then look at all targets in turn."""
    lease.check(x_lease)
    return follows.follow(request)


@router.get("", summary="All followed targets")
def every(follows: Provided[FollowService]) -> list[FollowedDocument]:
    """Return the followed targets as they are now, oldest first."""
    return follows.every()


@router.delete("", status_code=204, summary="Stop following all targets")
def end_all(
    lease: Provided[Lease], follows: Provided[FollowService], x_lease: LeaseHeader = None
) -> Response:
    """Stop following all targets; the mirrors stay where they are."""
    lease.check(x_lease)
    follows.end_all()
    return Response(status_code=204)


@router.post(
    "/rounds",
    status_code=202,
    summary="Capture all followed targets",
    response_model=JobDocument,
    responses={
        200: {"model": FollowRoundTaken, "description": "taken in time"},
        **problems(409, 502, 503, 504),
    },
)
async def take_round(
    request: FollowRoundRequest,
    lease: Provided[Lease],
    follows: Provided[FollowService],
    rounds: Provided[FollowRounds],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Look once at each followed target and keep the pictures with their poses as a dataset, as a job."""
    lease.check(x_lease)
    follows.check_followed()
    job = rounds.start(request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=rounds.get)


@router.get("/{follow_id}", summary="One followed target", responses=problems(404))
def one(follow_id: str, follows: Provided[FollowService]) -> FollowedDocument:
    """Return a followed target as it is now."""
    return follows.get(follow_id)


@router.patch("/{follow_id}", summary="Change how a target is followed", responses=problems(404, 409))
def change(
    follow_id: str,
    patch: FollowPatch,
    lease: Provided[Lease],
    follows: Provided[FollowService],
    x_lease: LeaseHeader = None,
) -> FollowedDocument:
    """Change label, tracker or priority while it is followed."""
    lease.check(x_lease)
    return follows.change(follow_id, patch)


@router.delete("/{follow_id}", status_code=204, summary="Stop following one", responses=problems(404, 409))
def end(
    follow_id: str, lease: Provided[Lease], follows: Provided[FollowService], x_lease: LeaseHeader = None
) -> Response:
    """Stop following a target."""
    lease.check(x_lease)
    follows.end(follow_id)
    return Response(status_code=204)


@router.get("/{follow_id}/trail", summary="Where a followed target was", responses=problems(404))
def trail(follow_id: str, follows: Provided[FollowService]) -> list[TrailPoint]:
    """Return its last hits, 600 at most, oldest first."""
    return follows.trail(follow_id)
