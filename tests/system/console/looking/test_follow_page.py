"""Following from the console: the switch and its clicks, cards, marks, the page, what ends it."""

import math
import re
from pathlib import Path

import pytest
from playwright.sync_api import Download, FloatRect, Locator, Page, Request, Response, expect

from tests.support.pages.awaited import box_of, expect_to_fit, expect_value, wait_for
from tests.support.pages.calibration_documents import Document
from tests.support.pages.console_page import DESKTOP, PHONE, TOUCH, Console, OpenConsole, OpenShared, posted
from tests.support.pages.stub_server import StubServer, problem
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

CLICKED_PX = (812.0, 420.0)  # the poster of the scene "bench"
STATES = ["followed", "lost", "finding", "out_of_field"]


def followed(number: int, state: str = "followed", **changes: object) -> Document:
    known = state != "finding"
    document: Document = {
        "id": f"fol-{number}",
        "label": f"Followed {number}",
        "state": state,
        "tracker": "template",
        "priority": 1.0,
        "created_utc": "2026-03-01T10:00:00Z",
        "x_px": 80.0 * number if known else None,
        "y_px": 200.0 if known else None,
        "point_rig_m": [0.4, 0.1, 12.3] if known else None,
        "velocity_rig_m_s": [0.8, 0.0, -0.9] if known else None,
        "distance_m": 12.31 if known else None,
        "distance_sigma_m": 0.052 if known else None,
        "speed_m_s": 1.2 if known else None,
        "looks": 12 if known else 0,
        "hits": 9 if known else 0,
        "rate_hz": 3.5 if known else 0.0,
        "age_s": 0.3 if known else None,
        "score": 0.95 if known else None,
        "wide_score": 0.9 if known else None,
    }
    return document | changes


def mark_of(document: Document) -> Document:
    return {name: document[name] for name in ("id", "label", "state", "x_px", "y_px")}


def trail(hits: int) -> list[Document]:
    return [
        {"t_s": 5 + 0.3 * n, "x_m": 0.1 * n, "y_m": 0.0, "z_m": 12.0 - 0.05 * n, "distance_sigma_m": 0.05}
        for n in range(hits)
    ]


def put(stub: StubServer, documents: list[Document]) -> None:
    """Let these be followed."""
    stub.answers["/follows"] = documents
    for each in documents:
        stub.answers[f"/follows/{each['id']}/trail"] = trail(40)
    stub.follow_marks = [mark_of(each) for each in documents if each["x_px"] is not None]


def follow_switch(page: Page) -> Locator:
    return page.locator(".follow-switch")


def is_follow(request: Request) -> bool:
    return request.method == "POST" and request.url.endswith("/api/v1/follows")


def answers_follow(response: Response) -> bool:
    return is_follow(response.request)


