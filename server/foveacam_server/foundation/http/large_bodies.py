"""A route with a large body: its values are counted before it is parsed, and few persons send one at a time.

Parsing a body of 24 MiB of empty lists would block the event loop for a second and take 700 MB.
"""

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.http.answers import BODY_BYTES, server_places
from foveacam_server.foundation.persons.person_quota import PERSON

MOST_PARTS = 200_000
"""Most values, lists and objects of a body, counted by separators: a map of 10 000 corners has 60 000."""
_MARKS = (b",", b"[", b"{")


class LargeBodyRoute(APIRoute):
    """Route class that counts a large body on its person's limit while it is read and answered."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:  # Any: FastAPI's own
        """Return the handler of a request."""
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
    """Return whether the body is certainly small; a request that announces none has none (RFC 9112, 6.3)."""
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
