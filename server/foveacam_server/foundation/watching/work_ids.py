"""The ids of the request and the job for which the running code works.

They are context variables: `contextvars.copy_context` carries them to another thread.
"""

import re
from contextvars import ContextVar

from foveacam_server.foundation.names import new_id

REQUEST_ID: ContextVar[str | None] = ContextVar("request_id", default=None)
JOB_ID: ContextVar[str | None] = ContextVar("job_id", default=None)
REQUEST_HEADER = "X-Request-ID"
_SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def begin_request(asked: str | None) -> str:
    """Set and return the id of a request: the client's where it is a short, plain token, else a new one."""
    request_id = asked if asked is not None and _SAFE.fullmatch(asked) else new_id("req")
    REQUEST_ID.set(request_id)
    JOB_ID.set(None)
    return request_id


def request_header() -> dict[str, str]:
    """Return the header with the present request's id; empty outside of requests."""
    request_id = REQUEST_ID.get()
    return {} if request_id is None else {REQUEST_HEADER: request_id}