def test_a_click_with_the_switch_on_follows_until_it_is_let_go(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_console(page_server.url)
    page = console.page
    console.wait_for_frames("wide")
    page.locator("#tab-followed").click()
    expect(page.locator("#followed .empty")).to_contain_text("Nothing is followed")
    follow_switch(page).click()
    expect(follow_switch(page)).to_have_attribute("aria-pressed", "true")
    with page.expect_request(is_follow) as order:
        page.mouse.click(*console.page_position(*CLICKED_PX))
    body = posted(order.value)
    assert body["pixel"]["x_px"] == pytest.approx(CLICKED_PX[0], abs=0.6)
    assert body["frame_seq"] > 0

    card = page.locator("#followed .follow-card")
    expect(card).to_have_attribute("data-state", "followed")
    expect(card.locator(".distance")).to_have_text(re.compile(r"^\d+(\.\d+)? ± \d+(\.\d+)? m$"))
    ring = page.locator(".pane-wide .follow.followed")
    expect(ring.locator("text")).to_have_text("Followed 1")
    expect_value(
        page,
        lambda: console.pixel(*centre_of(ring.locator("circle").first)),
        pytest.approx(CLICKED_PX, abs=8.0),
    )

    with page.expect_response(lambda answer: answer.request.method == "PATCH"):
        card.get_by_label("Tracker").select_option("Filter")
    assert [each["tracker"] for each in page_server.send("GET", "/follows").json()] == ["filter"]
    with page.expect_response(
        lambda answer: answer.request.method == "GET" and answer.url.endswith("/follows")
    ):
        pass  # the next reading
    expect(card.get_by_label("Tracker")).to_have_value("filter")
    card.get_by_role("button", name="Let go").click()
    expect(card).to_have_count(0)
    expect(ring).to_have_count(0)
    assert page_server.send("GET", "/follows").json() == []
    expect(page.locator(".toast")).to_have_count(0)


def test_a_result_is_followed_until_the_stop_which_says_so(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_console(page_server.url)
    page = console.page
    console.wait_for_frames("wide")
    console.fixate(*CLICKED_PX)
    page.locator("#fixation").get_by_role("button", name="Follow").click()
    expect(page.locator("#followed .follow-card")).to_have_attribute("data-state", "followed")
    try:
        page.keyboard.press("Space")
        expect(page.locator(".toast")).to_contain_text("followed no more")
        expect(page.locator("#followed .follow-card")).to_have_count(0)
    finally:
        page_server.send("DELETE", "/stop")


def test_a_rectangle_and_a_known_target_are_followed(open_stub: OpenShared, stub: StubServer) -> None:
    stub.follow_marks = []
    stub.answers["/targets"] = [target()]
    stub.answers_after["POST /follows"] = {"/follows": [followed(1, "finding")]}
    console = watching(open_stub("#/"), stub)
    page = console.page
    page.keyboard.press("t")
    box = box_of(page.locator(".pane-wide .surface"))
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 300, box["y"] + 220, steps=4)
    with page.expect_response(answers_follow):
        page.mouse.up()
    expect(page.locator(".pane-wide .follow.finding")).to_have_count(1)
    page.locator("#tab-targets").click()
    with page.expect_response(answers_follow):
        page.locator("#targets").get_by_role("button", name="Follow").click()
    drawn, known = stub.posted_bodies("/follows", count=2)
    assert drawn["rectangle"]["width_px"] > 20
    assert drawn["frame_seq"] == 1
    assert known == {"target_id": "tgt-1"}
    page.keyboard.press("Escape")
    expect(follow_switch(page)).to_have_attribute("aria-pressed", "false")


def test_a_click_has_one_meaning_at_a_time(open_console: OpenConsole, stub: StubServer) -> None:
    console = watching(open_console(stub.url), stub)
    page = console.page
    measure = page.locator(".pane-wide").get_by_role("button", name="Measure in the view")
    bar = page.locator(".pane-wide .hint-bar", has_text="Following")
    measure.click()
    follow_switch(page).click()
    expect(measure).to_have_attribute("aria-pressed", "false")
    expect(page.locator("body.measuring")).to_have_count(0)
    expect(bar).to_be_visible()
    expect(page.locator(".pane-wide .surface")).to_have_css("cursor", "cell")
    measure.click()
    expect(follow_switch(page)).to_have_attribute("aria-pressed", "false")
    expect(page.locator(".pane-wide .measure-bar")).to_be_visible()
    expect(bar).to_be_hidden()
    page.keyboard.press("t")
    bar.get_by_role("button", name="Stop following clicks").click()
    expect(follow_switch(page)).to_have_attribute("aria-pressed", "false")
    with page.expect_request(lambda request: request.url.endswith("/fixations")):
        page.mouse.click(*console.page_position(200, 100))


def test_marks_follow_every_wide_picture_in_the_colour_of_their_state(
    open_stub: OpenShared, stub: StubServer
) -> None:
    put(stub, [followed(number + 1, state, x_px=150.0 * number + 100) for number, state in enumerate(STATES)])
    stub.follow_marks = [mark_of(each | {"y_px": 200.0}) for each in stub.answers["/follows"]]
    console = watching(open_stub("#/"), stub)
    page = console.page
    for state in STATES:
        expect(page.locator(f".pane-wide .follow.{state}")).to_have_count(1)
    dashes = (
        "[...document.querySelectorAll('.follow circle:not(.under)')]"
        ".map((ring) => getComputedStyle(ring).strokeDasharray !== 'none')"
    )
    expect_value(page, lambda: page.evaluate(dashes), [state != "followed" for state in STATES])
    circle = page.locator(".follow circle").first
    before = box_of(circle)["width"]
    page.keyboard.press("+")
    console.wait_for_frames("wide")
    expect_value(page, lambda: box_of(circle)["width"], pytest.approx(before, abs=0.5))
    stub.follow_marks = []
    expect(page.locator(".pane-wide .follow")).to_have_count(0)


def test_what_cannot_be_done_and_what_ends_is_told(open_stub: OpenShared, stub: StubServer) -> None:
    put(stub, [followed(1), followed(2, "lost")])
    console = watching(open_stub("#/"), stub)
    page = console.page
    page.locator("#tab-followed").click()
    lost = page.locator('.follow-card[data-state="lost"]')
    expect(lost).to_contain_text("searched for")
    stub.refusals["POST /follows"] = problem(
        409, "Busy", "8 targets are followed already; let one of them go", "let one of them go"
    )
    page.keyboard.press("t")
    page.mouse.click(*console.page_position(400, 300))
    expect(page.locator(".toast")).to_contain_text("8 targets are followed already")
    stub.refusals["PATCH /follows/fol-1"] = problem(404, "Not found", "no target fol-1 is followed")
    tracker = page.locator(".follow-card").first.get_by_label("Tracker")
    tracker.select_option("Filter")
    expect(page.locator(".toast").last).to_contain_text("No target fol-1 is followed")
    expect(tracker).to_have_value("template")

    put(stub, [])
    for number in (1, 2):
        end = {"id": f"fol-{number}", "label": f"Followed {number}", "reason": "the stop was engaged"}
        stub.send_event("follow.ended", end, level="warning")
    expect(page.locator(".toast").last).to_contain_text("“Followed 1”, “Followed 2” are followed no more")
    expect(page.locator(".toast").last).to_contain_text("The stop was engaged.")
    expect(page.locator("#followed .empty")).to_be_visible()


def test_the_page_shows_eight_targets_with_their_trails_also_on_a_phone(
    open_console: OpenConsole, stub: StubServer
) -> None:
    put(stub, [followed(number + 1, STATES[number % 4]) for number in range(8)])
    console = open_console(stub.url)
    page = console.page
    page.get_by_role("button", name="More").click()
    page.get_by_role("link", name="Followed targets").click()
    cards = page.locator("#follow-page .follow-card")
    expect(cards).to_have_count(8)
    expect(plots(page)).to_have_count(8)
    expect(page.locator("#follow-page .pane-wide .follow.followed")).to_have_count(2)
    page.set_viewport_size(PHONE)
    expect_to_fit(page)
    page.set_viewport_size(DESKTOP)
    with page.expect_download() as saved:
        cards.first.get_by_role("button", name="CSV").click()
    assert saved.value.suggested_filename == "trail-Followed-1.csv"
    assert len(lines_of(saved.value)) == 41
    console.wait_for_frames("wide")
    with page.expect_request(is_follow):
        page.mouse.click(*console.page_position(200, 100))
    with page.expect_request(lambda request: request.url.endswith("/follows/rounds")) as asked:
        page.get_by_role("button", name="Capture all").click()
    name = posted(asked.value)["name"]
    assert re.fullmatch(r"round \d{4}-\d\d-\d\d \d\d\.\d\d\.\d\d", name)
    stub.send_event("follow.round", {"capture_id": "cap-9", "name": name, "targets": 8})
    told = page.locator(".toast", has_text=f"{name} is stored")
    expect(told).to_contain_text("One look at each of 8 followed targets.")
    stub.answers_after["DELETE /follows"] = {"/follows": []}
    page.get_by_role("button", name="Let all go").click()
    expect(cards).to_have_count(0)
    told.get_by_role("button", name="Show it in the gallery").click()
    expect(page).to_have_url(re.compile(r"#/gallery/datasets/cap-9$"))
    assert stub.bodies_of("DELETE", "/follows") == [None]


def plots(page: Page) -> Locator:
    return page.locator("#follow-page").get_by_role("img", name="Distance over 40 hits")


@pytest.mark.parametrize("finger", [False, True], ids=["mouse", "finger"])
def test_a_plot_reads_values_and_zooms(open_console: OpenConsole, stub: StubServer, finger: bool) -> None:
    put(stub, [followed(1)])
    console = open_console(f"{stub.url}#/follow", options=TOUCH if finger else None)
    page = console.page
    console.wait_for_frames("wide")
    surface = page.locator("#follow-page .u-over")
    values = page.locator("#follow-page .u-value")

    def expect_s(time_s: float) -> None:  # hits are 0.3 s apart
        box = box_of(surface)
        (surface.tap if finger else surface.hover)(position={"x": 0.1 * box["width"], "y": 20})
        wait_for(page, lambda: number_of(values.first) == pytest.approx(time_s, abs=0.2))

    expect_s(0.9 * -11.7)
    expect(values.nth(1)).to_have_text(re.compile(r"^1\d\.\d{3} ± 0\.050$"))
    (sweep_by_finger if finger else sweep_by_mouse)(page, box_of(surface))
    expect_s((0.6 - 0.1 * 0.2) * -11.7)
    surface.dblclick()
    expect_s(0.9 * -11.7)


def test_a_finger_reads_a_plot_before_it_leaves(open_console: OpenConsole, stub: StubServer) -> None:
    # a press that lasts, also on a slow machine, is no tap: the browser sends no mouse events after it
    put(stub, [followed(1)])
    page = open_console(f"{stub.url}#/follow", options=TOUCH).page
    surface = page.locator("#follow-page .u-over")
    surface.scroll_into_view_if_needed()
    box = box_of(surface)
    touch = {"x": box["x"] + 0.1 * box["width"], "y": box["y"] + 20}
    session = page.context.new_cdp_session(page)
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [touch]})
    value = page.locator("#follow-page .u-value").first
    wait_for(page, lambda: number_of(value) == pytest.approx(0.9 * -11.7, abs=0.2))


