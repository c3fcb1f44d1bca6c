"""Schemas of the stop."""

from foveacam_server.foundation.schema import ResponseModel


class StopDocument(ResponseModel):
    """Whether the stop is engaged."""

    engaged: bool
    since_utc: str | None
    by: str | None


class StopAnswer(ResponseModel):
    """The stop is engaged; `parked` tells whether the mirrors' controller confirmed, after `parked_in_ms`."""

    engaged: bool
    parked: bool
    parked_in_ms: float
