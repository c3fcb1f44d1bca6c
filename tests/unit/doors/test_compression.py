"""What is compressed, what is not, and that each is the same once it is read."""

from collections.abc import AsyncIterator, Iterator

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from tests.support.servers.local_server import serving

from foveacam_server.console import pages
from foveacam_server.console.static_files import STATIC, version
from foveacam_server.doors.compression import CompressedAnswers

ROWS = [{"name": f"row {number}", "value_m": 0.5 * number} for number in range(400)]
PLAIN = {"Accept-Encoding": "identity"}
GZIP = {"Accept-Encoding": "br;q=1.0, gzip"}
SCRIPT = "/static/js/main.js"


def application() -> FastAPI:
    app = FastAPI()
    pages.install(app)

    @app.api_route("/rows", methods=["GET", "POST"])
    async def rows() -> JSONResponse:
        return JSONResponse(ROWS)

    @app.get("/rows/tagged")
    async def tagged() -> JSONResponse:
        return JSONResponse(ROWS, headers={"ETag": '"1"'})

    @app.get("/rows/few")
    async def few() -> JSONResponse:
        return JSONResponse(ROWS[:3])

    @app.get("/rows/cookie")
    async def cookie() -> JSONResponse:
        return JSONResponse(ROWS, headers={"Set-Cookie": "a=b"})

    @app.get("/picture.jpg")
    async def picture() -> Response:
        return Response(bytes(9000), media_type="image/jpeg")

    @app.get("/events")
    async def events() -> StreamingResponse:
        async def lines() -> AsyncIterator[str]:
            for _ in range(3):
                yield "data: " + "x" * 5000 + "\n\n"

        return StreamingResponse(lines(), media_type="text/event-stream")

    @app.get("/large")
    async def large() -> HTMLResponse:
        return HTMLResponse("<p>one</p>" * 20_000)

    app.add_middleware(CompressedAnswers)
    return app


@pytest.fixture(scope="module")
def browser() -> Iterator[httpx.Client]:
    with (
        serving(application()) as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client,
    ):
        yield client


@pytest.mark.parametrize("path", ["/", "/view", "/rows", "/large", SCRIPT, f"/static/{version()}/js/main.js"])
def test_texts_are_compressed_and_read_the_same(browser: httpx.Client, path: str) -> None:
    plain, packed = browser.get(path, headers=PLAIN), browser.get(path, headers=GZIP)
    assert "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert "accept-encoding" in packed.headers["vary"].lower()
    assert packed.content == plain.content
    assert packed.num_bytes_downloaded == int(packed.headers["content-length"]) < 0.6 * len(plain.content)


@pytest.mark.parametrize("path", [SCRIPT, "/rows", "/"])
@pytest.mark.parametrize("accepted", ["gzip;q=0", "gzip; q=0.0, br", "deflate", ""])
def test_nothing_is_compressed_for_whom_accepts_none(browser: httpx.Client, path: str, accepted: str) -> None:
    assert "content-encoding" not in browser.get(path, headers={"Accept-Encoding": accepted}).headers


@pytest.mark.parametrize("path", ["/rows/tagged", "/rows/few", "/rows/cookie", "/picture.jpg", "/events"])
def test_answers_with_tags_cookies_or_pictures_small_ones_and_streams_stay_as_they_are(
    browser: httpx.Client, path: str
) -> None:
    assert "content-encoding" not in browser.get(path, headers=GZIP).headers


def test_an_answer_to_a_change_stays_as_it_is(browser: httpx.Client) -> None:
    answer = browser.post("/rows", headers=GZIP)
    assert "content-encoding" not in answer.headers
    assert answer.json() == ROWS


def test_a_part_of_a_file_is_a_part_of_its_own_bytes(browser: httpx.Client) -> None:
    part = browser.get(SCRIPT, headers={**GZIP, "Range": "bytes=3-12"})
    assert (part.status_code, part.headers.get("content-encoding")) == (206, None)
    assert part.content == (STATIC / "js/main.js").read_bytes()[3:13]


def test_each_form_of_a_file_has_its_own_tag_and_is_not_sent_twice(browser: httpx.Client) -> None:
    tags = {}
    for name, headers in (("plain", PLAIN), ("packed", GZIP)):
        first = browser.get(SCRIPT, headers=headers)
        tags[name] = first.headers["etag"]
        again = browser.get(SCRIPT, headers={**headers, "If-None-Match": first.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        assert "accept-encoding" in again.headers["vary"].lower()
    assert tags["plain"] != tags["packed"]
    # who has the compressed form may not keep it as the plain one
    stale = browser.get(SCRIPT, headers={**PLAIN, "If-None-Match": tags["packed"]})
    assert stale.status_code == 200
