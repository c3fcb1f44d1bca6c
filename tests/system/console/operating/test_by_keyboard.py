"""The tour by the keyboard alone, on a real rig."""

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages.awaited import settled
from tests.support.pages.console_page import FIXATION_PATIENCE_MS, OpenConsole
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

MOST_TABS = 120
CAPTURE_MS = 120_000.0


def tab_to(page: Page, wanted: Locator) -> None:
    """Press Tab until an element has the focus."""
    expect(wanted).to_be_enabled()
    for _ in range(MOST_TABS):
        if settled(page, lambda: wanted.evaluate("element => element === document.activeElement")):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab never led to {wanted}")


def press(page: Page, wanted: Locator) -> None:
    """Reach a button by Tab and press it by Enter."""
    tab_to(page, wanted)
    page.keyboard.press("Enter")


def step(page: Page, title: str) -> None:
    heading = page.get_by_role("region", name="First tour").get_by_role("heading")
    expect(heading).to_have_text(title, timeout=CAPTURE_MS)


def to_its_place(page: Page, words: str) -> None:
    """Press the tour's button that leads to the place of its step."""
    press(page, page.get_by_role("region", name="First tour").get_by_role("button", name=words))


def look_at_the_crosshair(page: Page, *arrows: str) -> None:
    for arrow in arrows:
        page.keyboard.press(f"Shift+{arrow}")
    page.keyboard.press("Enter")


def test_the_tour_is_done_by_the_keyboard_alone(page_server: Server, open_console: OpenConsole) -> None:
    page = open_console(page_server.url).page
    page.keyboard.press("?")
    press(page, page.get_by_role("button", name="Take the tour"))
    step(page, "1 of 5: Look")
    to_its_place(page, "To the wide view")
    expect(page.locator(".pane-wide .surface")).to_be_focused()
    look_at_the_crosshair(page, "ArrowRight", "ArrowUp")
    expect(page.locator("#fixation .numbers")).to_be_attached(timeout=FIXATION_PATIENCE_MS)

    step(page, "2 of 5: Look around")
    to_its_place(page, "To the button")
    expect(page.locator(".wide-depth-look")).to_be_focused()
    page.keyboard.press("Enter")

    step(page, "3 of 5: Measure")
    to_its_place(page, "To the ruler")
    page.keyboard.press("Enter")
    page.keyboard.press("2")
    tab_to(page, page.locator(".pane-wide .surface"))
    look_at_the_crosshair(page, "ArrowRight")
    look_at_the_crosshair(page, "ArrowRight", "ArrowRight")

    step(page, "4 of 5: Capture")
    to_its_place(page, "To the capture page")
    for name in ("Columns", "Rows"):
        tab_to(page, page.locator("#capture-page").get_by_label(name, exact=True))
        page.keyboard.press("Control+a")
        page.keyboard.type("3")
    press(page, page.locator("#capture-page").get_by_role("button", name="Start the capture"))

    step(page, "5 of 5: Gallery")
    to_its_place(page, "To the gallery")
    press(page, page.locator("#gallery a[href*='/datasets/']").first)
    step(page, "That was the tour")
    expect(page.locator("#gallery img").first).to_be_visible()
