"""The OpenAPI document: built on a thread, and completed with the middleware's answers and credentials.

Building it takes seconds of computation, writing it as JSON tens of milliseconds; both are done once, on a
thread.
"""

import asyncio
import json
from typing import Any

from fastapi import FastAPI, Response
from fastapi.openapi.utils import get_openapi
from fastapi.routing import iter_route_contexts

from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import UNDECLARED, Access, GuardedRouter, declared_access
from foveacam_server.doors.closing import run_beside
from foveacam_server.doors.deferred_routes import built_routes
from foveacam_server.foundation.http.answers import problems

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
_BEFORE_ROUTES = (400, 401, 403, 429, 431, 503)
OPENAPI_PATH = "/openapi.json"


def install(app: FastAPI, *, token_needed: bool, root_path: str) -> None:
    """Complete the document of `app` and serve it; it is built once, at the first request."""
    if root_path:
        app.servers = [{"url": root_path}]

    def whole() -> dict[str, Any]:  # Any: a JSON document
        if app.openapi_schema is None:
            app.openapi_schema = _routes_document(app)
            _complete(app.openapi_schema, _access_of_operations(app), token_needed=token_needed)
        return app.openapi_schema

    app.openapi = whole  # type: ignore[method-assign]  # FastAPI's own way to extend the document
    app.include_router(_document_route(app))


def _routes_document(app: FastAPI) -> dict[str, Any]:  # Any: a JSON document
    """Return FastAPI's document of the routes; deferred routes are built for it."""
    return get_openapi(
        title=app.title,
        version=app.version,
        openapi_version=app.openapi_version,
        summary=app.summary,
        routes=list(built_routes(app.routes)),
        servers=app.servers,
    )


def _document_route(app: FastAPI) -> GuardedRouter:
    """Return the route of the document, as FastAPI's own would build it on the event loop."""
    router = GuardedRouter(reading=Right.VIEW, changing=Right.ADMINISTER, include_in_schema=False)
    building, built = asyncio.Lock(), list[bytes]()

    @router.get(OPENAPI_PATH)
    async def openapi() -> Response:
        async with building:
            if not built:
                built.append(await run_beside(lambda: json.dumps(app.openapi()).encode()))
        return Response(built[0], media_type="application/json")

    return router


def _access_of_operations(app: FastAPI) -> dict[tuple[str, str], Access]:
    """Return the access that each operation requires, by path and method in the document's spelling."""
    return {
        (route.path_format or "", method.lower()): declared_access(route.endpoint) or UNDECLARED
        for route in iter_route_contexts(app.routes)
        for method in route.methods or ()
    }


def _complete(
    document: dict[str, Any],  # Any: a JSON document
    operations_access: dict[tuple[str, str], Access],
    *,
    token_needed: bool,
) -> None:
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
            right = operations_access[path, method].right
            if right is None:
                operation["security"] = []
            else:
                operation["x-right"] = right.value
