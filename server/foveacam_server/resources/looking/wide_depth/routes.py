"""Routes of the depth of the whole wide view: figures, picture, points, and looking around to measure it."""

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
from foveacam_server.resources.looking.wide_depth.schema import WideDepthDocument
from foveacam_server.resources.looking.wide_depth.service import WideDepthService
from foveacam_server.rig.encoder import encode_png

router = GuardedRouter(tags=["depth"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("/wide_depth", summary="Depth of the wide view, in figures", responses=problems(409, 503))
def document(wide_depth: Provided[WideDepthService]) -> WideDepthDocument:
    """Return coverage, age and accuracy of the wide depth."""
    return wide_depth.document()


@router.get(
    "/wide_depth.png",
    summary="Depth of the wide view as a picture",
    response_class=Response,
    responses={**file_responses("image/png"), **problems(409, 503)},
)
def png(wide_depth: Provided[WideDepthService]) -> Response:
    """Return a heat map with its scale; what is unknown is striped."""
    return Response(encode_png(wide_depth.picture()), media_type="image/png")


@router.get(
    "/wide_depth.ply",
    summary="Depth of the wide view as points",
    response_class=Response,
    responses={**file_responses("application/octet-stream"), **problems(409, 503)},
)
def ply(wide_depth: Provided[WideDepthService]) -> Response:
    """Return x, y, z (m, rig frame), colour and sigma of every cell's surfaces."""
    headers = {"Content-Disposition": 'attachment; filename="wide_depth.ply"'}
    return Response(wide_depth.ply(), media_type="application/octet-stream", headers=headers)


@router.delete(
    "/wide_depth", status_code=204, summary="Forget the depth of the wide view", responses=problems(409)
)
def forget(
    lease: Provided[Lease], wide_depth: Provided[WideDepthService], x_lease: LeaseHeader = None
) -> None:
    """Forget the whole wide depth; fixations and their clouds stay."""
    lease.check(x_lease)
    wide_depth.forget()


@router.post(
    "/wide_depth/surveys",
    status_code=202,
    summary="Look around",
    response_model=JobDocument,
    responses={
        200: {"model": WideDepthDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def look_around(
    lease: Provided[Lease],
    wide_depth: Provided[WideDepthService],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue looks over the whole steering field; what they found is kept when the job is cancelled."""
    lease.check(x_lease)
    job = wide_depth.look_around(idempotency_key=idempotency_key)

    return await job_answer(jobs, job, prefer=prefer, result=lambda _url: wide_depth.document())
