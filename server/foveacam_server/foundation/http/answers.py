"""Parts shared by routes: headers, limits of a body, the answer with a job, problems in OpenAPI."""

from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

from fastapi import Depends, Header, Query
from fastapi.responses import JSONResponse
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from foveacam_server.foundation.errors import MEDIA_TYPE
from foveacam_server.foundation.http.preferences import preferred_wait_s
from foveacam_server.foundation.job_table import Job, JobState
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.persons.person_quota import PERSON, ServerPlaces
from foveacam_server.foundation.schema import ResponseModel

JOBS_URL = "/api/v1/jobs"
LONGEST_WAIT_S = 60.0

MIB = 2**20
BODY_BYTES = MIB
"""Largest body of a route that does not name its own limit."""
FILE_BYTES = 4 * MIB
"""Largest body with a calibration file or a GeoJSON map: 100 times a calibration of 81 nodes."""
PICTURE_BYTES = 24 * MIB
"""Largest body with a picture in base64."""

LeaseHeader = Annotated[str | None, Header(alias="X-Lease", description="token of the control lease")]
PreferHeader = Annotated[
    str | None, Header(description="`wait=N`: answer with the result when it comes within N seconds")
]
IdempotencyHeader = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="the same key with the same request gives the same job",
    ),
]
Limit = Annotated[int, Query(ge=1, le=500)]

_TITLES = {
    400: "the body cannot be read; as plain text: the request is not HTTP",
    401: "sign in first, or send a token; as HTML, for a request of a page: where to sign in",
    403: "a right is missing, or the page or the name of this server is not allowed",
    404: "not found",
    409: "busy, stopped or not calibrated",
    413: "the body is too large",
    416: "the requested range is outside the file",
    422: "the request is invalid or out of range",
    429: "too many wrong tokens or passwords from this address, or the limit per person is reached",
    431: "line and headers are too large",
    502: "a device failed",
    503: "a device is not connected, or the server's limit is reached",
    504: "a device did not answer",
    507: "the disk is full",
}


async def server_places(connection: HTTPConnection) -> ServerPlaces:
    """Return the limits of connections and of long answers, for requests and for WebSockets."""
    found: ServerPlaces = connection.app.state.places
    return found


async def _hold_long_read(connection: HTTPConnection) -> AsyncIterator[None]:
    """Count a download or a check on its person's limit until its answer is sent."""
    with (await server_places(connection)).long_reads.hold(PERSON.get()):
        yield


async def _hold_event_stream(connection: HTTPConnection) -> AsyncIterator[None]:
    with (await server_places(connection)).events.hold(PERSON.get()):
        yield


LONG_READ = Depends(_hold_long_read)
"""Value of `dependencies` of routes that read whole datasets."""
EVENT_STREAM = Depends(_hold_event_stream)


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:  # Any: FastAPI's own type
    """Describe the problem documents that a route may answer, for OpenAPI."""
    return {
        status: {
            "description": _TITLES[status],
            "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}},
        }
        for status in statuses
    }


def file_responses(media_type: str) -> dict[int | str, dict[str, Any]]:  # Any: FastAPI's own type
    """Describe the answer of a route that sends a file, for OpenAPI."""
    schema = {"type": "string", "format": "binary"}
    return {200: {"content": {media_type: {"schema": schema}}, "description": "the file"}, **problems(404)}


async def job_answer(
    jobs: JobRunner, job: Job, *, prefer: str | None, result: Callable[[str], ResponseModel]
) -> JSONResponse:
    """Answer with the job (202); when it ends within the wait, with its result (200) or its problem.

    `result`: returns the result by its id.
    """
    wanted_s = preferred_wait_s(prefer, longest_s=LONGEST_WAIT_S)
    if wanted_s > 0.0:
        job = await jobs.ended(job.id, timeout_s=wanted_s)
    headers = {"Location": f"{JOBS_URL}/{job.id}"}
    if wanted_s > 0.0:
        headers["Preference-Applied"] = f"wait={wanted_s:g}"
        if job.state is JobState.SUCCEEDED and job.result_id is not None:
            found = await run_in_threadpool(result, job.result_id)
            return JSONResponse(found.as_json(), headers=headers)
        if job.state.ended and job.problem is not None:
            problem = job.problem.model_dump(exclude_unset=True) | {"instance": headers["Location"]}
            return JSONResponse(
                problem, status_code=job.problem.status, headers=headers, media_type=MEDIA_TYPE
            )
    return JSONResponse(job.describe().model_dump(mode="json"), status_code=202, headers=headers)
