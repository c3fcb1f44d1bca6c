"""A hook for Schemathesis: of pictures, files and streams only the headers are read."""

from typing import Any

import requests
import schemathesis

_WHOLE = ("application/json", "application/problem+json", "text/event-stream")
"""What is compared with the document; events end by Schemathesis' own setting."""


@schemathesis.hook
def before_call(
    context: schemathesis.HookContext,
    case: schemathesis.Case[Any],
    kwargs: dict[str, Any],  # Any: the library's own
) -> None:
    """Look at every answer as soon as its headers are there."""
    del context, case
    kwargs["hooks"] = {"response": _cut}


def _cut(response: requests.Response, **_options: object) -> None:
    if not response.headers.get("Content-Type", "").startswith(_WHOLE):
        response._content = b""  # noqa: SLF001  # else it is read to its end, which may never come
        response.close()
