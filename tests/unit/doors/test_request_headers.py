"""The headers Prefer and Range, in every form that RFC 7240 and RFC 9110 allow."""

from collections.abc import Iterator

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import FileResponse, PlainTextResponse
from tests.support.servers.local_server import serving

from foveacam_server.doors import error_handlers
from foveacam_server.doors.middleware import FrameworkProblems
from foveacam_server.doors.request_headers import RequestHeaders
from foveacam_server.foundation.http.answers import PreferHeader
from foveacam_server.foundation.http.preferences import preferences_of, preferred_wait_s

CONTENT = bytes(range(100))


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    path = tmp_path_factory.mktemp("files") / "file"
    path.write_bytes(CONTENT)
    app = FastAPI()
    error_handlers.install(app)
    app.add_middleware(FrameworkProblems)
    app.add_middleware(RequestHeaders)

    @app.get("/file")
    async def file() -> FileResponse:
        return FileResponse(path)

    @app.get("/prefer")
    async def prefer(prefer: PreferHeader = None) -> str | None:
        return prefer

    @app.get("/plain")
    async def plain() -> PlainTextResponse:
        return PlainTextResponse("no", status_code=400)

    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        yield client


@pytest.mark.parametrize(
    ("prefer", "wait_s"),
    [
        ("wait=2", 2.0),
        ("WAIT=2", 2.0),
        ('wait="2"', 2.0),
        ("Wait = 2.5", 2.5),
        ("respond-async, wait=2", 2.0),
        ('handling=lenient; note="a, wait=9", wait=2; of="x"', 2.0),
        ("wait=2, wait=9", 2.0),
        (", wait=2,", 2.0),
        ("wait=600", 60.0),
        (r'wait="\2"', 2.0),
        ("wait", 0.0),
        ("wait=soon", 0.0),
        ("wait=-2", 0.0),
        ("wait=2s", 0.0),
        ("await=2", 0.0),
        ('note="wait=2"', 0.0),
        ('wait="2', 0.0),
        ("", 0.0),
    ],
)
def test_a_wait_is_read_in_every_form_of_rfc_7240(prefer: str, wait_s: float) -> None:
    assert preferred_wait_s(prefer, longest_s=60.0) == wait_s


def test_preferences_may_come_in_several_lines(http: httpx.Client) -> None:
    lines = [("Prefer", "respond-async"), ("Prefer", "wait=2"), ("Range", "bytes=0-1")]
    joined = http.get("/prefer", headers=lines).json()
    assert preferences_of(joined) == {"respond-async": "", "wait": "2"}


@pytest.mark.parametrize(
    "ranges",
    [
        "x",
        "bytes",
        "bytes=",
        "bytes=-",
        "bytes=a-b",
        "bytes=9-3",
        "bytes=0-1,x",
        "pages=1-2",
        "bytes=0-1;2-3",
    ],
)
def test_a_range_that_is_none_of_bytes_is_ignored(http: httpx.Client, ranges: str) -> None:
    answer = http.get("/file", headers={"Range": ranges})
    assert (answer.status_code, answer.content) == (200, CONTENT)


def test_two_lines_of_range_are_no_range(http: httpx.Client) -> None:
    answer = http.get("/file", headers=[("Range", "bytes=0-1"), ("Range", "bytes=4-5")])
    assert (answer.status_code, answer.content) == (200, CONTENT)


@pytest.mark.parametrize(
    ("ranges", "part"),
    [("bytes=0-9", CONTENT[:10]), ("BYTES=90-", CONTENT[90:]), ("bytes = -5", CONTENT[95:])],
)
def test_a_range_is_answered_by_that_part(http: httpx.Client, ranges: str, part: bytes) -> None:
    answer = http.get("/file", headers={"Range": ranges})
    assert (answer.status_code, answer.content) == (206, part)


def test_a_range_behind_the_end_is_a_problem_document_with_the_size(http: httpx.Client) -> None:
    answer = http.get("/file", headers={"Range": "bytes=100-"})
    assert answer.headers["content-range"] == "bytes */100"
    assert answer.headers["content-type"] == "application/problem+json"
    found = answer.json()
    assert (answer.status_code, found["type"]) == (416, "/problems/range-not-satisfiable")
    assert found["detail"] == "/file has 100 bytes, and none in that range."


def test_a_refusal_in_plain_text_becomes_a_problem_document(http: httpx.Client) -> None:
    answer = http.get("/plain")
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "/problems/bad-request"
