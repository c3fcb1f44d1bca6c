"""Maps every error to an HTTP status and problem type (RFC 9457); no other module does.

The tree is drawn in `foveacam_hardware.contract.errors`; here each branch gets its slug and status.
`doors.error_handlers` answers requests with them. It imports no web framework, as the commands use it too.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    DeviceFault,
    FoveaError,
    InvalidInput,
    NotCalibrated,
    NotConnected,
    OutOfRange,
    Stopped,
    StorageFull,
    Timeout,
)
from foveacam_pipeline.storage.disk import disk_error_class, disk_fault, is_disk_exhausted
from foveacam_server.foundation.plain_words import PlainWords, explain_unreadable, explain_validation, shorten
from foveacam_server.foundation.schema import Problem

if TYPE_CHECKING:
    from starlette.responses import JSONResponse

MEDIA_TYPE = "application/problem+json"


class NotFound(FoveaError):
    """A resource that does not exist, or no longer exists."""

    code = "not_found"


class NotLookedAt(NotFound):
    """A place at which no fovea has looked yet, so that its depth is not known."""

    code = "not_looked_at"


class StaleView(FoveaError):
    """A view that no longer shows the look in which to measure."""

    code = "stale_view"


class EditedMeanwhile(FoveaError):
    """A file that somebody else changed since the client has seen it."""

    code = "edited_meanwhile"


class StillOpening(NotConnected):
    """Something that is still opening; retry after `wait_s`."""

    wait_s = 2


class WrongCredentials(FoveaError):
    """A wrong name, password, or invitation."""

    code = "wrong_credentials"


class TooManyAttempts(FoveaError):
    """Too many wrong passwords from an address or for an account; retry after `wait_s`."""

    code = "too_many_attempts"

    def __init__(self, statement: str, *, wait_s: float, asked: str, found: str, remedy: str) -> None:
        super().__init__(statement, asked=asked, found=found, remedy=remedy)
        self.wait_s = math.ceil(wait_s)


class PersonLimit(Busy):
    """A person has reached the limit per person of a limited resource; others are still served."""

    code = "person_limit"
    wait_s = 5


class AllTaken(Busy):
    """All persons together have reached the limit of a limited resource."""

    code = "all_taken"
    wait_s = 5


class Forbidden(FoveaError):
    """An operation that needs a right which its principal does not have."""

    code = "forbidden"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemType:
    """Slug, status and title of one branch of the error tree."""

    slug: str
    status: int
    title: str


INVALID_INPUT = ProblemType(slug="invalid-input", status=422, title="The request is invalid")
UNREADABLE = ProblemType(slug="unreadable-body", status=400, title="The body cannot be read")
UNREADABLE_PATH = ProblemType(slug="unreadable-path", status=400, title="The path cannot be read")
INTERNAL = ProblemType(slug="internal", status=500, title="Internal server error")
INTERRUPTED = ProblemType(slug="interrupted", status=503, title="The server was restarted")
TOO_MANY_TRIES = ProblemType(slug="too-many-tries", status=429, title="Too many wrong tokens")
TOO_LARGE = ProblemType(slug="content-too-large", status=413, title="The request is too large")
HEADERS_TOO_LARGE = ProblemType(slug="headers-too-large", status=431, title="The headers are too large")
RANGE_NOT_SATISFIABLE = ProblemType(
    slug="range-not-satisfiable", status=416, title="The requested range is outside the file"
)
NOT_FOUND = ProblemType(slug="not-found", status=404, title="Not found")
UNAUTHORIZED = ProblemType(slug="unauthorized", status=401, title="Sign in first")
FORBIDDEN_ORIGIN = ProblemType(slug="forbidden-origin", status=403, title="This page may not control the rig")

KINDS: dict[type[FoveaError], ProblemType] = {
    InvalidInput: INVALID_INPUT,
    OutOfRange: ProblemType(slug="out-of-range", status=422, title="Out of range"),
    NotCalibrated: ProblemType(slug="not-calibrated", status=409, title="The rig is not calibrated"),
    NotConnected: ProblemType(slug="not-connected", status=503, title="A device is not connected"),
    StorageFull: ProblemType(slug="storage-full", status=507, title="The disk is full"),
    Busy: ProblemType(slug="busy", status=409, title="Busy"),
    Stopped: ProblemType(slug="stopped", status=409, title="The stop is engaged"),
    Cancelled: ProblemType(slug="cancelled", status=409, title="Cancelled"),
    Timeout: ProblemType(slug="timeout", status=504, title="A device did not answer in time"),
    DeviceFault: ProblemType(slug="device-fault", status=502, title="A device failed"),
    NotFound: NOT_FOUND,
    NotLookedAt: ProblemType(slug="not-looked-at", status=404, title="The depth there is not known yet"),
    WrongCredentials: ProblemType(slug="wrong-credentials", status=401, title="Wrong credentials"),
    TooManyAttempts: ProblemType(slug="too-many-tries", status=429, title="Too many wrong passwords"),
    PersonLimit: ProblemType(slug="person-limit", status=429, title="Limit per person reached"),
    AllTaken: ProblemType(slug="all-taken", status=503, title="Server limit reached"),
    Forbidden: ProblemType(slug="forbidden", status=403, title="Permission denied"),
    EditedMeanwhile: ProblemType(
        slug="edited-meanwhile", status=409, title="Edited by somebody else in the meantime"
    ),
    StaleView: ProblemType(slug="stale-view", status=409, title="The view is out of date"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemDetails:
    """An RFC 9457 problem, without its `instance` URL."""

    kind: ProblemType
    detail: str
    asked: str | None = None
    found: str | None = None
    remedy: str | None = None
    headers: dict[str, str] = field(default_factory=dict)

    def document(self, *, instance: str | None = None) -> Problem:
        """Return REST's document of the problem; unknown parts are not set."""
        parts = {"asked": self.asked, "found": self.found, "remedy": self.remedy}
        known = {name: _sendable(shorten(value)) for name, value in parts.items() if value is not None}
        if instance is not None:
            known["instance"] = _sendable(instance)
        return Problem(
            type=f"/problems/{self.kind.slug}",
            title=self.kind.title,
            status=self.kind.status,
            detail=_sendable(shorten(self.detail)),
            **known,
        )

    def response(self, *, instance: str | None = None) -> "JSONResponse":
        """Return the problem as an HTTP response."""
        from starlette.responses import JSONResponse

        return JSONResponse(
            self.document(instance=instance).model_dump(exclude_unset=True),
            status_code=self.kind.status,
            media_type=MEDIA_TYPE,
            headers=self.headers or None,
        )


