"""The tool Measure in the console: points and lengths in the depth view, their list, refusals."""

import re

import pytest
from playwright.sync_api import ViewportSize, expect

from tests.support.pages.awaited import box_of, match_of
from tests.support.pages.calibration_documents import Document
from tests.support.pages.calibration_results import UTC
from tests.support.pages.console_page import FIXATION_PATIENCE_MS, Console, OpenConsole, OpenShared
from tests.support.pages.stub_server import StubServer, problem
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

TEXTURED_PX = (812.0, 420.0)  # the poster of the scene "bench"
NOT_LOOKED_AT_PX = (1050.0, 740.0)  # its red ball
ENDS_PX = ((700.0, 560.0), (560.0, 500.0))  # the wall beside its sign, and the sign


def open_measurements(open_console: OpenConsole, server: Server) -> Console:
    """Open the console with live views, and in it the list of measurements."""
    console = open_console(server.url)
    console.wait_for_frames("wide")
    console.page.locator("#tab-measurements").click()
    return console


def measured_point(number: int) -> Document:
    place = {"view": "wide", "x_px": 600.0, "y_px": 400.0, "snapped_px": 0.0, "at_edge": False}
    found = {"point_rig_m": [0.0, 0.1, 2.0], "point_sigma_m": [0.001, 0.001, 0.004]}
    point = place | found | {"fixation_id": "fix-1", "distance_m": 2.0, "distance_sigma_m": 0.004}
    known: Document = {
        "id": f"mea-{number}",
        "kind": "point",
        "label": f"Point {number}",
        "fixation_ids": ["fix-1"],
    }
    known |= {"created_utc": UTC, "points": [point], "length": None, "plane": None, "profile": None}
    return known | {"drawn_px": {"wide": [[600.0, 400.0]]}, "gaze": None}


