"""Answers every error of the web application with a problem document (RFC 9457)."""

import logging
from http import HTTPStatus
from typing import cast

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.errors import (
    INTERNAL,
    NOT_FOUND,
    RANGE_NOT_SATISFIABLE,
    ProblemDetails,
    ProblemType,
    problem_of,
    unreadable_problem,
    validation_problem,
)
from foveacam_server.foundation.watching.work_ids import request_header

_log = logging.getLogger(__name__)


def install(app: FastAPI) -> None:
    """Answer every error of the application with a problem document."""

    async def on_fovea_error(request: Request, error: Exception) -> JSONResponse:
        return problem_of(error).response(instance=request.url.path)

    async def on_os_error(request: Request, error: Exception) -> JSONResponse:
        problem = problem_of(error)
        if problem.kind is INTERNAL:
            raise error
        _log.warning("%s %s: %s", request.method, request.url.path, error)
        return problem.response(instance=request.url.path)

    async def on_http_error(request: Request, error: Exception) -> JSONResponse:
        known = cast(HTTPException, error)
        if known.status_code == HTTPStatus.BAD_REQUEST and known.__cause__ is not None:
            return unreadable_problem(known.__cause__).response(instance=request.url.path)
        headers = dict(known.headers or {})
        if "Allow" in headers:  # with the methods of one route of several at this address
            headers["Allow"] = _served(request)
        path = request.url.path
        problem = problem_of_status(known.status_code, path=path, method=request.method, headers=headers)
        return problem.response(instance=path)

    async def on_validation_error(request: Request, error: Exception) -> JSONResponse:
        failed = cast(RequestValidationError, error)
        return validation_problem(failed.errors(), body=failed.body).response(instance=request.url.path)

    async def on_anything(request: Request, error: Exception) -> JSONResponse:
        # Starlette re-raises the error after this answer, so that the server logs it once
        answer = problem_of(error).response(instance=request.url.path)
        answer.headers.update(request_header())  # this answer passes no middleware
        return answer

    app.add_exception_handler(FoveaError, on_fovea_error)
    app.add_exception_handler(OSError, on_os_error)
    app.add_exception_handler(HTTPException, on_http_error)
    app.add_exception_handler(RequestValidationError, on_validation_error)
    app.add_exception_handler(Exception, on_anything)


def _served(request: Request) -> str:
    """Return the methods for which a request's path has a route."""
    routes = request.app.routes
    found = [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in routes)
    ]
    return ", ".join(found + ["HEAD"] * ("GET" in found))


def nothing_served(*, path: str, method: str) -> ProblemDetails:
    """Return the problem of a path that no route has."""
    return ProblemDetails(
        kind=NOT_FOUND,
        detail=f"Nothing is served at {path}.",
        asked=f"{method} {path}",
        remedy="See /docs for what there is.",
    )


def problem_of_status(status: int, *, path: str, method: str, headers: dict[str, str]) -> ProblemDetails:
    """Return the problem for an HTTP status raised by the framework."""
    if status == HTTPStatus.NOT_FOUND:
        return nothing_served(path=path, method=method)
    if status == HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:
        size = headers.get("Content-Range", "").rpartition("/")[2]
        return ProblemDetails(
            kind=RANGE_NOT_SATISFIABLE,
            detail=f"{path} has {size} bytes, and none in that range.",
            asked=f"{method} {path}",
            found=f"{size} bytes",
            remedy="Ask for a range inside, or for the whole.",
            headers=headers,
        )
    phrase = HTTPStatus(status).phrase
    kind = ProblemType(slug=phrase.lower().replace(" ", "-"), status=status, title=phrase)
    allowed = headers.get("Allow")
    refused = status == HTTPStatus.METHOD_NOT_ALLOWED
    detail = f"{method} is not possible at {path}." if refused else f"{phrase}."
    return ProblemDetails(
        kind=kind,
        detail=detail,
        asked=f"{method} {path}",
        remedy=f"Use {allowed}." if allowed else None,
        headers=headers,
    )
