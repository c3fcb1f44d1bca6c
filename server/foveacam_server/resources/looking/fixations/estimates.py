"""Reports estimates of the distances of running fixations, by events and on request."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.names import age_s
from foveacam_server.resources.looking.fixations.answer_words import estimate_words
from foveacam_server.resources.looking.fixations.documents import describe_estimate
from foveacam_server.resources.looking.fixations.schema import FixationEstimate

Report: TypeAlias = Callable[[DistanceEstimate], None]
"""Callback that receives a newer estimate of one fixation."""


class FixationEstimates:
    """The newest estimate of each running fixation; callable from any thread."""

    def __init__(self, events: EventLog) -> None:
        self._events = events
        self._lock = threading.Lock()
        self._newest: dict[str, FixationEstimate] = {}

    @contextmanager
    def reporting(self, fixation_id: str, job: Job) -> Iterator[Report]:
        """Yield the function that reports a fixation's estimates; on exit its estimate is dropped."""

        def report(estimate: DistanceEstimate) -> None:
            elapsed_ms = 1e3 * age_s(job.created_utc)
            found = describe_estimate(estimate, fixation_id=fixation_id, job_id=job.id, elapsed_ms=elapsed_ms)
            self._put(found)
            self._events.emit("fixation.estimate", estimate_words(found), data=found)

        self._put(FixationEstimate(fixation_id=fixation_id, job_id=job.id, step=0, elapsed_ms=0.0))
        try:
            yield report
        finally:
            with self._lock:
                del self._newest[fixation_id]

    def newest(self) -> list[FixationEstimate]:
        """Return the newest estimate of each running fixation."""
        with self._lock:
            return list(self._newest.values())

    def find(self, fixation_id: str) -> FixationEstimate | None:
        """Return the newest estimate of a fixation; None when it is not running."""
        with self._lock:
            return self._newest.get(fixation_id)

    def _put(self, estimate: FixationEstimate) -> None:
        with self._lock:
            self._newest[estimate.fixation_id] = estimate
