"""ASGI middleware that sets the person of a request, and limits the open requests of one person."""

from starlette.types import ASGIApp, Receive, Scope, Send

from foveacam_server.accounts.requests import person_of
from foveacam_server.accounts.route_rights import Access
from foveacam_server.foundation.errors import AllTaken, PersonLimit, problem_of
from foveacam_server.foundation.persons.person_quota import PERSON, Places


class PersonRequests:
    """Comes after the access rules, which determine the principal.

    A stop is always served. WebSockets have separate limits.
    """

    def __init__(self, app: ASGIApp, *, places: Places) -> None:
        self._app, self._places = app, places

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        person = person_of(scope)
        PERSON.set(person)
        if scope["type"] == "websocket" or _is_stop(scope):
            await self._app(scope, receive, send)
            return
        try:
            self._places.take(person)
        except (AllTaken, PersonLimit) as refusal:
            await problem_of(refusal).response(instance=scope["path"])(scope, receive, send)
            return
        try:
            await self._app(scope, receive, send)
        finally:
            self._places.give_back(person)


def _is_stop(scope: Scope) -> bool:
    access: Access | None = scope["access"]  # of the route that the access rules found
    return access is not None and access.stops
