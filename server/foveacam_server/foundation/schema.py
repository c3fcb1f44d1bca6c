"""Base models of requests and responses, and the schemas of jobs, events, the lease and problems.

Requests are strict: a string is not taken as a number; NaN and unknown keys are refused.
"""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from foveacam_server.foundation.quantities import Label


class RequestModel(BaseModel):
    """Base class of requests."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    def as_json(self) -> dict[str, Any]:  # Any: a JSON object
        """Return it as a JSON object with all its fields."""
        return self.model_dump(mode="json")


class ResponseModel(BaseModel):
    """Base class of answers and of the data of events."""

    model_config = ConfigDict(extra="forbid")

    def as_json(self) -> dict[str, Any]:  # Any: a JSON object
        """Return it as a JSON object; fields that were never set are left out."""
        return self.model_dump(mode="json", exclude_unset=True)


class Problem(BaseModel):
    """An error (RFC 9457); `asked`, `found` and `remedy` are set when known."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None = None
    asked: str | None = None
    found: str | None = None
    remedy: str | None = None


class LeaseRequest(RequestModel):
    """Name of the client that takes the lease."""

    holder: Label
    take_over: bool = False
    reason: Label | None = None
    """Reason for taking it over from another person; required where people sign in."""


class LeaseAnswer(RequestModel):
    """The holder's answer to a request for the lease."""

    hand_over: bool


class LeaseWish(RequestModel):
    """Name of the client that requests the lease from its holder."""

    holder: Label


class JobProgress(ResponseModel):
    """Progress of a job: `done` of `total`."""

    done: int
    total: int
    eta_s: float | None
    note: str


class JobDocument(ResponseModel):
    """A job: long work that a request started."""

    id: str
    kind: str
    state: Literal["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]
    created_utc: str
    started_utc: str | None
    ended_utc: str | None
    progress: JobProgress
    result_url: str | None
    problem: Problem | None


class EventDocument(ResponseModel):
    """An event."""

    id: int
    kind: str
    level: Literal["info", "warning", "error"]
    t_utc: str
    message: str
    data: dict[str, Any]  # Any: depends on the kind


class ItemId(ResponseModel):
    """Data of an event about one item of a collection."""

    id: str


class StorageFault(ResponseModel):
    """Data of the event that events cannot be written to the disk."""

    detail: str
    remedy: str


class LeaseChange(ResponseModel):
    """Data of the event that the control lease changed hands; null: nobody."""

    holder: str | None
    before: str | None


class LeaseAsked(ResponseModel):
    """Data of the event that the control lease is requested, or no longer; null: nobody requests it."""

    asked_by: str | None


class LeaseGrant(ResponseModel):
    """The granted lease; its token goes into the X-Lease header."""

    token: str
    holder: str
    expires_in_s: float


class LeaseDocument(ResponseModel):
    """The holder of the control lease; null: nobody, and anybody may move."""

    holder: str | None
    expires_in_s: float | None
    person: str | None = None
    """User or service that holds it; null where nobody signs in."""
    idle_s: float | None = None
    """Time since the holder's last move."""
    asked_by: str | None = None
    """Client that requests it from the holder."""


class TrashEmptied(ResponseModel):
    """Number of items that were deleted from the trash."""

    deleted: int
