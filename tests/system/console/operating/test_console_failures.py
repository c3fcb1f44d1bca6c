"""Stop with many viewers, and a server that goes away and comes back."""

import time
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from foveacam_bench.servers import free_port
from tests.support.pages.awaited import settled
from tests.support.pages.console_page import OpenConsole, console_of
from tests.support.pages.stub_server import StubServer
from tests.support.servers.running_server import running
from tests.support.servers.server_process import Server, server_of

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

VIEWERS = 3
"""`foveacam bench console` opens twelve."""
STOP_S = 1.0
RECOVERY_S = 5.0
"""On a machine with nothing else to do (`foveacam bench console`); on a busy one, what its like takes."""


def test_stop_answers_within_a_second_with_many_viewers_open(
    open_console: OpenConsole, page_server: Server
) -> None:
    page_server.be_idle()
    first = open_console(page_server.url)
    viewers = [first, *(console_of(first.page.context.new_page()) for _ in range(VIEWERS - 1))]
    for viewer in viewers[1:]:
        viewer.load(page_server.url)
    for viewer in viewers:
        viewer.wait_for_frames("wide")
    page = first.page
    page.bring_to_front()
    plain_s = max(seconds_of_a_plain_answer(page) for _ in range(3))
    began_s = time.monotonic()
    with page.expect_response(
        lambda answer: answer.url.endswith("/stop") and answer.request.method == "POST"
    ) as stop:
        page.keyboard.press("Space")
    took_s = time.monotonic() - began_s
    assert stop.value.json()["engaged"] is True
    plain_s = max(plain_s, *(seconds_of_a_plain_answer(page) for _ in range(3)))  # as busy as it is now
    assert took_s < max(STOP_S, 2.0 * plain_s)
    for viewer in viewers:
        viewer.page.locator("#stopped").wait_for(state="visible")
    page_server.send("DELETE", "/stop")


def test_page_recovers_by_itself_when_the_server_comes_back(
    open_console: OpenConsole, tmp_path: Path
) -> None:
    port = free_port()
    with running(tmp_path / "data", port=port) as first:
        began_s = time.monotonic()
        console = open_console(server_of(first).url)
        console.wait_for_frames("wide", "left")
        opening_s = time.monotonic() - began_s
        boot: str = settled(console.page, lambda: console.page.evaluate("foveacam.bootId()"))
    console.page.locator("#offline").wait_for(state="visible")
    with running(tmp_path / "data", port=port):
        began_s = time.monotonic()
        console.wait_until(f"foveacam.stream() === 'open' && foveacam.bootId() !== '{boot}'")
        console.wait_for_frames("wide", "left")
        assert time.monotonic() - began_s < max(RECOVERY_S, 2.0 * opening_s)
        console.page.locator("#offline").wait_for(state="hidden")
        console.page.locator(".badge.good", has_text="Ready").wait_for()
    lost = [
        error
        for error in console.errors
        if any(word in error for word in ("WebSocket", "net::ERR", "503 (Service Unavailable)"))
    ]
    console.errors = [
        error for error in console.errors if error not in lost
    ]  # the browser's own words for an absent server, and for one whose rig opens


def seconds_of_a_plain_answer(page: Page) -> float:
    """Return how long the page waits for an answer that costs the server nothing."""
    took_ms = page.evaluate(
        "(async () => { const began = performance.now(); await (await fetch('/api/v1/healthz')).text();"
        " return performance.now() - began; })()"
    )
    return float(took_ms) / 1000.0


def test_a_page_that_does_not_arrive_says_so_and_is_loaded_again(
    stub: StubServer, open_console: OpenConsole
) -> None:
    console = open_console(stub.url)
    page = console.page
    page.route("**/preferences/page.js", lambda route: route.abort())
    page.evaluate("location.hash = '#/settings'")
    expect(page.locator("#settings-page [role=alert]")).to_contain_text("This page was not loaded")
    page.locator("#settings-page").get_by_role("link", name="Console").click()
    expect(page.locator("#console")).to_be_visible()
    page.evaluate("location.hash = '#/settings'")
    page.unroute_all()
    page.get_by_role("button", name="Load again").click()
    expect(page.locator("#settings-title")).to_be_focused()
    expected = ("Failed to load resource: net::ERR_FAILED", "Failed to fetch dynamically imported module")
    assert [error for error in console.errors if not error.startswith(expected)] == []
    console.errors.clear()
