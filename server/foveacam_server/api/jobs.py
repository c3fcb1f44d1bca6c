"""Jobs: long work, its progress, its end, and how to cancel it."""

from fastapi import APIRouter

from foveacam_server.api.answers import Limit, problems
from foveacam_server.api.models import JobDocument
from foveacam_server.runtime.services import ServicesDep
from foveacam_server.runtime.store import Document

router = APIRouter(prefix="/jobs", tags=["jobs"])


@router.get("", summary="Newest jobs, newest first", response_model=list[JobDocument])
def newest(services: ServicesDep, limit: Limit = 50) -> list[Document]:
    """Return the newest jobs."""
    return [job.document() for job in services.jobs.newest(limit)]


@router.get("/{job_id}", summary="One job", response_model=JobDocument, responses=problems(404))
def one(job_id: str, services: ServicesDep) -> Document:
    """Return one job as it stands now."""
    return services.jobs.get(job_id).document()


@router.post("/{job_id}/cancel", summary="Cancel a job", response_model=JobDocument, responses=problems(404))
def cancel(job_id: str, services: ServicesDep) -> Document:
    """Ask a job to end at its next step; harmless when it has ended."""
    return services.jobs.cancel(job_id).document()