def test_points_and_lengths_are_measured_in_the_depth_view_and_listed(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_measurements(open_console, page_server)
    page = console.page
    expect(page.locator("#measurements .empty")).to_contain_text("Nothing measured yet")
    page.locator("#tab-depth").click()
    console.fixate(*TEXTURED_PX)
    console.wait_for_frames("depth")
    page_server.wait_for_cloud()

    page.locator(".pane-depth").get_by_role("button", name="Measure in the view").click()
    picture = page.locator(".pane-depth .picture")

    def click_at(x_share: float, y_share: float) -> None:
        box = box_of(picture)
        picture.click(position={"x": x_share * box["width"], "y": y_share * box["height"]}, force=True)

    click_at(0.4, 0.4)
    rows = page.locator(".measurements li")
    expect(rows).to_have_count(1)
    page.keyboard.press("2")
    click_at(0.3, 0.6)
    expect(page.locator(".pane-depth .measure-bar .hint")).to_contain_text("second point")
    click_at(0.6, 0.3)
    expect(rows).to_have_count(2)

    length, point = page_server.send("GET", "/measurements").json()
    assert (length["kind"], point["kind"]) == ("length", "point")
    match = match_of(rows.first.locator(".distance"), r"(\d+\.\d+)\s±\s(\d+\.\d+)\sm")
    assert float(match[1]) == pytest.approx(length["length"]["length_m"], abs=float(match[2]))
    expect(page.locator(".pane-wide .measured.selected .value")).to_have_text(match[0])
    expect(page.locator(".pane-depth .measured")).to_have_count(2)

    click_at(0.96, 0.5)
    click_at(0.5, 0.5)
    expect(page.locator(".toast")).to_contain_text("the scale stands there")
    page.keyboard.press("Escape")
    expect(page.locator(".pane-depth .measure-bar")).to_be_hidden()
    expect(page.locator("body.measuring")).to_have_count(0)


def test_a_place_that_nobody_looked_at_is_looked_at_and_measured_by_one_button(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_measurements(open_console, page_server)
    page = console.page
    rows = page.locator(".measurements li")
    before = len(page_server.send("GET", "/measurements").json())
    page.locator(".pane-wide").get_by_role("button", name="Measure in the view").click()
    page.mouse.click(*console.page_position(*NOT_LOOKED_AT_PX))
    offer = page.locator(".toast", has_text="The depth there is not known yet")
    expect(offer).not_to_contain_text("/api/")
    offer.get_by_role("button", name="Look there, then measure").click()
    expect(rows).to_have_count(before + 1, timeout=FIXATION_PATIENCE_MS)
    newest = page_server.send("GET", "/measurements").json()[0]
    assert newest["kind"] == "point"
    page.keyboard.press("Escape")


def test_list_is_scrolled_to_a_new_measurement(open_stub: OpenShared, stub: StubServer) -> None:
    stub.answers["/measurements"] = [measured_point(number) for number in range(20, 0, -1)]
    page = open_stub("#/").page
    page.locator("#tab-measurements").click()
    rows = page.locator(".measurements li")
    expect(rows).to_have_count(20)
    for name, place in (("Point 18", 2), ("Point 9", 11), ("Point 20", 0)):
        expect(rows.nth(place).locator(".label")).to_have_value(name)
        rows.nth(place).locator(".distance").click()
        expect(rows.nth(place)).to_have_class(re.compile("selected"))
        top = box_of(page.locator("#measurements"))["y"]
        assert abs(box_of(rows.nth(place))["y"] - top) < 2


def test_both_ends_that_nobody_looked_at_are_looked_at_by_one_button_and_stay_marked_until_then(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_measurements(open_console, page_server)
    page = console.page
    ruler = page.locator(".pane-wide").get_by_role("button", name="Measure in the view")
    offer = page.locator(".toast", has_text="The depth of neither end is known yet")
    refused = page.locator(".pane-wide .measured.refused")
    before = len(page_server.send("GET", "/measurements").json())

    def click_both() -> None:
        ruler.click()
        page.locator(".pane-wide .measure-bar").get_by_role("button", name="Length").click()
        for end in ENDS_PX:
            page.mouse.click(*console.page_position(*end))

    click_both()
    expect(offer).to_be_visible()
    expect(refused).to_have_count(1)
    page.keyboard.press("Escape")
    expect(offer).to_have_count(0)  # with the tool
    expect(refused).to_have_count(0)

    click_both()
    offer.get_by_role("button", name="Look there, then measure").click()
    expect(page.locator(".measurements li")).to_have_count(before + 1, timeout=2 * FIXATION_PATIENCE_MS)
    expect(refused).to_have_count(0)
    newest = page_server.send("GET", "/measurements").json()[0]
    assert (newest["kind"], len(newest["fixation_ids"])) == ("length", 2)
    page.keyboard.press("Escape")


def test_the_next_measurement_takes_a_refusal_away_and_another_page_the_tool(
    stub: StubServer, open_stub: OpenShared
) -> None:
    stub.refusals["POST /measurements"] = problem(
        422, "Out of range", "the scale stands there", "aim elsewhere"
    )
    console = open_stub("#/")
    page = console.page
    console.wait_for_frames("wide")
    ruler = page.locator(".pane-wide").get_by_role("button", name="Measure in the view")
    ruler.click()
    page.mouse.click(*console.page_position(300, 300))
    refusal = page.locator(".toast", has_text="the scale stands there")
    expect(refusal).to_be_visible()
    stub.refusals["POST /measurements"] = problem(422, "Out of range", "it is too far", "aim elsewhere")
    page.mouse.click(*console.page_position(400, 300))
    expect(page.locator(".toast")).to_have_count(1)
    expect(page.locator(".toast")).to_contain_text("too far")

    expect(ruler).to_have_attribute("aria-pressed", "true")
    page.goto(f"{stub.url}#/capture")
    page.goto(f"{stub.url}#/")
    expect(ruler).to_have_attribute("aria-pressed", "false")


@pytest.mark.parametrize("size", [(1120, 700), (1440, 900), (1920, 1080)])
def test_wide_picture_keeps_its_size_and_place_while_the_tool_is_on(
    stub: StubServer, open_console: OpenConsole, size: tuple[int, int]
) -> None:
    viewport: ViewportSize = {"width": size[0], "height": size[1]}
    console = open_console(stub.url, options={"viewport": viewport})
    console.wait_for_frames("wide")
    wide = console.page.locator(".pane-wide")
    picture, bar = wide.locator(".picture"), wide.locator(".measure-bar")
    before = box_of(picture)
    wide.get_by_role("button", name="Measure in the view").click()
    expect(bar.get_by_role("button", name="Length")).to_be_visible()
    assert box_of(picture) == before
    assert box_of(bar)["height"] < 45  # one row
    expect(wide.locator(".reach-legend")).to_be_hidden()  # it would cover what is measured
