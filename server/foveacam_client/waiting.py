"""State of a wait for a job or a point cloud, independent of a connection."""

import time
from collections.abc import Callable
from typing import Protocol

from foveacam_client.generated import models
from foveacam_client.problems import UnexpectedAnswer, WaitTimeout, error_of_problem

OnProgress = Callable[[models.JobProgress], None]
"""Callback of a job's progress; `eta_s`: the time left, None where unknown."""

_ENDED = ("succeeded", "failed", "cancelled")


class Watch(Protocol):
    """Something to wait for."""

    @property
    def ended(self) -> bool:
        """Whether the wait is over."""
        ...

    def process(self, event: models.EventDocument | None) -> None:
        """Process an event; one about something else has no effect."""
        ...


class Deadline:
    """Timeout of a wait; None: unlimited."""

    def __init__(
        self, timeout_s: float | None, *, late: str, clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._timeout_s = timeout_s
        self._late = late
        self._clock_s = clock_s
        self._began_s = clock_s()

    def left_s(self, at_most_s: float) -> float:
        """Return the remaining time, at most `at_most_s`; raise `WaitTimeout` when it is over."""
        if self._timeout_s is None:
            return at_most_s
        left_s = self._timeout_s - (self._clock_s() - self._began_s)
        if left_s <= 0.0:
            raise WaitTimeout(f"nothing after {self._timeout_s:g} s: {self._late}")
        return min(at_most_s, left_s)


class JobWatch:
    """The newest state of one job."""

    def __init__(self, job_id: str, *, on_progress: OnProgress | None = None) -> None:
        self.job_id = job_id
        self.job: models.JobDocument | None = None
        self._on_progress = on_progress

    @property
    def ended(self) -> bool:
        """Whether the job has ended."""
        return self.job is not None and self.job.state in _ENDED

    def update(self, job: models.JobDocument) -> None:
        """Store a newer state of the job."""
        changed = self.job is None or job.progress != self.job.progress
        self.job = job
        if changed and self._on_progress is not None:
            self._on_progress(job.progress)

    def process(self, event: models.EventDocument | None) -> None:
        """Process an event; one about something else has no effect."""
        if event is not None and event.kind == "job.updated" and event.data.get("id") == self.job_id:
            self.update(models.JobDocument.model_validate(event.data, extra="ignore"))

    def result_url(self) -> str:
        """Return the address of the result; raise the problem of a job that failed or was cancelled."""
        if self.job is not None and self.job.problem is not None:
            raise error_of_problem(self.job.problem)
        if self.job is None or self.job.result_url is None:
            raise UnexpectedAnswer(f"job {self.job_id} has neither a result nor a problem")
        return self.job.result_url


class EstimateWatch:
    """Estimates of the distance of one fixation until it ends."""

    def __init__(self, job_id: str) -> None:
        self._job = JobWatch(job_id)

    def has_ended(self) -> bool:
        """Return whether the fixation has ended."""
        return self._job.ended

    def update(self, job: models.JobDocument) -> None:
        """Store a newer state of the job."""
        self._job.update(job)

    def process(self, event: models.EventDocument) -> models.FixationEstimate | None:
        """Process an event; return its estimate of this fixation, if any."""
        self._job.process(event)
        if event.kind != "fixation.estimate" or event.data.get("job_id") != self._job.job_id:
            return None
        return models.FixationEstimate.model_validate(event.data, extra="ignore")


class CloudWatch:
    """The point cloud of a fixation, as soon as there is one."""

    def __init__(self, fixation: models.FixationDocument) -> None:
        self.fixation_id = fixation.id
        self.cloud_id = fixation.cloud_id

    @property
    def ended(self) -> bool:
        """Whether there is a cloud."""
        return self.cloud_id is not None

    def process(self, event: models.EventDocument | None) -> None:
        """Process an event; one about something else has no effect."""
        if (
            event is not None
            and event.kind == "cloud.created"
            and event.data.get("fixation_id") == self.fixation_id
        ):
            self.cloud_id = str(event.data["id"])
