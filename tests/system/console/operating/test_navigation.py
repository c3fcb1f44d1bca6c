"""Pages are found by the bar of activities, the menu More and the command palette, also by keys alone."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.support.pages.answer_documents import target
from tests.support.pages.awaited import box_of, expect_to_fit
from tests.support.pages.console_page import PHONE, OpenConsole
from tests.support.pages.stub_server import StubServer
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

ACTIVITIES = {
    "Look": "#/",
    "Capture": "#/capture",
    "Gallery": "#/gallery",
    "Calibrate": "#/calibration",
    "Rig": "#/rig",
}
MORE = {
    "Followed targets": "#/follow",
    "Vergence loop": "#/loop",
    "Compare depth": "#/compare",
    "Planner": "#/planner",
    "Set-up": "#/setup",
    "Acceptance": "#/acceptance",
    "Rigs": "#/rigs",
    "Engine": "#/engine",
    "People": "#/people",
    "All settings": "#/settings",
}
LEAST_TOUCH_PX = 44.0
MOST_ENTRIES = 6


def find(page: Page, words: str) -> None:
    page.keyboard.press("Control+k")
    expect(page.get_by_role("combobox", name="Find a page")).to_be_focused()
    page.keyboard.type(words)


def test_the_bar_says_where_one_is(open_console: OpenConsole, page_server: Server) -> None:
    page = open_console(page_server.url).page
    bar = page.get_by_role("navigation", name="Pages")
    expect(bar.locator(":scope > *")).to_have_count(MOST_ENTRIES)
    for name, address in ACTIVITIES.items():
        bar.get_by_role("link", name=name, exact=True).click()
        expect(page).to_have_url(re.compile(re.escape(address) + "$"))
        expect(bar.locator("[aria-current=page]")).to_have_text(name)


def test_the_menu_leads_to_every_other_page_and_leaves_the_stop_in_reach(
    open_console: OpenConsole, page_server: Server
) -> None:
    page = open_console(page_server.url).page
    for name, address in MORE.items():
        page.get_by_role("button", name="More").click()
        expect(page.locator("#stop")).to_be_in_viewport(ratio=1.0)
        page.locator("#more-menu").get_by_role("link", name=name).click()
        expect(page).to_have_url(re.compile(re.escape(address) + "$"))
        expect(page.locator("#more-menu")).to_be_hidden()


def test_the_palette_opens_pages_targets_and_commands_by_keys_alone(
    open_console: OpenConsole, stub: StubServer
) -> None:
    stub.answers["/targets"] = [target(basis="both_foveae", distance_m=2.0, distance_sigma_m=0.1)]
    page = open_console(stub.url).page
    find(page, "people")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#/people$"))
    find(page, "follow")
    options = page.get_by_role("dialog").get_by_role("option")
    expect(options.first).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowDown")
    expect(options.nth(1)).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowUp")
    expect(options.first).to_contain_text("Followed targets")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#/follow$"))
    find(page, "measure points")
    page.keyboard.press("Enter")
    expect(page.locator("body.measuring")).to_have_count(1)  # in the console
    find(page, "nothing of that name")
    expect(options).to_have_count(0)
    expect(page.get_by_text("Nothing is called that.")).to_be_visible()
    page.keyboard.press("Escape")
    find(page, "target 1")
    with page.expect_request(re.compile("/targets/tgt-1/fixate$")):
        page.keyboard.press("Enter")


def test_on_a_phone_the_bar_is_at_the_bottom_with_room_for_a_finger(
    open_console: OpenConsole, stub: StubServer
) -> None:
    page = open_console(stub.url, options={"viewport": PHONE, "has_touch": True}).page
    bar = page.get_by_role("navigation", name="Pages")
    expect_to_fit(page)
    box = box_of(bar)
    assert box["y"] + box["height"] == pytest.approx(PHONE["height"], abs=1.0)
    for name in [*ACTIVITIES, "More"]:
        size = box_of(bar.get_by_text(name, exact=True).locator(".."))
        assert min(size["width"], size["height"]) >= LEAST_TOUCH_PX
    bar.get_by_role("button", name="More").tap()
    menu = page.locator("#more-menu")
    for name in MORE:
        assert box_of(menu.get_by_role("link", name=name))["height"] >= LEAST_TOUCH_PX
    menu.get_by_role("link", name="Engine").tap()
    expect(page).to_have_url(re.compile("#/engine$"))
    expect(bar.locator("[aria-current=page]")).to_have_text("Rig")
