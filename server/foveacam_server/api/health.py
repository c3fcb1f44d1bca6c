"""For machines that watch the server: alive, ready, and counters."""

from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from foveacam_server.api.models import ResponseModel
from foveacam_server.runtime.device_reconnector import BASE
from foveacam_server.runtime.metrics import registry_of
from foveacam_server.runtime.rig_status import RigState
from foveacam_server.runtime.services import ServicesDep

router = APIRouter(tags=["health"])


class Liveness(ResponseModel):
    """The process is alive."""

    status: str


class ReadyProblem(ResponseModel):
    """What is missing."""

    device: str
    detail: str


class Readiness(ResponseModel):
    """Whether fixations can be had now."""

    ready: bool
    problems: list[ReadyProblem]


@router.get("/healthz", summary="Is the process alive?")
async def healthz() -> Liveness:
    """Answer whatever the rig is doing."""
    return Liveness(status="ok")


@router.get(
    "/readyz",
    summary="Can it foveate now?",
    response_model=Readiness,
    responses={503: {"model": Readiness, "description": "not ready; says what is missing"}},
)
async def readyz(services: ServicesDep) -> JSONResponse:
    """Return 200 when a fixation could start now, else 503 and what is missing."""
    status = services.hardware.status
    missing = [
        ReadyProblem(device=problem.device, detail=problem.detail)
        for problem in status.problems
        if problem.device not in BASE  # nobody needs them to foveate
    ]
    if status.state is RigState.OPENING:
        missing.append(ReadyProblem(device="rig", detail="the rig is still opening"))
    if status.rig_id is not None and services.calibration.problem is not None:
        missing.append(ReadyProblem(device="calibration", detail=services.calibration.problem))
    if services.events.fault is not None:
        missing.append(ReadyProblem(device="storage", detail=services.events.fault))
    readiness = Readiness(ready=not missing, problems=missing)
    return JSONResponse(readiness.model_dump(), status_code=503 if missing else 200)


@router.get("/metrics", summary="Counters for Prometheus", response_class=Response)
async def metrics(services: ServicesDep) -> Response:
    """Return the counters in Prometheus' text format."""
    return Response(generate_latest(registry_of(services)), media_type=CONTENT_TYPE_LATEST)
