"""The capture page: plans edited and estimated, captures started, paused, cancelled and gone on with."""

import re
import threading

import pytest
from playwright.sync_api import Locator, Page, Request, Route, expect

from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from tests.support.pages import capture_documents as documents
from tests.support.pages.awaited import box_of, expect_to_fit, expect_value
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared, posted
from tests.support.pages.stub_server import StubServer, problem
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PATIENCE_MS = 90_000
SMALL = {"wide_size": "half", "fovea_size": "half"}
LONG = "-".join(["a-very-long-name-for-a-capture"] * 8)


@pytest.fixture
def stub(stub: StubServer) -> StubServer:
    stub.answers |= {"/captures": [], "/captures/estimates": documents.estimate()}
    return stub


def four_points(console: Console, name: str) -> Locator:
    """Type a plan of four points; return the page once it is estimated."""
    page = console.page.locator("#capture-page")
    plan = part(page, "Plan")
    plan.get_by_text("Given", exact=True).click()
    for label, value in (("Distance", "2"), ("Columns", "2"), ("Rows", "2")):
        plan.get_by_label(label, exact=True).fill(value)
    plan.get_by_label("Field", exact=True).select_option("step")
    plan.get_by_label("Step across").fill("1.5")
    plan.get_by_label("Step down").fill("1.5")
    part(page, "Capture").get_by_label("Name", exact=True).fill(name)
    expect(page.locator(".figures")).to_contain_text("±0.8° × ±0.8°", timeout=PATIENCE_MS)
    return page


def part(page: Locator, name: str) -> Locator:
    return page.get_by_role("region", name=name, exact=True)


def start(page: Locator) -> None:
    page.get_by_role("button", name="Start the capture").click()


def outcome(page: Locator) -> Locator:
    return page.get_by_role("group", name="The capture")


def badge(page: Page) -> Locator:
    return page.locator("#badges a[href='#/capture']")


def order(console: Console, page: Locator, button: str) -> None:
    """Press a button of the running capture and wait until the server has obeyed: the page says so before."""
    with console.page.expect_response(lambda answer: answer.url.endswith(("/cancel", "/pause"))):
        outcome(page).get_by_role("button", name=button).click()


def test_plan_is_captured_from_the_page_and_waits_where_it_was_paused(
    page_rig: Running, gate: threading.Event, open_console: OpenConsole
) -> None:
    console = open_console(f"http://127.0.0.1:{page_rig.port}/#/capture", settings=SMALL)
    page = four_points(console, "from the page")
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "4")
    start(page)
    expect(badge(console.page)).to_have_text("Capturing 0 %", timeout=PATIENCE_MS)
    part(page, "Capture").get_by_label("Name", exact=True).fill("another")
    expect(page.get_by_role("button", name="Start the capture")).to_be_disabled()
    expect(part(page, "Capture")).to_contain_text("A capture runs: see above.")
    order(console, page, "Pause")
    expect(outcome(page)).to_contain_text("pausing after this point")
    gate.set()
    expect(outcome(page)).to_contain_text("paused: 1 of 4", timeout=PATIENCE_MS)
    expect(badge(console.page)).to_have_text("Capture paused 25 %")
    outcome(page).get_by_role("button", name="Go on").click()
    expect(outcome(page)).to_contain_text("“from the page”: complete", timeout=PATIENCE_MS)
    expect(badge(console.page)).to_be_hidden()
    expect(page.locator(".above")).to_be_empty()  # whoever had the rig has it no more
    link = outcome(page).get_by_role("link", name="Show in the gallery")
    expect(link).to_have_attribute("href", re.compile("^#/gallery/datasets/cap-"))
    mosaic = outcome(page).get_by_role("link", name="Mosaic")
    expect(mosaic).to_have_attribute("href", re.compile("^#/gallery/datasets/cap-.*/mosaic$"))
    folder = page_rig.services.settings.data / "captures" / "from the page"
    assert (check_dataset(folder), len(Dataset.open(folder))) == ([], 4)


