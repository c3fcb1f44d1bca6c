"""A page of another origin, in a browser: what it may do where it is listed, and where it is not."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from fastapi import FastAPI, WebSocket
from fastapi.responses import HTMLResponse
from playwright.sync_api import Browser, Page
from pydantic import SecretStr

from foveacam_server.accounts.cookies import COOKIE
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import needs
from foveacam_server.console import security
from foveacam_server.foundation.settings import Settings
from tests.support.servers.local_server import serving

pytestmark = pytest.mark.browser
TOKEN = "correct horse"  # noqa: S105  # a token of this test alone
ORDER = """async ([url, options]) => {
    try {
        const answer = await fetch(url, options);
        return [answer.status, answer.headers.get("x-frame-seq"), await answer.text()];
    } catch (error) {
        return [0, null, error.name];
    }
}"""
LISTEN = """(url) => new Promise((resolve) => {
    const socket = new WebSocket(url);
    socket.onmessage = ({ data }) => resolve(data);
    socket.onerror = () => resolve("refused");
})"""


@contextmanager
def rig_that_lists(*origins: str) -> Iterator[tuple[str, str]]:
    """Serve a guarded application; yield its address and the cookie of a browser that knows its token."""
    app = FastAPI()

    @app.post("/park")
    async def park() -> str:
        return "parked"

    @app.get("/picture")
    @needs(Right.VIEW)
    async def picture() -> HTMLResponse:
        return HTMLResponse("seen", headers={"X-Frame-Seq": "7"})

    @app.websocket("/live")
    @needs(Right.VIEW)
    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text("live")
        await socket.close()

    gate = security.install(app, Settings(token=SecretStr(TOKEN), allowed_origins=origins))
    with serving(app) as port:
        yield f"http://127.0.0.1:{port}", gate.cookie


@pytest.fixture
def origin() -> Iterator[str]:
    """Another origin, which serves one page."""
    other = FastAPI()

    @other.get("/")
    async def show() -> HTMLResponse:
        return HTMLResponse("<title>lab</title>")

    with serving(other) as port:
        yield f"http://127.0.0.1:{port}"


@pytest.fixture
def page(browser: Browser, origin: str) -> Iterator[Page]:
    """The page of the other origin."""
    with browser.new_context() as context:
        found = context.new_page()
        found.goto(f"{origin}/")
        yield found


def order(page: Page, url: str, **options: object) -> list[object]:
    """Return status, a header and the text of what the page gets; 0 where the browser gives it nothing."""
    found: list[object] = page.evaluate(ORDER, [url, options])
    return found


def first_message(page: Page, rig: str) -> str:
    """Return what a WebSocket of the page hears first, or that it was refused."""
    found: str = page.evaluate(LISTEN, f"{rig}/live".replace("http", "ws", 1))
    return found


def test_a_listed_page_orders_with_a_token_and_reads_with_the_cookie(page: Page, origin: str) -> None:
    with rig_that_lists(origin) as (rig, cookie):
        token = {"X-Api-Token": TOKEN, "Content-Type": "application/json"}
        assert order(page, f"{rig}/park", method="POST", headers=token) == [200, None, '"parked"']
        assert order(page, f"{rig}/picture")[0] == 401  # without credentials, and it may read why
        page.context.add_cookies([{"name": COOKIE, "value": cookie, "url": rig, "sameSite": "Lax"}])
        assert order(page, f"{rig}/picture")[0] == 401
        assert order(page, f"{rig}/picture", credentials="include") == [200, "7", "seen"]
        assert first_message(page, rig) == "live"


def test_a_page_that_is_not_listed_gets_nothing(page: Page) -> None:
    with rig_that_lists("http://127.0.0.1:1") as (rig, cookie):
        page.context.add_cookies([{"name": COOKIE, "value": cookie, "url": rig, "sameSite": "Lax"}])
        token = {"X-Api-Token": TOKEN}
        assert order(page, f"{rig}/park", method="POST", headers=token) == [0, None, "TypeError"]
        assert order(page, f"{rig}/picture", credentials="include") == [0, None, "TypeError"]
        assert first_message(page, rig) == "refused"
