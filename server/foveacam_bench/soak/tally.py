"""Outcomes of a soak: answers, jobs, and times of clicks."""

from collections import Counter
from dataclasses import dataclass, field

import httpx

from foveacam_bench.soak.soaked_server import SoakedServer
from foveacam_client.document import JsonObject


@dataclass(slots=True)
class SoakTally:
    """Counts of one soak."""

    done: Counter[str] = field(default_factory=Counter)
    """Activities by name."""
    unexpected: Counter[str] = field(default_factory=Counter)
    """Unexpected answers and ends of jobs, by activity and status."""
    jobs: set[str] = field(default_factory=set)
    """Identifiers of all jobs that were accepted."""
    click_ms: list[float] = field(default_factory=list)

    def expect(self, activity: str, answer: httpx.Response, *statuses: int) -> bool:
        """Return whether an answer has one of the expected statuses, and count it if not."""
        if answer.status_code in statuses:
            return True
        self.unexpected[f"{activity}: {answer.status_code} {answer.text[:200]}"] += 1
        return False


def run_job(
    tally: SoakTally, server: SoakedServer, activity: str, path: str, body: object, *, states: set[str]
) -> JsonObject | None:
    """Start a job, wait until it has ended, and return it; count an end in another state as unexpected."""
    answer = server.send("POST", path, body)
    if not tally.expect(activity, answer, 202):
        return None
    job_id = answer.json()["id"]
    tally.jobs.add(job_id)
    server.wait_until(lambda: _has_ended(server, job_id), f"the end of {job_id}")
    job = dict(server.get(f"/jobs/{job_id}"))
    if job["state"] not in states:
        tally.unexpected[f"{activity}: {job['state']} {job['problem']}"] += 1
    return job


def count_lost_jobs(tally: SoakTally, server: SoakedServer) -> int:
    """Return how many accepted jobs the server does not know, or has not ended."""
    return sum(not _has_ended(server, job_id) for job_id in tally.jobs)


def _has_ended(server: SoakedServer, job_id: str) -> bool:
    answer = server.send("GET", f"/jobs/{job_id}")
    return answer.status_code == 200 and answer.json()["ended_utc"] is not None
