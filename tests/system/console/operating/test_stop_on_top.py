"""STOP is above every dialog: what a modal one makes inert, the stop is not."""

import pytest
from playwright.sync_api import expect

from foveacam_bench.console.dialogs import ON_EVERY_PAGE, ConsoleDialog, one_click_stops, open_help
from tests.support.pages.awaited import box_of
from tests.support.pages.console_page import DESKTOP, PHONE, OpenConsole
from tests.support.pages.stop import ENGAGED, expect_stop_in_reach
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

OPEN_DIALOG = """() => {
  const above = document.createElement("dialog");
  above.id = "above";
  document.body.append(above);
  above.showModal();
}"""
COVER = """() => {
  const cover = document.createElement("div");
  cover.style = "position: fixed; inset: 0; z-index: 9999";
  document.querySelector("dialog[open]").append(cover);
}"""


@pytest.mark.parametrize("phone", [False, True], ids=["desktop", "phone"])
@pytest.mark.parametrize("dialog", ON_EVERY_PAGE, ids=lambda dialog: dialog.name)
def test_one_click_and_space_stop_while_a_dialog_is_open(
    open_console: OpenConsole, stub: StubServer, dialog: ConsoleDialog, phone: bool
) -> None:
    console = open_console(stub.url, options={"viewport": PHONE if phone else DESKTOP})
    stop = console.page.locator("#stop")
    console.wait_for_frames("wide")
    before = box_of(stop)
    dialog.open(console.page)
    assert box_of(stop) == before  # its place on the screen
    expect_stop_in_reach(console.page)
    console.page.keyboard.press("Escape")
    expect(console.page.locator("dialog:modal")).to_have_count(0)
    expect(console.page.locator(".topbar > #stop")).to_be_visible()


def test_stop_follows_the_topmost_dialog_and_a_window_that_changes_its_size(
    open_console: OpenConsole, stub: StubServer
) -> None:
    page = open_console(stub.url).page
    open_help(page)
    page.evaluate(OPEN_DIALOG)
    expect(page.locator("#above > #stop")).to_be_in_viewport(ratio=1.0)
    page.set_viewport_size(PHONE)
    expect(page.locator("#above > #stop")).to_be_in_viewport(ratio=1.0)
    page.evaluate("document.getElementById('above').remove()")  # not even closed
    expect(page.locator("dialog[aria-label=Help] > #stop")).to_be_in_viewport(ratio=1.0)
    page.keyboard.press("Escape")
    expect(page.locator(".topbar > #stop")).to_be_in_viewport(ratio=1.0)


@pytest.mark.parametrize("phone", [False, True], ids=["desktop", "phone"])
@pytest.mark.parametrize("name", ["view", "windows", "replay"])
def test_one_click_and_space_stop_beside_a_dialog_of_a_page_of_views(
    open_console: OpenConsole, stub: StubServer, name: str, phone: bool
) -> None:
    page = open_console(f"{stub.url}{name}", options={"viewport": PHONE if phone else DESKTOP}).page
    stop = page.locator("#stop")
    before = box_of(stop)
    page.evaluate(OPEN_DIALOG)
    assert box_of(stop) == before
    expect_stop_in_reach(page)
    page.evaluate("document.getElementById('above').close()")
    expect(page.locator("#above > #stop")).to_have_count(0)
    expect(stop).to_be_in_viewport(ratio=1.0)


@pytest.mark.parametrize("covered", [False, True])
def test_the_bench_clicks_as_a_person_does_on_whatever_is_above_the_stop(
    open_console: OpenConsole, stub: StubServer, covered: bool
) -> None:
    page = open_console(stub.url).page
    page.route("**/api/v1/stop", lambda route: route.fulfill(json=ENGAGED))
    open_help(page)
    expect(page.locator("dialog[aria-label=Help] > #stop")).to_be_in_viewport(ratio=1.0)
    if covered:
        page.evaluate(COVER)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.method))
    assert one_click_stops(page, lambda: "POST" in asked) is not covered
