"""The OpenAPI document: built beside the event loop, completed by what the middleware answers and asks for.

Building it takes seconds of computation, writing it as JSON tens of milliseconds; both are done once, on a
thread.
"""

import asyncio
import json
from typing import Any

from fastapi import APIRouter, FastAPI, Response

from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.route_rights import OPEN_CALLS, OPEN_PATHS, needed_right
from foveacam_server.doors.closing import run_beside
from foveacam_server.foundation.answers import problems

_METHODS = ("get", "post", "put", "patch", "delete")
_WHERE_NEEDED = "Needed only where the server has users, or was started with a token."
_TOKEN = f"The token of a service, or the shared one. {_WHERE_NEEDED}"
_SCHEMES = {
    "bearer": {
        "type": "http",
        "scheme": "bearer",
        "description": _TOKEN,
    },
    "token_header": {
        "type": "apiKey",
        "in": "header",
        "name": "X-API-Token",
        "description": _TOKEN,
    },
    "session": {
        "type": "apiKey",
        "in": "cookie",
        "name": COOKIE,
        "description": f"What a browser gets for signing in at `/`. {_WHERE_NEEDED}",
    },
}
_BEFORE_ROUTES = (400, 401, 403, 429, 431)
OPENAPI_PATH = "/openapi.json"


def install(app: FastAPI, *, token_needed: bool, root_path: str) -> None:
    """Complete the document of `app` and serve it; it is built once, at the first request."""
    routes_alone = app.openapi
    if root_path:
        app.servers = [{"url": root_path}]

    def whole() -> dict[str, Any]:  # Any: a JSON document
        document = routes_alone()
        if "security" not in document:
            _complete(document, token_needed=token_needed)
        return document

    app.openapi = whole  # type: ignore[method-assign]  # FastAPI's own way to extend the document
    app.include_router(_document_route(app))


def _document_route(app: FastAPI) -> APIRouter:
    """Return the route of the document; FastAPI's own builds it on the event loop."""
    router, building = APIRouter(), asyncio.Lock()
    built: list[bytes] = []

    @router.get(OPENAPI_PATH, include_in_schema=False)
    async def openapi() -> Response:
        async with building:
            if not built:
                built.append(await run_beside(lambda: json.dumps(app.openapi()).encode()))
        return Response(built[0], media_type="application/json")

    return router


def _complete(document: dict[str, Any], *, token_needed: bool) -> None:  # Any: a JSON document
    answers = problems(*_BEFORE_ROUTES)
    answers[400]["content"]["text/plain"] = {"schema": {"type": "string"}}
    answers[401]["content"]["text/html"] = {"schema": {"type": "string"}}
    components = document["components"]
    components["securitySchemes"] = _SCHEMES
    components["responses"] = {str(status): answer for status, answer in answers.items()}
    document["security"] = [{name: []} for name in _SCHEMES] + ([] if token_needed else [{}])
    for path, operations in document["paths"].items():
        for method in (method for method in _METHODS if method in operations):
            operation = operations[method]
            for status in components["responses"]:
                operation["responses"].setdefault(status, {"$ref": f"#/components/responses/{status}"})
            if path in OPEN_PATHS or (method.upper(), path) in OPEN_CALLS:
                operation["security"] = []
            else:
                operation["x-right"] = needed_right("http", method.upper(), path).value
