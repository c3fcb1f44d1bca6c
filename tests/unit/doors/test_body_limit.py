import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import APIRouter, FastAPI, Request

from foveacam_server.doors.middleware import HEADER_BYTES, FrameworkProblems, HeaderLimit
from foveacam_server.foundation.http.answers import BODY_BYTES, FILE_BYTES


@pytest.fixture
def app() -> FastAPI:
    router = APIRouter()

    async def count(request: Request) -> int:
        return len(await request.body())

    router.post("/small")(count)
    router.post("/file", max_body_size=FILE_BYTES)(count)
    app = FastAPI()
    app.add_middleware(FrameworkProblems)
    app.add_middleware(HeaderLimit)
    app.include_router(router, max_body_size=BODY_BYTES)
    return app


def _post(
    app: FastAPI, path: str, *, size: int, chunked: bool = False, headers: dict[str, str] | None = None
) -> httpx.Response:
    async def pieces() -> AsyncIterator[bytes]:
        for begin in range(0, size, 65_536):
            yield bytes(min(65_536, size - begin))

    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            return await client.post(path, content=pieces() if chunked else bytes(size), headers=headers)

    return asyncio.run(ask())


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_beyond_the_limit_is_a_problem_that_names_both_sizes(app: FastAPI, chunked: bool) -> None:
    answer = _post(app, "/small", size=3 * BODY_BYTES, chunked=chunked)

    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["type"] == "/problems/content-too-large"
    assert "at most 1 MiB" in problem["detail"]
    assert ("more than 1 MiB" if chunked else "3.0 MiB") in problem["detail"]


def test_a_route_may_take_more_than_the_others(app: FastAPI) -> None:
    assert _post(app, "/file", size=FILE_BYTES).json() == FILE_BYTES
    refused = _post(app, "/file", size=FILE_BYTES + 1)
    assert refused.status_code == 413 and "at most 4 MiB" in refused.json()["detail"]


def test_a_body_at_the_limit_is_taken(app: FastAPI) -> None:
    assert _post(app, "/small", size=BODY_BYTES).json() == BODY_BYTES


def test_headers_and_an_address_beyond_the_limit_are_a_problem(app: FastAPI) -> None:
    long = "a" * HEADER_BYTES
    for refused in (
        _post(app, "/small", size=1, headers={"x-long": long}),
        _post(app, f"/small?{long}", size=1),
        _post(app, "/small", size=1, headers={f"x-{number}": "many" for number in range(2000)}),
    ):
        assert refused.status_code == 431
        assert refused.json()["type"] == "/problems/headers-too-large"
        assert "at most 16384 are taken" in refused.json()["detail"]
    assert _post(app, "/small", size=1, headers={"x-long": "a" * (HEADER_BYTES - 1000)}).json() == 1