def test_cancelled_capture_is_listed_and_goes_on_where_it_ended(
    page_rig: Running, gate: threading.Event, open_console: OpenConsole
) -> None:
    console = open_console(f"http://127.0.0.1:{page_rig.port}/#/capture", settings=SMALL)
    page = four_points(console, "cut off")
    start(page)
    expect(badge(console.page)).to_have_text("Capturing 0 %", timeout=PATIENCE_MS)
    order(console, page, "Cancel")
    expect(outcome(page)).to_contain_text("cancelling")
    gate.set()
    expect(outcome(page)).to_contain_text("“cut off”: cancelled", timeout=PATIENCE_MS)
    expect(outcome(page)).to_contain_text("Cancelled after 1 of 4 points")
    unfinished = part(page, "Unfinished")
    expect(unfinished).to_contain_text("1 of 4 points")
    gate.clear()
    unfinished.get_by_role("button", name="Resume cut off").click()
    expect(outcome(page).get_by_role("button", name="Cancel")).to_be_enabled(timeout=PATIENCE_MS)
    expect(unfinished).to_contain_text("None")  # what runs is not offered once more
    gate.set()
    expect(outcome(page)).to_contain_text("“cut off”: complete", timeout=PATIENCE_MS)
    expect(unfinished).to_contain_text("None")
    assert page_rig.get("/captures", text="cut off").json()[0]["points"]["taken"] == 4


def test_what_is_refused_is_told_where_it_was_typed(page_rig: Running, open_console: OpenConsole) -> None:
    console = open_console(f"http://127.0.0.1:{page_rig.port}/#/capture", settings=SMALL)
    page = four_points(console, "up/down")
    plan = part(page, "Plan")
    started = page.get_by_role("button", name="Start the capture")
    words = {
        "name": "it contains '/', which separates folders",
        "size": "200 was given; needed is a value of at most 101.",
        "field": "of 4 points are beyond reach",
        "rail": "is 695 mm beyond its end",
        "exposures": "an exposure of 5000 ms was asked",
        "text": "Line 2: `@spin` is no command",
        "distance": "Give the distance in metres.",
    }

    def expect_message(about: str) -> None:
        expect(page.locator(f"[data-about={about}]")).to_contain_text(
            words[about], ignore_case=True, timeout=PATIENCE_MS
        )

    started.click()
    expect_message("name")
    plan.get_by_label("Columns").fill("200")
    expect_message("size")
    expect(started).to_be_disabled()
    plan.get_by_label("Columns").fill("2")
    plan.get_by_label("Step across").fill("40")
    expect_message("field")
    plan.get_by_label("Step across").fill("1")
    for about, group, value in (("rail", "Rail", "1000"), ("exposures", "At every point", "5000")):
        chips = page.get_by_role("group", name=group)
        chips.locator(".chips-field input").fill(value)
        chips.get_by_role("button", name="Add").click()
        expect_message(about)
        chips.get_by_role("button", name="None").click()
    plan.get_by_text("Set points", exact=True).first.click()
    plan.get_by_label("Set points", exact=True).last.fill("1, 1\n@spin 2\n")
    expect_message("text")
    plan.get_by_label("Set points", exact=True).last.fill("1, 1\n2, 2, inf\n")
    plan.get_by_label("Distance", exact=True).fill("")
    expect_message("distance")
    plan.get_by_label("Distance", exact=True).fill("3")
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "2", timeout=PATIENCE_MS)
    expect(page.locator(".refused:not(:empty)")).to_have_count(0)
    expect(started).to_be_enabled()


def test_warnings_come_and_go_without_moving_the_button_that_starts(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/capture").page
    button = page.get_by_role("button", name="Start the capture")
    warnings = page.locator(".plan-warnings li").filter(visible=True)
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "4")
    before = box_of(button)
    stub.answers["/captures/estimates"] = documents.estimate(warnings=["too far", "too dark"])
    part(page.locator("#capture-page"), "Plan").get_by_label("Columns", exact=True).fill("3")
    expect(warnings).to_have_text(["Too far.", "Too dark."])
    expect(page.locator(".plan-warnings button")).to_have_count(0)  # no gaps
    assert box_of(button) == before


