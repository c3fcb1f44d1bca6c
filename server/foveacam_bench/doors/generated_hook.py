"""A hook for Schemathesis: of pictures, files and streams only the headers are read."""

from typing import Any

import requests
import schemathesis

_WHOLE = ("application/json", "application/problem+json", "text/event-stream")
"""Answers that are read completely; `max-stream-events` ends the stream of events."""


@schemathesis.hook
def before_call(
    context: schemathesis.HookContext,
    case: schemathesis.Case[Any],
    kwargs: dict[str, Any],  # Any: the library's own
) -> None:
    """Let requests return as soon as the headers of the answer have arrived."""
    del context, case
    kwargs["hooks"] = {"response": _cut}


def _cut(response: requests.Response, **_options: object) -> None:
    if not response.headers.get("Content-Type", "").startswith(_WHOLE):
        response._content = b""  # noqa: SLF001  # otherwise the body is read, which may never end
        response.close()
