"""A window of views: split, closed, dragged, kept in its address; what it shows when a source is lost."""

import re
from typing import Literal

import pytest
from playwright.sync_api import FloatRect, Locator, Page, expect

from tests.support.pages.awaited import box_of, expect_to_fit, expect_value, settled
from tests.support.pages.console_page import PHONE, TOUCH, Console, OpenConsole
from tests.support.pages.stub_server import StubServer
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

TOLERANCE_PX = 2.0
"""A share is kept to a thousandth in the address."""


def open_window(open_console: OpenConsole, server: Server | StubServer, layout: str = "") -> Console:
    return open_console(f"{server.url}windows#{layout}", options={"viewport": {"width": 1000, "height": 700}})


def pane(page: Page, source: str) -> Locator:
    return page.locator(f".slot[data-source={source}]")


def middle(of: Locator) -> tuple[float, float]:
    found = box_of(of)
    return found["x"] + found["width"] / 2, found["y"] + found["height"] / 2


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=5)
    page.mouse.up()


def expect_sources(page: Page, *wanted: str) -> None:
    """Wait until these sources, and no others, have a pane."""
    expect(page.locator(".slot")).to_have_count(len(wanted))
    for source in wanted:
        expect(pane(page, source)).to_have_count(1)


def expect_box(of: Locator, wanted: FloatRect, *, tolerance_px: float = TOLERANCE_PX) -> None:
    """Wait until an element is at a place of the page."""
    expect_value(of.page, of.bounding_box, pytest.approx(wanted, abs=tolerance_px))


def expect_side(of: Locator, side: Literal["width", "height"], wanted_px: float) -> None:
    """Wait until an element is so wide or so high."""
    expect_value(of.page, lambda: box_of(of)[side], pytest.approx(wanted_px, abs=TOLERANCE_PX))


def expect_layout(page: Page, layout: str) -> None:
    """Wait until the window has this layout in its address."""
    expect(page).to_have_url(re.compile(re.escape(f"#{layout}") + "$"))