def test_whole_wide_view_is_shown_with_the_plan_however_it_was_zoomed(
    stub: StubServer, open_stub: OpenShared
) -> None:
    console = open_stub("#/")
    console.wait_for_frames("wide")
    page, zoom = console.page, console.page.locator(".pane-wide .zoom")
    page.keyboard.press("+")
    expect(zoom).not_to_have_text("100 %")
    page.goto(f"{stub.url}#/capture")
    expect(zoom).to_have_text("100 %")


@pytest.mark.parametrize(
    ("button", "points"),
    [
        (
            "Smaller field, views overlap by 20 %",
            {"columns": 3, "rows": 3, "half_width_deg": pytest.approx(1.45, abs=0.02)},
        ),
        ("Same field, 165 points that overlap by 20 %", {"columns": 15, "rows": 11}),
    ],
)
def test_plan_with_gaps_offers_plans_that_a_mosaic_can_be_made_of(
    stub: StubServer, open_console: OpenConsole, button: str, points: dict[str, object]
) -> None:
    gaps = documents.estimate(3, 3, warnings=["no two views overlap"])
    gaps["coverage"] |= {"overlap_across": 0.0, "overlap_down": 0.0}
    gaps["plan"]["points"] |= {"half_width_deg": 10.0, "half_height_deg": 5.5}
    stub.answers["/captures/estimates"] = gaps
    page = open_console(f"{stub.url}#/capture", options=TOUCH).page
    plan = part(page.locator("#capture-page"), "Plan")
    for label in ("Columns", "Rows"):
        plan.get_by_label(label, exact=True).fill("3")
    expect(page.locator(".plan-warnings").filter(visible=True)).to_contain_text("No two views overlap.")
    expect_to_fit(page)
    page.get_by_role("button", name=button).click()

    def asked() -> dict[str, object]:
        grid = stub.posted_bodies("/captures/estimates")[-1]["plan"]["points"]
        return {name: grid[name] for name in points}

    expect_value(page, asked, points)


def test_newest_plan_is_the_one_that_is_shown(stub: StubServer, open_console: OpenConsole) -> None:
    console = open_console(f"{stub.url}#/capture")
    page = console.page.locator("#capture-page")
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "4")
    asked: list[int] = []
    held: list[Route] = []

    def answer(route: Route) -> None:
        asked.append(posted(route.request)["plan"]["points"]["columns"])
        if asked[-1] == 3:
            held.append(route)
        else:
            route.fulfill(json=documents.estimate(columns=asked[-1]))

    console.page.route("**/captures/estimates", answer)
    with console.page.expect_request("**/captures/estimates"):
        page.get_by_label("Columns").fill("3")
    for columns in ("4", "5"):
        page.get_by_label("Columns").fill(columns)
    expect(page.locator(".figures")).to_have_attribute("aria-busy", "true")
    held[0].fulfill(json=documents.estimate(columns=3))
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "10")
    expect(page.locator(".budget strong")).to_have_text("30 to 60 s")
    expect(page.locator(".budget .lead")).to_have_text("by the times of the last 3 captures")
    page.locator(".plan-prints").press("ArrowLeft")
    expect(page.locator(".plan-tip")).to_have_text("Point 9 · column 4, row 1 · +2.00° +1.50°")
    assert (asked[0], asked[-1]) == (3, 5)


def test_what_was_typed_outlives_a_reload_and_gives_way_to_the_defaults(
    stub: StubServer, open_console: OpenConsole
) -> None:
    console = open_console(f"{stub.url}#/capture")
    page = console.page.locator("#capture-page")
    columns = page.get_by_label("Columns")
    defaults = page.get_by_role("button", name="Start from the defaults")
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "4")
    expect(defaults).to_be_hidden()
    columns.fill("3")
    page.get_by_label("Field", exact=True).select_option("overlap")
    page.get_by_label("Overlap across").fill("41")
    page.get_by_role("button", name="The five places of the paper").click()
    part(page, "Capture").get_by_label("Name", exact=True).fill("kept")
    with console.page.expect_request(is_overlap) as asked:
        console.page.reload()
    assert posted(asked.value)["plan"]["rail_positions_mm"] == [-300, -100, 0, 100, 300]
    expect(columns).to_have_value("3")
    expect(page.get_by_label("Overlap across")).to_have_value("41")
    expect(part(page, "Capture").get_by_label("Name", exact=True)).to_have_value("kept")
    expect(page.locator(".plan-prints")).to_have_attribute("data-points", "4")
    defaults.click()
    expect(columns).to_have_value("9")
    expect(part(page, "Capture").get_by_label("Name", exact=True)).to_have_value(re.compile("^raster "))
    expect(defaults).to_be_hidden()
    console.page.get_by_role("button", name="Undo").click()
    expect(columns).to_have_value("3")


