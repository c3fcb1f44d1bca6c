"""Routes of jobs: list, progress, cancel."""

from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import Limit, opened_services, problems
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument

router = GuardedRouter("/jobs", tags=["jobs"], reading=Right.VIEW, changing=Right.OPERATE)


class JobRouteServices(Protocol):
    """Services that these routes use."""

    jobs: JobRunner


ServicesDep = Annotated[JobRouteServices, Depends(opened_services)]


@router.get("", summary="Newest jobs, newest first")
def newest(services: ServicesDep, limit: Limit = 50) -> list[JobDocument]:
    """Return the newest jobs."""
    return [job.describe() for job in services.jobs.newest(limit)]


@router.get("/{job_id}", summary="One job", responses=problems(404))
def one(job_id: str, services: ServicesDep) -> JobDocument:
    """Return one job in its present state."""
    return services.jobs.get(job_id).describe()


@router.post("/{job_id}/cancel", summary="Cancel a job", responses=problems(404))
def cancel(job_id: str, services: ServicesDep) -> JobDocument:
    """Cancel a job at its next step, unless it has ended."""
    return services.jobs.cancel(job_id).describe()
