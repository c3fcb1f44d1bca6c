"""Completes the OpenAPI document: the security schemes, and the answers of the middleware for every route."""

from typing import Any

from fastapi import FastAPI

from foveacam_server.console.security import COOKIE, OPEN_PATHS
from foveacam_server.foundation.answers import problems

_METHODS = ("get", "post", "put", "patch", "delete")
_WHERE_NEEDED = "Needed only where the server was started with a token."
_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": f"The token. {_WHERE_NEEDED}"},
    "token_header": {
        "type": "apiKey",
        "in": "header",
        "name": "X-API-Token",
        "description": f"The token. {_WHERE_NEEDED}",
    },
    "session": {
        "type": "apiKey",
        "in": "cookie",
        "name": COOKIE,
        "description": f"What a browser gets for signing in at `/`. {_WHERE_NEEDED}",
    },
}
_BEFORE_ROUTES = (400, 401, 403, 429)


def install(app: FastAPI, *, token_needed: bool) -> None:
    """Complete the document that `app` serves; it is built once, at the first request."""
    routes_alone = app.openapi

    def whole() -> dict[str, Any]:  # Any: a JSON document
        document = routes_alone()
        if "security" not in document:
            _complete(document, token_needed=token_needed)
        return document

    app.openapi = whole  # type: ignore[method-assign]  # FastAPI's own way to extend the document


def _complete(document: dict[str, Any], *, token_needed: bool) -> None:  # Any: a JSON document
    answers = problems(*_BEFORE_ROUTES)
    answers[400]["content"]["text/plain"] = {"schema": {"type": "string"}}
    answers[401]["content"]["text/html"] = {"schema": {"type": "string"}}
    components = document["components"]
    components["securitySchemes"] = _SCHEMES
    components["responses"] = {str(status): answer for status, answer in answers.items()}
    document["security"] = [{name: []} for name in _SCHEMES] + ([] if token_needed else [{}])
    for path, operations in document["paths"].items():
        for operation in (operations[method] for method in _METHODS if method in operations):
            for status in components["responses"]:
                operation["responses"].setdefault(status, {"$ref": f"#/components/responses/{status}"})
            if path in OPEN_PATHS:
                operation["security"] = []
