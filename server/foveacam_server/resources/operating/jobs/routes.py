"""Routes of jobs: list, progress, cancel."""

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import Limit, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import JobDocument

router = GuardedRouter("/jobs", tags=["jobs"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Newest jobs, newest first")
def newest(jobs: Provided[JobRunner], limit: Limit = 50) -> list[JobDocument]:
    """Return the newest jobs."""
    return [job.describe() for job in jobs.newest(limit)]


@router.get("/{job_id}", summary="One job", responses=problems(404))
def one(job_id: str, jobs: Provided[JobRunner]) -> JobDocument:
    """Return one job in its present state."""
    return jobs.get(job_id).describe()


@router.post("/{job_id}/cancel", summary="Cancel a job", responses=problems(404))
def cancel(job_id: str, jobs: Provided[JobRunner]) -> JobDocument:
    """Cancel a job at its next step, unless it has ended."""
    return jobs.cancel(job_id).describe()
