"""What is known of a job while it is waited for; knows no connection."""

import time
from collections.abc import Callable

from foveacam_client.generated import models
from foveacam_client.problems import UnexpectedAnswer, WaitTimeout, error_of_problem

OnProgress = Callable[[models.JobProgress], None]
"""Takes how far a job has come; `eta_s`: the time left, None where it is not known."""

_ENDED = ("succeeded", "failed", "cancelled")


class JobWatch:
    """The newest state of one job, until `timeout_s` are over."""

    def __init__(
        self,
        job_id: str,
        *,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.job_id = job_id
        self.job: models.JobDocument | None = None
        self._timeout_s = timeout_s
        self._on_progress = on_progress
        self._clock_s = clock_s
        self._began_s = clock_s()

    @property
    def ended(self) -> bool:
        """Whether the job has ended."""
        return self.job is not None and self.job.state in _ENDED

    def left_s(self, at_most_s: float) -> float:
        """Return how long may still be waited, at most `at_most_s`; raise `WaitTimeout` when time is over."""
        if self._timeout_s is None:
            return at_most_s
        left_s = self._timeout_s - (self._clock_s() - self._began_s)
        if left_s <= 0.0 and not self.ended:
            raise WaitTimeout(
                f"job {self.job_id} has not ended in {self._timeout_s:g} s; it goes on:"
                " wait longer, or cancel it"
            )
        return min(at_most_s, left_s)

    def update(self, job: models.JobDocument) -> None:
        """Take a newer state of the job."""
        told = self.job is None or job.progress != self.job.progress
        self.job = job
        if told and self._on_progress is not None:
            self._on_progress(job.progress)

    def hear(self, event: models.EventDocument | None) -> None:
        """Take an event; those of other things change nothing."""
        if event is not None and event.kind == "job.updated" and event.data.get("id") == self.job_id:
            self.update(models.JobDocument.model_validate(event.data, extra="ignore"))

    def result_url(self) -> str:
        """Return the address of the result; raise the problem of a job that failed or was cancelled."""
        if self.job is not None and self.job.problem is not None:
            raise error_of_problem(self.job.problem)
        if self.job is None or self.job.result_url is None:
            raise UnexpectedAnswer(f"job {self.job_id} has neither a result nor a problem")
        return self.job.result_url