def number_of(value: Locator) -> float:
    return float((value.text_content() or "").replace("−", "-").replace("–", "nan"))


def sweep_places(box: FloatRect) -> list[tuple[float, float]]:
    return [(box["x"] + share * box["width"], box["y"] + 20) for share in (0.4, 0.5, 0.6)]


def sweep_by_mouse(page: Page, box: FloatRect) -> None:
    start, *rest = sweep_places(box)
    page.mouse.move(*start)
    page.mouse.down()
    for place in rest:
        page.mouse.move(*place)
    page.mouse.up()


def sweep_by_finger(page: Page, box: FloatRect) -> None:
    session = page.context.new_cdp_session(page)
    kinds = ["touchStart", "touchMove", "touchMove"]
    for kind, (x, y) in zip(kinds, sweep_places(box), strict=True):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def watching(console: Console, stub: StubServer) -> Console:
    """Wait until the page shows the wide view and hears of events."""
    console.wait_for_frames("wide")
    stub.wait_for_listener()
    return console


def centre_of(ring: Locator) -> tuple[float, float]:
    """Return where a ring is now on the page: it moves with every picture."""
    box = ring.bounding_box()
    return (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) if box else (math.nan, math.nan)


def lines_of(download: Download) -> list[str]:
    return Path(download.path()).read_text().splitlines()


def target() -> Document:
    return {
        "id": "tgt-1",
        "label": "Post",
        "fixation_id": "fix-1",
        "created_utc": "2026-03-01T10:00:00Z",
        "x_px": 300.0,
        "y_px": 200.0,
        "ax_deg": 1.0,
        "ay_deg": 0.5,
        "basis": "both_foveae",
        "distance_m": 4.0,
        "distance_sigma_m": 0.01,
        "bound": None,
        "corrections": [],
    }
