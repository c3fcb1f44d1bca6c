"""Routes of calibration sessions: the measurements of a calibration, and the steps that take and fit them."""

from typing import Annotated, Protocol

from fastapi import Depends, Path
from fastapi.responses import JSONResponse

from foveacam_hardware.contract import Role
from foveacam_server.accounts.errors import require
from foveacam_server.accounts.requests import PrincipalDep
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    LeaseHeader,
    PreferHeader,
    job_answer,
    opened_services,
    problems,
)
from foveacam_server.foundation.http.stored_file import StoredFile, stored_file_responses
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.calibrating.sessions.options import AllOptions, Run
from foveacam_server.resources.calibrating.sessions.schema import (
    CombineRequest,
    Eye,
    SessionDocument,
    SessionRequest,
)
from foveacam_server.resources.calibrating.sessions.service import CalibrationSessionService

router = GuardedRouter(
    "/calibration_sessions", tags=["calibrations"], reading=Right.VIEW, changing=Right.OPERATE
)


class CalibrationSessionRouteServices(Protocol):
    """Services that these routes use."""

    sessions: CalibrationSessionService
    computing: ComputeQueue
    jobs: JobRunner
    lease: Lease


ServicesDep = Annotated[CalibrationSessionRouteServices, Depends(opened_services)]

SessionId = Annotated[str, Path(max_length=64)]
SampleId = Annotated[str, Path(max_length=64)]
PictureName = Annotated[str, Path(max_length=64)]


@router.post(
    "",
    status_code=201,
    summary="Begin a session",
    responses=problems(503),
)
def create(request: SessionRequest, services: ServicesDep) -> SessionDocument:
    """Begin an empty session of this rig."""
    return services.sessions.create(request.label)


@router.post(
    "/combined",
    status_code=201,
    summary="Put sessions together",
    responses=problems(404, 409),
)
def combine(request: CombineRequest, services: ServicesDep) -> SessionDocument:
    """Begin a session with the sweeps of several and the newest lens; the step `fit` fits them together."""
    return services.sessions.combine(request.sessions, label=request.label)


@router.get("", summary="All sessions, newest first")
def every(services: ServicesDep) -> list[SessionDocument]:
    """Return all sessions with all that was measured in them."""
    return services.sessions.every()


@router.get("/{session_id}", summary="One session", responses=problems(404))
def one(session_id: SessionId, services: ServicesDep) -> SessionDocument:
    """Return one session."""
    return services.sessions.get(session_id)


@router.delete(
    "/{session_id}", status_code=204, summary="Delete a session's measurements", responses=problems(404, 409)
)
@needs(Right.ADMINISTER)
def remove(session_id: SessionId, services: ServicesDep) -> None:
    """Delete everything measured in a session; the calibrations fitted from it stay."""
    services.sessions.remove(session_id)


@router.post(
    "/{session_id}/runs",
    status_code=202,
    summary="Run a step",
    response_model=JobDocument,
    responses={
        200: {"model": SessionDocument, "description": "ended in time"},
        **problems(404, 409, 502, 503, 504),
    },
)
async def run(
    session_id: SessionId,
    request: Run,
    services: ServicesDep,
    principal: PrincipalDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a step as a job; run again, it adds to what was measured, or goes on where it was interrupted."""
    if isinstance(request.options, AllOptions) and request.options.activate:
        require(principal, Right.ADMINISTER, asked="a run that puts its calibration in force")
    services.lease.check(x_lease)
    job = services.sessions.submit(session_id, request, idempotency_key=idempotency_key)
    return await job_answer(services, job, prefer=prefer, result=services.sessions.get_by_url)


@router.delete(
    "/{session_id}/wide_samples/{sample_id}",
    summary="Take a view of the board out of the fit",
    responses=problems(404, 409),
)
async def remove_sample(session_id: SessionId, sample_id: SampleId, services: ServicesDep) -> SessionDocument:
    """Remove one view and fit the lens to the others."""
    return await services.computing.run(lambda: services.sessions.remove_sample(session_id, sample_id))


@router.get(
    "/{session_id}/wide_samples/{sample_id}.jpg",
    summary="Thumbnail of a view of the board",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def thumbnail(session_id: SessionId, sample_id: SampleId, services: ServicesDep) -> StoredFile:
    """Return what the wide camera saw, small, with the corners found."""
    return StoredFile(services.sessions.thumbnail(session_id, sample_id), media_type="image/jpeg")


@router.delete(
    "/{session_id}/lenses/{camera}/samples/{sample_id}",
    summary="Take a fovea's view of the board out of the fit",
    responses=problems(404, 409),
)
async def remove_lens_sample(
    session_id: SessionId, camera: Eye, sample_id: SampleId, services: ServicesDep
) -> SessionDocument:
    """Remove one view and fit the fovea's lens to the others."""
    return await services.computing.run(
        lambda: services.sessions.remove_lens_sample(session_id, Role(camera), sample_id)
    )


@router.get(
    "/{session_id}/lenses/{camera}/samples/{sample_id}.jpg",
    summary="Thumbnail of a fovea's view of the board",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def lens_thumbnail(
    session_id: SessionId, camera: Eye, sample_id: SampleId, services: ServicesDep
) -> StoredFile:
    """Return what the fovea saw, small, with the corners found."""
    path = services.sessions.thumbnail(session_id, sample_id, Role(camera))
    return StoredFile(path, media_type="image/jpeg")


@router.get(
    "/{session_id}/pictures/{name}.png",
    summary="A picture of the session's state",
    response_class=StoredFile,
    responses=stored_file_responses("image/png"),
)
def picture(session_id: SessionId, name: PictureName, services: ServicesDep) -> StoredFile:
    """Return one picture as of the last run of its step."""
    return StoredFile(services.sessions.picture(session_id, name), media_type="image/png")