def _sendable(text: str) -> str:
    """Return text without lone surrogates, which UTF-8 cannot encode; a problem may quote a request."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


_PASSING = (TooManyAttempts, StillOpening, PersonLimit, AllTaken)
"""Errors with a time to wait, which is sent as Retry-After."""


def problem_of(error: BaseException) -> ProblemDetails:
    """Return the problem document of `error`; an unexpected error shows no details."""
    if isinstance(error, OSError) and is_disk_exhausted(error):
        error = _of_full_disk(error)
    for branch in type(error).__mro__:
        kind = KINDS.get(branch)
        if kind is not None and isinstance(error, FoveaError):
            return ProblemDetails(
                kind=kind,
                detail=str(error),
                asked=error.asked,
                found=error.found,
                remedy=error.remedy,
                headers={"Retry-After": str(error.wait_s)} if isinstance(error, _PASSING) else {},
            )
    return ProblemDetails(
        kind=INTERNAL,
        detail="The server met an error that it did not foresee; the cause is in its log.",
        remedy="Try again; when it stays, report it together with the log.",
    )


def translate_error(error: Exception) -> FoveaError | None:
    """Return a `FoveaError` for an error of the system or of a file's encoding; None for any other.

    The last resort for errors that no narrower place has translated: the operation is unknown here.
    """
    if isinstance(error, OSError):
        named = "" if error.filename is None else f"{os.fsdecode(error.filename)}: "
        kind = disk_error_class(error)
        return kind(
            f"{named}{error.strerror or error}; check the path, its permissions, and the disk or device"
        )
    if isinstance(error, UnicodeError):
        return InvalidInput(f"text that is not UTF-8: {error}; check names and files that were given")
    return None


def _of_full_disk(error: OSError) -> FoveaError:
    """Return the error of a full disk for an unknown operation."""
    if error.filename is not None:
        path = Path(os.fsdecode(error.filename))
        return disk_fault(error, what=path.name, folder=path.parent)
    return StorageFull(
        f"what was asked could not be written: {error.strerror}",
        found=error.strerror,
        remedy="free some space on the server's disks, then try again",
    )


def validation_problem(
    errors: Sequence[Any], *, body: object = None
) -> ProblemDetails:  # Any: pydantic's own
    """Return the problem of a request that does not fit its model: field, value, what is allowed.

    `body`: text of a body that is not JSON.
    """
    return _of_words(INVALID_INPUT, explain_validation(errors, body=body))


def unreadable_problem(cause: BaseException) -> ProblemDetails:
    """Return the problem of a body that cannot be parsed: the fault and its position."""
    return _of_words(UNREADABLE, explain_unreadable(cause))


def _of_words(kind: ProblemType, words: PlainWords) -> ProblemDetails:
    return ProblemDetails(
        kind=kind, detail=words.detail, asked=words.asked, found=words.found, remedy=words.remedy
    )
