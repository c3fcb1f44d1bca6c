"""Routes of targets: stored points that were fixated."""

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
from foveacam_server.foundation.schema import ItemId, JobDocument
from foveacam_server.resources.looking.fixations.documents import describe_target
from foveacam_server.resources.looking.fixations.schema import FixationDocument, TargetDocument, TargetPatch
from foveacam_server.resources.looking.fixations.service import FixationService
from foveacam_server.rig.ports import SceneViewer

router = GuardedRouter("/targets", tags=["targets"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="All targets, oldest first")
def every(fixations: Provided[FixationService]) -> list[TargetDocument]:
    """Return all targets."""
    return [describe_target(target) for target in fixations.targets.every()]


@router.get("/{target_id}", summary="One target", responses=problems(404))
def one(target_id: str, fixations: Provided[FixationService]) -> TargetDocument:
    """Return one target."""
    return describe_target(fixations.targets.get(target_id))


@router.patch("/{target_id}", summary="Rename a target", responses=problems(404))
def rename(
    target_id: str,
    patch: TargetPatch,
    fixations: Provided[FixationService],
    events: Provided[EventLog],
    viewer: Provided[SceneViewer | None],
) -> TargetDocument:
    """Give a target another label."""
    renamed = fixations.targets.rename(target_id, patch.label)
    target = describe_target(renamed)
    events.emit("target.updated", f"{target_id} is now {patch.label}", data=target)
    if viewer is not None:
        viewer.relabel_fixation(renamed.fixation.id, patch.label)
    return target


@router.delete("/{target_id}", status_code=204, summary="Forget a target", responses=problems(404))
def remove(
    target_id: str,
    fixations: Provided[FixationService],
    events: Provided[EventLog],
    viewer: Provided[SceneViewer | None],
) -> None:
    """Delete a target; its fixation and its cloud stay."""
    target = fixations.targets.remove(target_id)
    events.emit("target.deleted", f"{target.label} was removed", data=ItemId(id=target_id))
    if viewer is not None:
        viewer.remove_fixation(target.fixation.id)


@router.post(
    "/{target_id}/fixate",
    status_code=202,
    summary="Look at a target again",
    response_model=JobDocument,
    responses={
        200: {"model": FixationDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def look_again(
    target_id: str,
    lease: Provided[Lease],
    fixations: Provided[FixationService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Measure a target again; its label stays."""
    lease.check(x_lease)
    job = fixations.look_again(target_id, source="rest")
    return await job_answer(jobs, job, prefer=prefer, result=fixations.table.get)
