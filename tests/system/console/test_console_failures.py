"""Stop with many viewers, and a server that goes away and comes back."""

import time

import pytest
from playwright.sync_api import Browser

from .conftest import DESKTOP, OpenConsole, Server, StartServer, contexts, free_port, watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

VIEWERS = 12
STOP_S = 1.0
RECOVERY_S = 5.0


def test_stop_answers_within_a_second_with_twelve_viewers_open(browser: Browser, server: Server) -> None:
    server.be_idle()
    with contexts(browser, {"scene": False}, {"viewport": DESKTOP}) as context:
        viewers = [watched(context.new_page()) for _ in range(VIEWERS)]
        for viewer in viewers:
            viewer.page.goto(server.url)
        for viewer in viewers:
            viewer.until_live("wide")
        page = viewers[0].page
        began_s = time.monotonic()
        with page.expect_response(
            lambda answer: answer.url.endswith("/stop") and answer.request.method == "POST"
        ) as stop:
            page.keyboard.press("Space")
        assert stop.value.json()["engaged"] is True
        assert time.monotonic() - began_s < STOP_S
        for viewer in viewers:
            viewer.page.locator("#stopped").wait_for(state="visible")
    server.send("DELETE", "/stop")


def test_page_recovers_by_itself_when_the_server_comes_back(
    open_console: OpenConsole, serve: StartServer
) -> None:
    port = str(free_port())
    first = serve("--port", port)
    console = open_console(first.url)
    console.until_live("wide", "left")
    boot = console.page.evaluate("foveacam.bootId()")
    first.end()
    console.page.locator("#offline").wait_for(state="visible")
    serve("--port", port)
    began_s = time.monotonic()
    console.until(f"foveacam.stream() === 'open' && foveacam.bootId() !== '{boot}'", within_s=RECOVERY_S)
    console.until_live("wide", "left")
    assert time.monotonic() - began_s < RECOVERY_S
    console.page.locator("#offline").wait_for(state="hidden")
    console.page.locator(".badge.good", has_text="Ready").wait_for()
    lost = [
        error
        for error in console.errors
        if "ERR_CONNECTION_REFUSED" in error or "WebSocket" in error or "net::ERR" in error
    ]
    console.errors = [
        error for error in console.errors if error not in lost
    ]  # the browser's own words for an absent server
