"""The console of a server below a path of a site: nothing leads out of that path or to the internet."""

from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page, Request, Route, WebSocket, expect

from tests.support.pages.console_page import Console, OpenConsole
from tests.support.servers.running_server import Running, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

ROOT = "/lab/foveacam"


@pytest.fixture(scope="module")
def below(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data"), viewer=True, root_path=ROOT) as found:
        yield found


def address(server: Running, path: str = "/") -> str:
    return f"http://127.0.0.1:{server.port}{ROOT}{path}"


def watch(page: Page, paths: list[str]) -> None:
    """Let every request and socket of a page add its path to the list, or its address on another host."""

    def add(sent: Request | WebSocket) -> None:
        address = urlsplit(sent.url)
        if address.scheme not in ("blob", "data"):
            paths.append(address.path if address.hostname == "127.0.0.1" else sent.url)

    page.on("request", add)
    page.on("websocket", add)


def outside(paths: list[str]) -> list[str]:
    return [path for path in paths if not path.startswith(f"{ROOT}/")]


def opened(open_console: OpenConsole, server: Running, path: str = "/") -> tuple[Console, list[str]]:
    """Open a page with its requests watched."""
    paths: list[str] = []

    def prepare(page: Page) -> None:
        watch(page, paths)
        page.route(f"**{ROOT}/openapi.json", describe_the_stop)

    return open_console(address(server, path), settings={"scene": True}, prepare=prepare), paths


def describe_the_stop(route: Route) -> None:
    """Leave the stop in the interface's document: to draw all paths takes the browser seconds."""
    document = route.fetch().json()
    document["paths"] = {path: each for path, each in document["paths"].items() if path == "/api/v1/stop"}
    route.fulfill(json=document)


def test_views_events_a_click_and_the_scene_stay_below_the_path(
    open_console: OpenConsole, below: Running
) -> None:
    console, paths = opened(open_console, below)
    console.wait_for_frames("wide")
    console.click(812, 420)
    expect(console.page.locator(".distance").first).to_contain_text("m")
    scene = console.page.frame_locator(".area-scene iframe")
    expect(scene.locator("canvas").first).to_be_visible()
    assert outside(paths) == []
    assert {f"{ROOT}/api/v1/views/ws", f"{ROOT}/viser/"} <= set(paths)


def test_pictures_whose_addresses_the_server_tells_are_shown(
    open_console: OpenConsole, below: Running
) -> None:
    still = below.post("/stills", {"name": "below", "save": True}, Prefer="wait=60").json()
    assert still["url"].startswith("/api/v1/")
    console, paths = opened(open_console, below, "/#/gallery/stills")
    picture = console.page.locator("img[src*='thumbnail.jpg']").first
    expect(picture).to_be_visible()
    console.wait_until("document.querySelector(\"img[src*='thumbnail.jpg']\").naturalWidth > 0")
    assert outside(paths) == []


@pytest.mark.parametrize(
    ("path", "shown"),
    [
        ("/windows#wide", ".slot"),
        ("/display", "main"),
        ("/guide/looking", "main h1"),
    ],
)
def test_the_other_pages_load_below_the_path(
    open_console: OpenConsole, below: Running, path: str, shown: str
) -> None:
    console, paths = opened(open_console, below, path)
    expect(console.page.locator(shown).first).to_be_visible()
    assert outside(paths) == []


def test_the_interface_is_shown_without_internet(open_console: OpenConsole, below: Running) -> None:
    console, paths = opened(open_console, below, "/redoc")
    page = console.page
    expect(page).to_have_url(address(below, "/docs"))
    page.locator("#operations-tag-stop").click()
    expect(page.locator(".opblock")).to_have_count(3)
    page.locator("#operations-stop-engage_api_v1_stop_post button").first.click()
    page.get_by_text("Try it out").wait_for()
    page.get_by_role("button", name="Authorize").click()
    page.get_by_text("X-API-Token").first.wait_for()
    assert outside(paths) == []
    policy = below.http.get("/docs").headers["content-security-policy"]
    assert "http" not in policy
    assert "script-src 'self';" in policy