def test_a_pane_is_split_both_ways_and_closed_and_its_neighbour_takes_its_room(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_window(open_console, page_server, "left")
    page = console.page
    console.wait_for_frames("left")
    whole = box_of(pane(page, "left"))
    page.get_by_role("button", name="Split Left fovea: new pane to the right").click()
    expect(pane(page, "wide").get_by_role("combobox")).to_be_focused()
    page.get_by_role("button", name="Split Wide: new pane below").click()
    console.wait_for_frames("left", "wide", "right")
    expect_side(pane(page, "left"), "width", whole["width"] / 2)
    expect_side(pane(page, "right"), "height", whole["height"] / 2)
    expect_layout(page, "row-500(left,column-500(wide,right))")
    page.get_by_role("button", name="Close Left fovea").click()
    page.get_by_role("button", name="Close Right fovea").click()
    expect_box(pane(page, "wide"), whole, tolerance_px=0.0)
    expect(page.get_by_role("button", name="Close Wide")).to_be_disabled()


def test_every_source_has_its_pane_and_then_none_can_be_split(
    open_console: OpenConsole, page_server: Server
) -> None:
    page = open_window(open_console, page_server, "wide").page
    split = page.get_by_role("button", name=re.compile("^Split"))
    for panes in range(1, 9):
        expect(page.locator(".slot")).to_have_count(panes)
        page.locator("button:enabled:is([data-act=row], [data-act=column])").first.click()
    expect_sources(
        page,
        *("wide", "left", "right", "anaglyph", "difference", "depth", "wide_depth", "wide_zoom", "scene"),
    )
    expect(split).to_have_count(18)
    expect(split.and_(page.locator(":enabled"))).to_have_count(0)


def test_a_divider_moves_by_pointer_and_keys_and_the_window_is_the_same_after_a_reload(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_window(open_console, page_server)
    page = console.page
    divider = page.locator(".divider.row")
    x, y = middle(divider)
    drag(page, (x, y), (x - 200.0, y))
    expect_value(page, lambda: middle(divider)[0], pytest.approx(x - 200.0, abs=TOLERANCE_PX))
    page.locator(".divider.column").press("ArrowDown")
    expect(page.locator(".divider.column")).to_have_attribute("aria-valuenow", "52")
    before = [box_of(pane(page, source)) for source in ("wide", "left", "right")]
    address = settled(page, lambda: page.url)
    page.reload()
    console.wait_for_frames("wide", "left", "right")
    expect(page).to_have_url(address)
    for source, kept in zip(("wide", "left", "right"), before, strict=True):
        expect_box(pane(page, source), kept)


def test_two_panes_change_places_by_dragging_and_a_source_is_changed_by_its_select(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_window(open_console, page_server)
    page = console.page
    console.wait_for_frames("wide", "right")
    wide, right = box_of(pane(page, "wide")), box_of(pane(page, "right"))
    drag(page, middle(pane(page, "wide").locator(".grip")), middle(pane(page, "right")))
    expect_box(pane(page, "right"), wide, tolerance_px=0.0)
    expect_box(pane(page, "wide"), right, tolerance_px=0.0)
    console.wait_for_frames("wide", "right")
    pane(page, "right").get_by_role("combobox").select_option("depth")
    expect_sources(page, "depth", "left", "wide")
    expect_box(pane(page, "depth"), wide, tolerance_px=0.0)
    expect(page).to_have_title("Depth, Left fovea, Wide: FoveaCam Duo")


def test_a_lost_camera_leaves_its_last_picture_with_reason_and_age_until_it_is_back(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_window(open_console, page_server, "row-500(wide,left)")
    page = console.page
    console.wait_for_frames("wide", "left")
    page_server.send("PUT", "/simulation/faults", {"unplugged": ["left"]}).raise_for_status()
    try:
        left = pane(page, "left")
        expect(left.locator(".notice")).to_contain_text("No left camera")
        expect(left.locator(".picture-age")).to_have_text(re.compile(r"Last picture [\d.]+ m?s old"))
        expect(left.locator("canvas.picture")).to_be_visible()
        expect(pane(page, "wide").locator(".picture-age")).to_be_hidden()
    finally:
        page_server.send("DELETE", "/simulation/faults").raise_for_status()
    console.wait_for_frames("left")
    expect(left.locator(".picture-age")).to_be_hidden()
    expect(left.locator(".notice")).to_be_hidden()


def test_a_server_that_comes_back_finds_the_window_as_it_was(
    open_console: OpenConsole, stub: StubServer
) -> None:
    console = open_window(open_console, stub, "column-300(right,wide)")
    page = console.page
    console.wait_for_frames("wide", "right")
    stub.away = True
    for source in ("wide", "right"):
        expect(pane(page, source).locator(".notice")).to_contain_text("Offline")
        expect(pane(page, source).locator(".picture-age")).to_contain_text("Last picture")
    stub.away = False
    console.wait_for_frames("wide", "right")
    for source in ("wide", "right"):
        expect(pane(page, source).locator(".picture-age")).to_be_hidden()
    expect_layout(page, "column-300(right,wide)")
    console.errors.clear()  # the browser's own words for an absent server


def test_the_console_opens_a_view_in_a_window_of_its_own(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_console(page_server.url)
    console.wait_for_frames("left")
    with console.page.context.expect_page() as opened:
        console.page.get_by_role("link", name="Open Left fovea in a window of its own").click()
    window = opened.value
    expect(window.locator(".slot[data-source=left] canvas")).to_be_visible()
    expect(window).to_have_url(re.compile("/windows#left$"))
    expect(console.page.locator("a.opener[aria-label]")).to_have_count(9)


def test_a_phone_has_one_button_for_windows_and_room_for_the_others(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_console(page_server.url, options=TOUCH)
    console.wait_for_frames("left")
    expect(console.page.locator("a.opener").locator("visible=true")).to_have_attribute(
        "href", "/windows#scene"
    )
    expect_to_fit(console.page)
    enlarge = box_of(console.page.get_by_role("button", name="Enlarge the view Right fovea"))
    assert enlarge["x"] + enlarge["width"] <= PHONE["width"]


def test_a_window_is_used_on_a_phone(open_console: OpenConsole, page_server: Server) -> None:
    console = open_console(f"{page_server.url}windows#column-500(wide,row-500(left,right))", options=TOUCH)
    page = console.page
    console.wait_for_frames("wide", "left", "right")
    expect_to_fit(page)
    for source in ("wide", "left", "right"):
        tools = box_of(pane(page, source).locator(".controls"))
        whole = box_of(pane(page, source))
        assert tools["x"] + tools["width"] <= whole["x"] + whole["width"]
    page.get_by_role("button", name="Close Right fovea").tap()
    expect_sources(page, "left", "wide")


def test_an_address_that_cannot_be_shown_is_the_usual_window(
    open_console: OpenConsole, page_server: Server
) -> None:
    page = open_window(open_console, page_server, "row-500(wide,nothing)").page
    expect_sources(page, "left", "right", "wide")
