"""CORS for the listed origins: lets their pages read this server's answers, by Starlette's middleware.

The rights of such a page depend on its credentials, as for everybody: the access rules come after it.
"""

from starlette.datastructures import Headers
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")
_ASKED = (
    "Authorization", "X-Api-Token", "X-Lease", "X-Request-ID", "Idempotency-Key", "Prefer", "Last-Event-ID",
    "If-None-Match", "Range", "traceparent",
)  # fmt: skip
"""Request headers that such a page may send."""
_ANSWERED = (
    "Location", "Retry-After", "ETag", "Content-Disposition", "Content-Range", "Preference-Applied", "Allow",
    "X-Request-ID", "X-Frame-Seq", "X-Frame-Time-Ns",
)  # fmt: skip
"""Response headers that such a page may read."""


class ListedOrigins:
    """ASGI middleware: answers preflights of the listed origins, and names the origin in the answers to them.

    Requests of all other origins pass unchanged, and get no CORS headers.
    """

    def __init__(self, app: ASGIApp, *, origins: frozenset[str]) -> None:
        self._app = app
        self._origins = origins
        self._cors = CORSMiddleware(
            app,
            allow_origins=origins,
            allow_methods=_METHODS,
            allow_headers=_ASKED,
            allow_credentials=True,
            allow_private_network=True,
            expose_headers=_ANSWERED,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        listed = scope["type"] == "http" and Headers(scope=scope).get("origin") in self._origins
        await (self._cors if listed else self._app)(scope, receive, send)
