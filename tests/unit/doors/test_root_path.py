"""A server below a path of a site: what comes in loses the path, what browsers follow gets it."""

from collections.abc import Iterator

import httpx
import pytest
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response, StreamingResponse
from starlette.websockets import WebSocket
from tests.support.servers.local_server import serving
from websockets.sync.client import connect

from foveacam_hardware.contract import InvalidInput
from foveacam_server.doors import root_path
from foveacam_server.doors.root_path import RootPath
from foveacam_server.foundation.settings import Settings, checked_settings
from foveacam_web.viser_page import viser_page

ROOT = "/lab/foveacam"
PAGE = '<a href="/docs">a</a><img src="/static/a.png"><form action="/join"><a href="//x/"><a href="#/rig">'


def application() -> FastAPI:
    app = FastAPI()

    @app.get("/")
    async def page() -> HTMLResponse:
        return HTMLResponse(PAGE)

    @app.get("/pieces")
    async def pieces() -> StreamingResponse:
        return StreamingResponse(iter(["<a hr", 'ef="/docs">']), media_type="text/html")

    @app.get("/seen")
    async def seen(request: Request) -> dict[str, str]:
        return {"path": request.scope["path"], "raw": request.scope["raw_path"].decode(), "url": "/seen"}

    @app.get("/away/{where:path}")
    async def away(where: str) -> Response:
        answer = RedirectResponse(where, status_code=303)
        answer.set_cookie("one", "1")
        answer.set_cookie("two", "2", path="/sign_in")
        return answer

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text(socket.scope["path"])
        await socket.close()

    app.add_middleware(RootPath, root=ROOT)
    return app


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with (
        serving(application()) as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http,
    ):
        yield http


@pytest.mark.parametrize("before", [ROOT, ""])
def test_the_path_comes_off_whether_the_proxy_has_stripped_it_or_not(
    client: httpx.Client, before: str
) -> None:
    assert client.get(f"{before}/seen").json() == {"path": "/seen", "raw": "/seen", "url": "/seen"}
    address = client.base_url.copy_with(scheme="ws", path=f"{before}/live")
    with connect(str(address), proxy=None) as live:
        assert live.recv() == "/live"


def test_what_only_begins_like_the_path_is_another_one(client: httpx.Client) -> None:
    assert client.get(f"{ROOT}2/seen").status_code == 404
    assert client.get(ROOT).text == client.get(f"{ROOT}/").text


def test_pages_lead_below_the_path_and_nowhere_else(client: httpx.Client) -> None:
    answer = client.get(f"{ROOT}/")
    assert answer.text == (
        f'<a href="{ROOT}/docs">a</a><img src="{ROOT}/static/a.png"><form action="{ROOT}/join">'
        '<a href="//x/"><a href="#/rig">'
    )
    assert int(answer.headers["content-length"]) == len(answer.content)
    assert client.get(f"{ROOT}/pieces").text == f'<a href="{ROOT}/docs">'
    head = client.head(f"{ROOT}/seen")
    assert head.status_code == 405


def test_redirects_and_cookies_stay_below_the_path(client: httpx.Client) -> None:
    answer = client.get("/away//docs")  # to /docs
    assert answer.headers["location"] == f"{ROOT}/docs"
    cookies = answer.headers.get_list("set-cookie")
    assert [cookie.partition("Path=")[2].partition(";")[0] for cookie in cookies] == [
        f"{ROOT}/",
        f"{ROOT}/sign_in",
    ]
    assert client.get("/away/https://provider/").headers["location"] == "https://provider/"


@pytest.mark.parametrize(
    "given", ["foveacam", "/a b", "/../x", "/foveacam//x", "/api", "/static/rig", "/viser"]
)
def test_a_path_that_cannot_be_one_is_refused_with_an_example(given: str) -> None:
    with pytest.raises(InvalidInput, match="give one such as /foveacam"):
        checked_settings({"root_path": given})


def test_a_slash_at_the_end_does_not_count() -> None:
    assert checked_settings({"root_path": "/foveacam/"}).root_path == "/foveacam"
    assert Settings().root_path == ""


@pytest.mark.parametrize("bare", [True, False])
def test_the_page_of_the_3d_pane_has_no_address_that_would_get_the_path(bare: bool) -> None:
    assert root_path.LINK.search(viser_page(bare=bare)) is None
