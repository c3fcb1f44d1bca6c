"""What can go wrong, as exceptions by whose move is next.

    ClientError
    ├── Unreachable          nobody answers at the address
    ├── UnexpectedAnswer     what answers is no server of this API, or one of another version
    ├── WaitTimeout          it has not come in the time that was given
    ├── LeaseLost            the control lease was taken over, has ended, or cannot be renewed
    └── ProblemError         the server said no (RFC 9457)
        ├── NotSignedIn      401: no token, or a wrong one
        ├── NotAllowed       403: the token lacks a right
        ├── NotFound         404
        ├── Conflict         409
        │   ├── RigBusy, RigStopped, RigNotCalibrated
        │   └── JobCancelled
        ├── InvalidRequest   400, 413, 422
        │   └── TargetOutOfRange
        ├── TooManyRequests  429, or 503 where all places are taken; `retry_after_s`
        ├── ServerFault      500
        ├── DeviceFailed     502
        ├── DeviceMissing    503
        ├── JobInterrupted   503: the server was restarted
        ├── DeviceTimeout    504
        └── DiskFull         507

A message is the server's own: what is wrong, and what to do.
"""

import httpx
from pydantic import ValidationError

from foveacam_client.generated.models import Problem


class ClientError(Exception):
    """Root of all errors of this package."""


class Unreachable(ClientError):
    """Nobody answers at the address."""


class UnexpectedAnswer(ClientError):
    """An answer that the API does not describe."""


class WaitTimeout(ClientError):
    """A job that has not ended in time and goes on, or a point cloud that has not come."""


class LeaseLost(ClientError):
    """The control lease that a block holds was taken over, has ended, or cannot be renewed; says why."""

    def __init__(self, why: str) -> None:
        super().__init__(f"the control lease is lost: {why}")


class ProblemError(ClientError):
    """A refusal or failure in the server's own words.

    `request_id`: what a proxy or the server wrote into X-Request-Id, if it did. `retry_after_s`: how long the
    server asks to wait.
    """

    def __init__(
        self, problem: Problem, *, request_id: str | None = None, retry_after_s: float | None = None
    ) -> None:
        self.problem = problem
        self.request_id = request_id
        self.retry_after_s = retry_after_s
        remedy = problem.remedy or ""
        told = () if remedy in problem.detail else (remedy,)
        super().__init__(" ".join((f"{problem.title}:", problem.detail, *told)))

    @property
    def title(self) -> str:
        """What kind of problem it is."""
        return self.problem.title

    @property
    def detail(self) -> str:
        """What is wrong."""
        return self.problem.detail

    @property
    def remedy(self) -> str | None:
        """What to do about it, where that is known."""
        return self.problem.remedy

    @property
    def status(self) -> int:
        """The HTTP status."""
        return self.problem.status

    @property
    def slug(self) -> str:
        """The stable name of the kind of problem, such as `out-of-range`."""
        return self.problem.type.rpartition("/")[2]


class NotSignedIn(ProblemError):
    """No token, or a wrong one."""


class NotAllowed(ProblemError):
    """The token lacks a right."""


class NotFound(ProblemError):
    """There is nothing of that name."""


class Conflict(ProblemError):
    """It cannot be done now."""


class RigBusy(Conflict):
    """Somebody else is using it."""


class RigStopped(Conflict):
    """The stop is engaged."""


class RigNotCalibrated(Conflict):
    """The rig has no calibration."""


class JobCancelled(Conflict):
    """The job was cancelled."""


class InvalidRequest(ProblemError):
    """The request cannot be used as it stands."""


class TargetOutOfRange(InvalidRequest):
    """The rig cannot look or move there."""


class TooManyRequests(ProblemError):
    """Too many wrong tokens came from here, or no place is free for one more of what was asked for."""


class ServerFault(ProblemError):
    """The server made a mistake."""


class DeviceFailed(ProblemError):
    """A device failed."""


class DeviceMissing(ProblemError):
    """A device is not connected."""


class JobInterrupted(ProblemError):
    """The server was restarted while the job ran; nobody goes on with it."""


class DeviceTimeout(ProblemError):
    """A device did not answer."""


class DiskFull(ProblemError):
    """The server's disk takes no more."""


_BY_SLUG: dict[str, type[ProblemError]] = {
    "busy": RigBusy,
    "stopped": RigStopped,
    "not-calibrated": RigNotCalibrated,
    "cancelled": JobCancelled,
    "interrupted": JobInterrupted,
    "out-of-range": TargetOutOfRange,
    "all-taken": TooManyRequests,
}
_BY_STATUS: dict[int, type[ProblemError]] = {
    400: InvalidRequest,
    401: NotSignedIn,
    403: NotAllowed,
    404: NotFound,
    409: Conflict,
    413: InvalidRequest,
    422: InvalidRequest,
    429: TooManyRequests,
    500: ServerFault,
    502: DeviceFailed,
    503: DeviceMissing,
    504: DeviceTimeout,
    507: DiskFull,
}


def error_of_problem(
    problem: Problem, *, request_id: str | None = None, retry_after_s: float | None = None
) -> ProblemError:
    """Return the exception of a problem document."""
    slug = problem.type.rpartition("/")[2]
    kind = _BY_SLUG.get(slug) or _BY_STATUS.get(problem.status, ProblemError)
    return kind(problem, request_id=request_id, retry_after_s=retry_after_s)


def error_of_answer(answer: httpx.Response) -> ClientError:
    """Return the exception of an answer that is no success and has been read."""
    try:
        problem = Problem.model_validate_json(answer.content, extra="ignore")
    except ValidationError:
        problem = _problem_of_status(answer)
    return error_of_problem(
        problem, request_id=answer.headers.get("X-Request-Id"), retry_after_s=retry_after_s(answer)
    )


def retry_after_s(answer: httpx.Response) -> float | None:
    """Return how long an answer asks to wait; None where it does not say so in seconds."""
    try:
        return max(0.0, float(answer.headers["Retry-After"]))
    except (KeyError, ValueError):
        return None


def _problem_of_status(answer: httpx.Response) -> Problem:
    """Return the problem of an answer without one, as a proxy gives it."""
    return Problem(
        type="about:blank",
        title=answer.reason_phrase or "Refused",
        status=answer.status_code,
        detail=f"{answer.request.method} {answer.request.url.path} was answered with {answer.status_code}"
        " and no explanation; the server, or a proxy before it, gave it.",
    )
