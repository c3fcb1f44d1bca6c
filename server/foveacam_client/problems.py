"""What can go wrong, as exceptions by whose move is next.

    ClientError
    ├── Unreachable          no server answers at the address
    ├── UnexpectedAnswer     not a server of this API, or one of another version
    ├── WaitTimeout          no result within the timeout
    ├── LeaseLost            the control lease was taken over, has ended, or cannot be renewed
    └── ProblemError         the server refused or failed (RFC 9457)
        ├── NotSignedIn      401: no token, or a wrong one
        ├── NotAllowed       403: the token lacks a right
        ├── NotFound         404
        ├── Conflict         409
        │   ├── RigBusy, RigStopped, RigNotCalibrated
        │   └── JobCancelled
        ├── InvalidRequest   400, 413, 422
        │   └── TargetOutOfRange
        ├── TooManyRequests  429, or 503 where the server's limit is reached; `retry_after_s`
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
    """No server answers at the address."""


class UnexpectedAnswer(ClientError):
    """An answer that does not conform to the API."""


class WaitTimeout(ClientError):
    """A timeout: a job that has not ended and continues, or a point cloud that was not computed."""


class LeaseLost(ClientError):
    """The control lease that a block holds was taken over, has ended, or cannot be renewed; says why."""

    def __init__(self, why: str) -> None:
        super().__init__(f"the control lease is lost: {why}")


class ProblemError(ClientError):
    """A refusal or failure in the server's own words.

    `request_id`: X-Request-Id of the answer, if any. `retry_after_s`: time to wait that the server requests.
    """

    def __init__(
        self, problem: Problem, *, request_id: str | None = None, retry_after_s: float | None = None
    ) -> None:
        self.problem = problem
        self.request_id = request_id
        self.retry_after_s = retry_after_s
        remedy = problem.remedy or ""
        advice = () if remedy in problem.detail else (remedy,)
        super().__init__(" ".join((f"{problem.title}:", problem.detail, *advice)))

    @property
    def title(self) -> str:
        """Title of the kind of problem."""
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
    """The resource does not exist."""


class Conflict(ProblemError):
    """The present state does not allow the request."""


class RigBusy(Conflict):
    """Somebody else is using the resource."""


class RigStopped(Conflict):
    """The stop is engaged."""


class RigNotCalibrated(Conflict):
    """The rig has no calibration."""


class JobCancelled(Conflict):
    """The job was cancelled."""


class InvalidRequest(ProblemError):
    """The request is invalid."""


class TargetOutOfRange(InvalidRequest):
    """The rig cannot look or move there."""


class TooManyRequests(ProblemError):
    """Too many wrong tokens from this address, or a limit is reached."""


class ServerFault(ProblemError):
    """Internal server error."""


class DeviceFailed(ProblemError):
    """A device failed."""


class DeviceMissing(ProblemError):
    """A device is not connected."""


class JobInterrupted(ProblemError):
    """The server was restarted while the job ran; the job is not continued."""


class DeviceTimeout(ProblemError):
    """A device did not answer."""


class DiskFull(ProblemError):
    """The server's disk is full."""


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
    """Return the exception of an unsuccessful answer whose body has been read."""
    try:
        problem = Problem.model_validate_json(answer.content, extra="ignore")
    except ValidationError:
        problem = _problem_of_status(answer)
    return error_of_problem(
        problem, request_id=answer.headers.get("X-Request-Id"), retry_after_s=retry_after_s(answer)
    )


def retry_after_s(answer: httpx.Response) -> float | None:
    """Return the seconds of an answer's Retry-After; None without it or in another form."""
    try:
        return max(0.0, float(answer.headers["Retry-After"]))
    except (KeyError, ValueError):
        return None


def _problem_of_status(answer: httpx.Response) -> Problem:
    """Return a problem for an answer without a problem document, as from a proxy."""
    return Problem(
        type="about:blank",
        title=answer.reason_phrase or "Refused",
        status=answer.status_code,
        detail=f"{answer.request.method} {answer.request.url.path} was answered with {answer.status_code}"
        " and no explanation; the server, or a proxy before it, gave it.",
    )
