"""Reads and writes jobs as rows of the database; ends those that a restart interrupted."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

from sqlalchemy import select, update

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.errors import INTERRUPTED, NotFound, ProblemDetails
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import JobDocument, JobProgress, Problem, RequestModel
from foveacam_server.foundation.store import Document, JobRow, Store

RequestT = TypeVar("RequestT", bound=RequestModel)


class JobState(StrEnum):
    """State of a job."""

    QUEUED = "queued"
    RUNNING = "running"
    CANCELLING = "cancelling"
    CANCELLED = "cancelled"
    FAILED = "failed"
    SUCCEEDED = "succeeded"

    @property
    def ended(self) -> bool:
        """Whether the job has ended."""
        return self in (JobState.CANCELLED, JobState.FAILED, JobState.SUCCEEDED)


@dataclass(slots=True, kw_only=True)
class Job:
    """Long work that a request started; changed only by its runner."""

    id: str
    kind: str
    request: Document  # JSON: depends on the kind
    state: JobState = JobState.QUEUED
    created_utc: str = field(default_factory=utc_now)
    started_utc: str | None = None
    ended_utc: str | None = None
    done: int = 0
    total: int = 0
    eta_s: float | None = None
    note: str = ""
    result_url: str | None = None
    problem: Problem | None = None
    idempotency_key: str | None = None

    @property
    def result_id(self) -> str | None:
        """Id of the result in its collection: the last part of the stored URL."""
        return None if self.result_url is None else self.result_url.rpartition("/")[2]

    def parse_request(self, schema: type[RequestT]) -> RequestT:
        """Return the stored request as its schema."""
        return schema.model_validate(self.request, strict=False)

    def describe(self) -> JobDocument:
        """Return REST's document of the job."""
        return JobDocument(
            id=self.id,
            kind=self.kind,
            state=self.state.value,
            created_utc=self.created_utc,
            started_utc=self.started_utc,
            ended_utc=self.ended_utc,
            progress=JobProgress(done=self.done, total=self.total, eta_s=self.eta_s, note=self.note),
            result_url=self.result_url,
            problem=self.problem,
        )


class JobTable:
    """Reads and writes jobs."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def end_interrupted(self) -> int:
        """Fail jobs that a restart interrupted, so that nothing moves without a request; return how many."""
        problem = ProblemDetails(
            kind=INTERRUPTED,
            detail="The job was interrupted by a restart of the server.",
            remedy="Ask for it again.",
        )
        open_states = [state.value for state in JobState if not state.ended]
        values = {"state": JobState.FAILED.value, "ended_utc": utc_now(), "problem": problem.document()}
        with self._store.session() as session:
            found = session.scalars(select(JobRow.seq).where(JobRow.state.in_(open_states))).all()
            session.execute(update(JobRow).where(JobRow.seq.in_(found)).values(**values))
        return len(found)

    def add(self, job: Job) -> Job:
        """Add a job; return the earlier one with its idempotency key instead, if there is one."""
        with self._store.session() as session:
            if job.idempotency_key is not None:
                query = select(JobRow).where(JobRow.idempotency_key == job.idempotency_key)
                earlier = session.scalars(query).one_or_none()
                if earlier is not None:
                    return _same_request(_job(earlier), job)
            session.add(
                JobRow(
                    id=job.id,
                    kind=job.kind,
                    state=job.state.value,
                    request=job.request,
                    created_utc=job.created_utc,
                    idempotency_key=job.idempotency_key,
                )
            )
        return job

    def has_key(self, idempotency_key: str) -> bool:
        """Return whether a job has this idempotency key."""
        with self._store.session() as session:
            query = select(JobRow.seq).where(JobRow.idempotency_key == idempotency_key)
            return session.scalars(query).first() is not None

    def save(self, job: Job) -> None:
        """Write the job's present state."""
        values = {
            "state": job.state.value,
            "started_utc": job.started_utc,
            "ended_utc": job.ended_utc,
            "done": job.done,
            "total": job.total,
            "note": job.note,
            "result_url": job.result_url,
            "problem": job.problem,
        }
        with self._store.session() as session:
            session.execute(update(JobRow).where(JobRow.id == job.id).values(**values))

    def get(self, job_id: str) -> Job:
        """Return one job or raise `NotFound`."""
        with self._store.session() as session:
            row = session.scalars(select(JobRow).where(JobRow.id == job_id)).one_or_none()
        if row is None:
            raise NotFound(f"there is no job {job_id}; see /api/v1/jobs for those there are", asked=job_id)
        return _job(row)

    def newest(self, limit: int) -> list[Job]:
        """Return the newest jobs, newest first."""
        with self._store.session() as session:
            rows = session.scalars(select(JobRow).order_by(JobRow.seq.desc()).limit(limit))
            return [_job(row) for row in rows]


def _same_request(earlier: Job, job: Job) -> Job:
    if earlier.kind != job.kind or earlier.request != job.request:
        raise InvalidInput(
            f"the idempotency key {job.idempotency_key} was used for another request (job {earlier.id})",
            asked=f"Idempotency-Key {job.idempotency_key}",
            found=f"already used by job {earlier.id} for another request",
            remedy="use a new key for a new request",
        )
    return earlier


def _job(row: JobRow) -> Job:
    return Job(
        id=row.id,
        kind=row.kind,
        request=row.request,
        state=JobState(row.state),
        created_utc=row.created_utc,
        started_utc=row.started_utc,
        ended_utc=row.ended_utc,
        done=row.done,
        total=row.total,
        note=row.note,
        result_url=row.result_url,
        problem=row.problem,
        idempotency_key=row.idempotency_key,
    )
