"""Schemas of faults, and of the events about changes of their list."""

from typing import Literal

from foveacam_server.foundation.schema import ResponseModel


class FaultDocument(ResponseModel):
    """A fault or warning with its count; `name`: which of the scope, such as a device or a kind of job.

    `present`: whether it lasts; an incident, such as a failed job, is over at once. `over_utc`: when it
    ended, null while it is present.
    """

    id: str
    level: Literal["warning", "error"]
    scope: str
    name: str
    what: str
    remedy: str | None
    first_utc: str
    last_utc: str
    count: int
    present: bool
    over_utc: str | None


class FaultsDismissed(ResponseModel):
    """The faults that were removed from the list."""

    ids: list[str]
