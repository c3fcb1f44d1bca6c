"""Routes of calibration sessions: the measurements of a calibration, and the steps that make and fit them."""

from typing import Annotated

from fastapi import Path
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
    problems,
)
from foveacam_server.foundation.http.provided import Provided
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


SessionId = Annotated[str, Path(max_length=64)]
SampleId = Annotated[str, Path(max_length=64)]
PictureName = Annotated[str, Path(max_length=64)]


@router.post(
    "",
    status_code=201,
    summary="Begin a session",
    responses=problems(503),
)
def create(request: SessionRequest, sessions: Provided[CalibrationSessionService]) -> SessionDocument:
    """Begin an empty session of this rig."""
    return sessions.create(request.label)


@router.post(
    "/combined",
    status_code=201,
    summary="Put sessions together",
    responses=problems(404, 409),
)
def combine(request: CombineRequest, sessions: Provided[CalibrationSessionService]) -> SessionDocument:
    """Begin a session with the sweeps of several and the newest lens; the step `fit` fits them jointly."""
    return sessions.combine(request.sessions, label=request.label)


@router.get("", summary="All sessions, newest first")
def every(sessions: Provided[CalibrationSessionService]) -> list[SessionDocument]:
    """Return all sessions with their measurements."""
    return sessions.every()


@router.get("/{session_id}", summary="One session", responses=problems(404))
def one(session_id: SessionId, sessions: Provided[CalibrationSessionService]) -> SessionDocument:
    """Return one session."""
    return sessions.get(session_id)


@router.delete(
    "/{session_id}", status_code=204, summary="Delete a session's measurements", responses=problems(404, 409)
)
@needs(Right.ADMINISTER)
def remove(session_id: SessionId, sessions: Provided[CalibrationSessionService]) -> None:
    """Delete everything measured in a session; the calibrations fitted from it stay."""
    sessions.remove(session_id)


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
    lease: Provided[Lease],
    sessions: Provided[CalibrationSessionService],
    jobs: Provided[JobRunner],
    principal: PrincipalDep,
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a step as a job; run again, it adds measurements, or resumes where it was interrupted."""
    if isinstance(request.options, AllOptions) and request.options.activate:
        require(principal, Right.ADMINISTER, asked="a run that puts its calibration in force")
    lease.check(x_lease)
    job = sessions.submit(session_id, request, idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=sessions.get)


@router.delete(
    "/{session_id}/wide_samples/{sample_id}",
    summary="Take a view of the board out of the fit",
    responses=problems(404, 409),
)
async def remove_sample(
    session_id: SessionId,
    sample_id: SampleId,
    computing: Provided[ComputeQueue],
    sessions: Provided[CalibrationSessionService],
) -> SessionDocument:
    """Remove one view of the board and fit the lens to the others."""
    return await computing.run(lambda: sessions.remove_sample(session_id, sample_id))


@router.get(
    "/{session_id}/wide_samples/{sample_id}.jpg",
    summary="Thumbnail of a view of the board",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def thumbnail(
    session_id: SessionId, sample_id: SampleId, sessions: Provided[CalibrationSessionService]
) -> StoredFile:
    """Return a thumbnail of the wide picture, with the detected corners."""
    return StoredFile(sessions.thumbnail(session_id, sample_id), media_type="image/jpeg")


@router.delete(
    "/{session_id}/lenses/{camera}/samples/{sample_id}",
    summary="Take a fovea's view of the board out of the fit",
    responses=problems(404, 409),
)
async def remove_lens_sample(
    session_id: SessionId,
    camera: Eye,
    sample_id: SampleId,
    computing: Provided[ComputeQueue],
    sessions: Provided[CalibrationSessionService],
) -> SessionDocument:
    """Remove one view of the board and fit the fovea's lens to the others."""
    return await computing.run(lambda: sessions.remove_lens_sample(session_id, Role(camera), sample_id))


@router.get(
    "/{session_id}/lenses/{camera}/samples/{sample_id}.jpg",
    summary="Thumbnail of a fovea's view of the board",
    response_class=StoredFile,
    responses=stored_file_responses("image/jpeg"),
)
def lens_thumbnail(
    session_id: SessionId, camera: Eye, sample_id: SampleId, sessions: Provided[CalibrationSessionService]
) -> StoredFile:
    """Return a thumbnail of the fovea's picture, with the detected corners."""
    path = sessions.thumbnail(session_id, sample_id, Role(camera))
    return StoredFile(path, media_type="image/jpeg")


@router.get(
    "/{session_id}/pictures/{name}.png",
    summary="A picture of the session's state",
    response_class=StoredFile,
    responses=stored_file_responses("image/png"),
)
def picture(
    session_id: SessionId, name: PictureName, sessions: Provided[CalibrationSessionService]
) -> StoredFile:
    """Return one picture, from the last run of its step."""
    return StoredFile(sessions.picture(session_id, name), media_type="image/png")
