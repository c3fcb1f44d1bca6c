"""Routes of the vergence loop."""

from typing import Annotated

from fastapi import Query, Response
from fastapi.responses import JSONResponse

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
from foveacam_server.resources.looking.loop.schema import (
    EyeName,
    LoopDocument,
    LoopDrag,
    LoopEyePlace,
    LoopPatch,
    LoopSample,
    LoopSettingsDocument,
    LoopSettingsGroup,
    LoopSettingsPatch,
    LoopTargetRequest,
    LoopTuneRequest,
)
from foveacam_server.resources.looking.loop.service import LoopService

router = GuardedRouter("/loop", tags=["loop"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="The vergence loop")
def describe(loop: Provided[LoopService]) -> LoopDocument:
    """Return the present state of the loop: status, errors, commands, distance, trigger and settings."""
    return loop.describe()


@router.post("", summary="Keep both foveae on a target", responses=problems(404, 409, 503))
def look_at(
    request: LoopTargetRequest,
    lease: Provided[Lease],
    loop: Provided[LoopService],
    x_lease: LeaseHeader = None,
) -> LoopDocument:
    """Choose the target; starts the loop if it does not run. The loop yields the rig to other jobs."""
    lease.check(x_lease)
    return loop.look_at(request)


@router.patch("", summary="Pause the loop, hold or set its axes", responses=problems(409))
def change(
    request: LoopPatch, lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None
) -> LoopDocument:
    """Pause or resume; hold single axes; set the command of an axis, which holds it from then on."""
    lease.check(x_lease)
    return loop.change(request)


@router.delete("", status_code=204, summary="End the loop")
def end(lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None) -> Response:
    """End the loop; the mirrors stay where they are."""
    lease.check(x_lease)
    loop.end()
    return Response(status_code=204)


@router.put("/drag", status_code=204, summary="Steer both eyes by hand", responses=problems(409))
def drag(
    request: LoopDrag, lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None
) -> Response:
    """Point both eyes in parallel at a place of the wide view, without corrections, until released."""
    lease.check(x_lease)
    loop.drag(request)
    return Response(status_code=204)


@router.delete("/drag", status_code=204, summary="Release the eyes", responses=problems(409))
def release(lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None) -> Response:
    """Release the eyes; the loop resumes with its target."""
    lease.check(x_lease)
    loop.drag(None)
    return Response(status_code=204)


@router.put("/eyes/{eye}", summary="Let one eye follow a separate place", responses=problems(409, 503))
def follow_apart(
    eye: EyeName,
    request: LoopEyePlace,
    lease: Provided[Lease],
    loop: Provided[LoopService],
    x_lease: LeaseHeader = None,
) -> LoopDocument:
    """Keep a place of one fovea's picture centred; the other eye keeps its own place, or rests."""
    lease.check(x_lease)
    return loop.follow_apart(eye, request)


@router.delete("/eyes", summary="End the split of the eyes", responses=problems(409))
def reunite(lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None) -> LoopDocument:
    """End the split of the eyes; without a common target the loop ends."""
    lease.check(x_lease)
    return loop.reunite()


@router.patch("/settings", summary="Change settings of the loop", responses=problems(409))
def change_settings(
    request: LoopSettingsPatch,
    lease: Provided[Lease],
    loop: Provided[LoopService],
    x_lease: LeaseHeader = None,
) -> LoopSettingsDocument:
    """Change settings now and for later runs; fields left out stay."""
    lease.check(x_lease)
    return loop.change_settings(request)


@router.delete("/settings", summary="Put settings back to their defaults", responses=problems(409))
def reset_settings(
    lease: Provided[Lease],
    loop: Provided[LoopService],
    group: Annotated[LoopSettingsGroup | None, Query(description="without: all")] = None,
    x_lease: LeaseHeader = None,
) -> LoopSettingsDocument:
    """Put one group of settings, or all, back to their defaults."""
    lease.check(x_lease)
    return loop.reset_settings(group)


@router.post(
    "/tune",
    status_code=202,
    summary="Tune the gains",
    response_model=JobDocument,
    responses={200: {"model": LoopDocument, "description": "tuned in time"}, **problems(409, 502, 503, 504)},
)
async def tune(
    request: LoopTuneRequest,
    lease: Provided[Lease],
    loop: Provided[LoopService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Tune the gains on the target by relays, then by CMA-ES if requested, as a job.

    When cancelled or refused, the gains stay as they were.
    """
    lease.check(x_lease)
    job = loop.tuning.start(request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=lambda _: loop.describe())


@router.post("/trigger/reset", summary="Reset the trigger", responses=problems(409))
def reset_trigger(
    lease: Provided[Lease], loop: Provided[LoopService], x_lease: LeaseHeader = None
) -> LoopDocument:
    """Reset the trigger, so that the loop resumes after repeated equal failures have latched it."""
    lease.check(x_lease)
    return loop.reset_trigger()


@router.get("/history", summary="The loop's last looks")
def history(
    loop: Provided[LoopService], after_look: Annotated[int, Query(ge=0, le=1_000_000_000)] = 0
) -> list[LoopSample]:
    """Return the looks after a given one, oldest first, 900 at most."""
    return loop.history(after_look)


@router.get(
    "/match.png",
    summary="Match of the last look",
    response_class=Response,
    responses={**file_responses("image/png"), **problems(404)},
)
def match_png(loop: Provided[LoopService]) -> Response:
    """Return the guide strip with both eyes' boxes, and each eye's correlation map, as a PNG."""
    return Response(loop.match_picture(), media_type="image/png")


@router.get(
    "/tune.png",
    summary="Step responses before and after tuning",
    response_class=Response,
    responses={**file_responses("image/png"), **problems(404)},
)
async def tune_png(computing: Provided[ComputeQueue], loop: Provided[LoopService]) -> Response:
    """Return the step responses before and after the last tuning, as a PNG."""
    picture = await computing.run(lambda: loop.tuning.picture(form="png"))
    return Response(picture, media_type="image/png")


@router.get(
    "/tune.svg",
    summary="Step responses before and after tuning, as SVG",
    response_class=Response,
    responses={**file_responses("image/svg+xml"), **problems(404)},
)
async def tune_svg(computing: Provided[ComputeQueue], loop: Provided[LoopService]) -> Response:
    """Return the step responses before and after the last tuning, as an SVG."""
    picture = await computing.run(lambda: loop.tuning.picture(form="svg"))
    return Response(picture, media_type="image/svg+xml")
