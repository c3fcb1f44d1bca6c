"""STOP is above every dialog: what a modal one makes inert, the stop is not."""

import pytest
from playwright.sync_api import Page, expect

from tests.support.pages.awaited import box_of
from tests.support.pages.console_page import DESKTOP, PHONE, OpenConsole
from tests.support.pages.stop import expect_stop_in_reach
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]


def open_help(page: Page) -> None:
    page.get_by_role("button", name="Help (?)").click()


def open_settings(page: Page) -> None:
    page.get_by_role("button", name="More").click()
    page.get_by_role("button", name="Settings").click()


def open_control(page: Page) -> None:
    page.get_by_role("button", name="Control is free").click()


def open_faults(page: Page) -> None:
    page.get_by_role("button", name="Faults and warnings").click()


def open_palette(page: Page) -> None:
    page.keyboard.press("Control+k")


DIALOGS = [open_help, open_settings, open_control, open_faults, open_palette]


@pytest.mark.parametrize("phone", [False, True], ids=["desktop", "phone"])
@pytest.mark.parametrize("open_dialog", DIALOGS)
def test_one_click_and_space_stop_while_a_dialog_is_open(
    open_console: OpenConsole, stub: StubServer, open_dialog: object, phone: bool
) -> None:
    console = open_console(stub.url, options={"viewport": PHONE if phone else DESKTOP})
    stop = console.page.locator("#stop")
    console.wait_for_frames("wide")
    assert callable(open_dialog)
    before = box_of(stop)
    open_dialog(console.page)
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
    page.evaluate(
        """() => {
          const above = document.createElement("dialog");
          above.id = "above";
          document.body.append(above);
          above.showModal();
        }"""
    )
    expect(page.locator("#above > #stop")).to_be_in_viewport(ratio=1.0)
    page.set_viewport_size(PHONE)
    expect(page.locator("#above > #stop")).to_be_in_viewport(ratio=1.0)
    page.evaluate("document.getElementById('above').remove()")  # not even closed
    expect(page.locator("dialog[aria-label=Help] > #stop")).to_be_in_viewport(ratio=1.0)
    page.keyboard.press("Escape")
    expect(page.locator(".topbar > #stop")).to_be_in_viewport(ratio=1.0)
