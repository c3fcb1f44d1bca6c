import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import FileResponse, StreamingResponse
from sse_starlette import EventSourceResponse
from tests.support.servers.local_server import serving

from foveacam_server.doors import error_handlers
from foveacam_server.doors.middleware import HeadRequests

PATIENCE_S = 10.0
made: list[str] = []


@pytest.fixture
def app(tmp_path: Path) -> FastAPI:
    made.clear()
    (tmp_path / "file").write_bytes(bytes(1_000_000))
    app = FastAPI()
    error_handlers.install(app)
    app.add_middleware(HeadRequests)

    async def endless() -> AsyncIterator[str]:
        while True:
            made.append("part")
            yield "part\n"
            await asyncio.sleep(0.01)

    @app.get("/document")
    async def document() -> dict[str, str]:
        return {"what": "a document"}

    @app.get("/file")
    async def file() -> FileResponse:
        return FileResponse(tmp_path / "file")

    @app.get("/stream")
    async def stream() -> StreamingResponse:
        return StreamingResponse(endless(), media_type="text/plain", headers={"X-Stream": "yes"})

    @app.get("/events")
    async def events() -> EventSourceResponse:
        return EventSourceResponse(endless())

    @app.post("/order")
    async def order() -> None:
        made.append("order")

    return app


@pytest.mark.parametrize("path", ["/document", "/file"])
def test_head_answers_with_the_headers_of_get_and_no_body(app: FastAPI, path: str) -> None:
    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http:
        got, headers_alone = http.get(path), http.head(path)
        again = http.get(path)  # on the same connection
    assert headers_alone.status_code == 200
    assert headers_alone.content == b""
    volatile = {"date"}
    assert {k: v for k, v in headers_alone.headers.items() if k not in volatile} == {
        k: v for k, v in got.headers.items() if k not in volatile
    }
    assert again.content == got.content


@pytest.mark.parametrize("path", ["/stream", "/events"])
def test_head_of_a_stream_ends_at_once_and_makes_nothing_of_it(app: FastAPI, path: str) -> None:
    with serving(app) as port:
        answer = httpx.head(f"http://127.0.0.1:{port}{path}", timeout=PATIENCE_S, trust_env=False)
    assert answer.status_code == 200
    assert answer.content == b""
    assert made == []


def test_head_does_nothing_where_there_is_no_get(app: FastAPI) -> None:
    with serving(app) as port:
        refused = httpx.head(f"http://127.0.0.1:{port}/order", trust_env=False)
        missing = httpx.head(f"http://127.0.0.1:{port}/nothing", trust_env=False)
        put = httpx.put(f"http://127.0.0.1:{port}/document", trust_env=False)
    assert (refused.status_code, refused.content) == (405, b"")
    assert missing.status_code == 404
    assert put.headers["allow"] == "GET, HEAD"
    assert made == []
