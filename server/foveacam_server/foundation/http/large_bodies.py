"""A route whose body may be large: it is counted before it is parsed, and few persons send one at a time.

Parsed, a body of 24 MiB takes a second of the event loop and 700 MB, if it is all empty lists.
"""

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.http.answers import BODY_BYTES, server_places
from foveacam_server.foundation.persons.person_quota import PERSON

MOST_PARTS = 200_000
"""Values, lists and objects of a body, by the marks between them: a map of 10 000 corners has 60 000."""
_MARKS = (b",", b"[", b"{")


class LargeBodyRoute(APIRoute):
    """Holds a place while a body larger than usual is read and answered."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:  # Any: FastAPI's own
        """Return what serves a request."""
        handler = super().get_route_handler()

        async def counted(request: Request) -> Response:
            if _is_usual(request):
                return await handler(request)
            places = await server_places(request)
            with places.large_bodies.hold(PERSON.get()):
                check_parts(await request.body())
                return await handler(request)

        return counted


def _is_usual(request: Request) -> bool:
    """Return whether the body is surely small; a request that announces none has none (RFC 9112, 6.3)."""
    announced = request.headers.get("content-length")
    if announced is None:
        return "transfer-encoding" not in request.headers
    return announced.isdecimal() and int(announced) <= BODY_BYTES


def check_parts(body: bytes) -> None:
    """Raise InvalidInput for a JSON body of too many values."""
    parts = sum(body.count(mark) for mark in _MARKS)
    if parts > MOST_PARTS:
        raise InvalidInput(
            f"the body has {parts:,} values, lists and objects; {MOST_PARTS:,} are the most",
            asked=f"a body of {parts:,} values, lists and objects",
            found=f"a limit of {MOST_PARTS:,}",
            remedy="simplify it",
        )
