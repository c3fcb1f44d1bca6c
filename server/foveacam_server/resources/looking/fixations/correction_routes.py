"""Routes of corrections: the operator chooses an alternative answer, or orders a look nearer or farther."""

from fastapi.responses import JSONResponse

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import (
    LeaseHeader,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.looking.fixations.correction_service import choose, look_beside, show_choice
from foveacam_server.resources.looking.fixations.schema import (
    ChoiceRequest,
    CorrectionRequest,
    FixationDocument,
)
from foveacam_server.resources.looking.fixations.service import FixationService
from foveacam_server.rig.ports import SceneViewer

router = GuardedRouter("/fixations", tags=["corrections"], reading=Right.VIEW, changing=Right.OPERATE)


@router.post("/{fixation_id}/choice", summary="Choose one of the alternatives", responses=problems(404))
def choice(
    fixation_id: str,
    request: ChoiceRequest,
    fixations: Provided[FixationService],
    events: Provided[EventLog],
    viewer: Provided[SceneViewer | None],
) -> FixationDocument:
    """Make one alternative the answer of the fixation's target; nothing moves."""
    fixation = choose(fixations, fixation_id, request.alternative, events=events)
    if viewer is not None:
        show_choice(viewer, fixation)
    return fixation


@router.post(
    "/{fixation_id}/corrections",
    status_code=202,
    summary="Look again nearer or farther",
    response_model=JobDocument,
    responses={
        200: {"model": FixationDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def correct(
    fixation_id: str,
    request: CorrectionRequest,
    lease: Provided[Lease],
    fixations: Provided[FixationService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a look at the same target that takes only distances nearer or farther than its answer."""
    lease.check(x_lease)
    job = look_beside(fixations, fixation_id, request.direction, source="rest")
    return await job_answer(jobs, job, prefer=prefer, result=fixations.table.get)