def is_overlap(order: Request) -> bool:
    """Tell whether an extent is asked about: that of an overlap follows from the size of a view."""
    return (
        order.url.endswith("/captures/estimates")
        and posted(order)["plan"]["points"]["half_width_deg"] is not None
    )


def test_capture_of_somebody_else_says_what_it_waits_for_and_how_it_ended(
    stub: StubServer, open_console: OpenConsole
) -> None:
    wish = "push the rig to 100 mm, then let it go on"
    running = documents.capture("paused", name=LONG, why=wish, progress=documents.progress("paused", 2))
    stub.answers |= {"/captures": [running], "/captures/cap-1": running}
    stub.answers |= {"/jobs": [documents.job()], "/jobs/job-9": documents.job()}
    console = open_console(f"{stub.url}#/capture", options=TOUCH)
    page = console.page.locator("#capture-page")
    expect(outcome(page)).to_contain_text("Push the rig to 100 mm, then let it go on.")
    expect(badge(console.page)).to_have_text("Capture paused 50 %")
    expect_to_fit(console.page)
    outcome(page).get_by_role("button", name="Done, go on").click()
    expect(outcome(page).get_by_role("button", name="Done, go on")).to_be_disabled()
    why = problem(502, "A device failed", f"camera left is lost: {LONG}", "plug it in")
    partial = documents.capture("partial", name=LONG, label=LONG, why="camera left is lost")
    stub.answers |= {"/captures": [partial], "/captures/cap-1": partial}
    stub.answers["/jobs/job-9"] = documents.job("failed", problem=why)
    expect(outcome(page)).to_contain_text("failed")
    expect(outcome(page)).to_contain_text("Plug it in.")
    expect(part(page, "Unfinished")).to_contain_text("2 of 4 points, 9.33 MB")
    expect_to_fit(console.page)
    expect(console.page.get_by_role("button", name="STOP")).to_be_in_viewport()
    assert [asked for method, asked, _ in stub.requests if method == "POST" and "estimates" not in asked] == [
        "/captures/cap-1/continue"
    ]


def test_panes_go_from_page_to_page_and_space_stops_from_the_plan(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.refusals["POST /captures/estimates"] = problem(
        409, "The rig is not calibrated", "the rig has no calibration; load or make one"
    )
    console = open_console(stub.url)
    page = console.page
    page.get_by_role("link", name="Capture", exact=True).click()
    expect(page.locator("#capture-page .pane-left")).to_be_visible()
    expect(page.locator("#capture-page .above")).to_contain_text("The rig has no calibration")
    page.locator(".plan-prints").focus()
    with page.expect_request(lambda order: order.url.endswith("/stop") and order.method == "POST"):
        page.keyboard.press("Space")
    page.get_by_role("link", name="Rig", exact=True).click()
    expect(page.locator("#rig-page .pane-wide")).to_be_visible()
    expect(page.locator("#capture-page")).to_be_hidden()
    expect(page.locator("#rig-page .plan-prints")).to_be_hidden()
    page.go_back()
    expect(page.locator("#capture-page .pane-wide")).to_be_visible()
    page.locator("#capture-page").get_by_role("link", name="Gallery").click()
    expect(page.locator("#gallery")).to_be_visible()
    expect(page.locator("#console")).to_be_hidden()
    page.goto(f"{stub.url}#/")
    expect(page.locator("#console .area-eyes .pane-right")).to_be_visible()
    expect(page.locator(".pane-wide .surface")).to_have_js_property("inert", False)
