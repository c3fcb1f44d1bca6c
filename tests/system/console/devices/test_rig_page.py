"""The rig's page on a server that says what a test has put into it: settings, refusals, what is missing."""

import copy
import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Locator, expect

from tests.support.pages import rig_documents as documents
from tests.support.pages.awaited import box_of, expect_to_fit, expect_value
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared
from tests.support.pages.stub_server import StubServer, problem

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

OpenRig = Callable[..., Console]
REFUSAL = "camera left: exposure 5000 ms is outside 0.03 to 1000 ms; choose one inside"


@pytest.fixture
def open_rig(stub: StubServer, open_console: OpenConsole, open_stub: OpenShared) -> OpenRig:
    def open_(options: dict[str, Any] | None = None) -> Console:  # Any: Playwright's
        console = open_console(f"{stub.url}#/rig", options=options) if options else open_stub("#/rig")
        expect(console.page.locator(".camera .phase")).to_have_count(3)
        return console

    return open_


def camera(console: Console, name: str) -> Locator:
    return console.page.get_by_role("region", name=name, exact=True)


def sent(stub: StubServer, method: str) -> list[tuple[str, Any]]:  # Any: a JSON document
    return [
        (path, body) for asked, path, body in stub.requests if asked == method and path.startswith("/cam")
    ]


def enter(column: Locator, setting: str, value: str) -> None:
    """Type a value, and wait until the server has answered."""
    entry = column.get_by_label(setting, exact=True)
    with column.page.expect_response(lambda answer: answer.request.method == "PATCH"):
        entry.fill(value)
        entry.press("Enter")


def with_camera(stub: StubServer, document: dict[str, Any], **more: object) -> None:  # Any: a JSON document
    rig = copy.deepcopy(stub.answers["/rig"])
    rig["cameras"] = [document if each["role"] == document["role"] else each for each in rig["cameras"]]
    stub.answers["/rig"] = rig | more


def test_each_camera_says_who_it_is_and_how_it_delivers(open_rig: OpenRig) -> None:
    left = camera(open_rig(), "Left fovea")
    expect(left.locator(".phase")).to_have_text("Streaming")
    expect(left.locator(".who")).to_contain_text("Blackfly S BFS-U3-16S2C")
    expect(left.locator(".who")).to_contain_text("serial 22071833 · firmware 1704.0.0.1 · 1440 × 1080 px")
    counters = {
        "Rate": "20.0 Hz",
        "Age": "12 ms",
        "Delivered": "1\u202f234\u202f567",
        "Skipped": "52\u202f100",
        "Dropped": "3",
        "Incomplete": "0",
        "Late": "0",
        "Underrun": "0",
    }
    expect(left.locator(".counters dt")).to_have_text(list(counters))
    expect(left.locator(".counters dd")).to_have_text(list(counters.values()))
    expect(left.get_by_role("img", name="Live picture: Left fovea")).to_be_visible()


def test_typed_value_is_sent_and_what_the_camera_took_is_shown_with_its_difference(
    stub: StubServer, open_rig: OpenRig
) -> None:
    wide = camera(open_rig(), "Wide camera")
    exposure = wide.get_by_label("Exposure", exact=True)
    enter(wide, "Exposure", "16.6666")
    expect(exposure).to_have_value("16.67")
    enter(wide, "Gain", "3.5")
    expect(wide.get_by_role("slider", name="Gain")).to_have_value("146")
    assert sent(stub, "PATCH") == [  # `enter` waits for each answer
        ("/cameras/wide", {"exposure_ms": 16.6666, "linked": False}),
        ("/cameras/wide", {"gain_db": 3.5, "linked": False}),
    ]
    enter(wide, "Exposure", "1.236")
    expect(wide.get_by_text("Requested 1.236 ms, the camera set 1.24 ms.")).to_be_visible()
    expect(wide.get_by_label("Exposure", exact=True)).to_have_value("1.24")


def test_slider_of_the_exposure_is_logarithmic_and_moves_with_the_keys(
    stub: StubServer, open_rig: OpenRig
) -> None:
    console = open_rig()
    slider = camera(console, "Wide camera").get_by_role("slider", name="Exposure")
    slider.focus()
    slider.press("End")
    expect(camera(console, "Wide camera").get_by_label("Exposure", exact=True)).to_have_value("1000")
    slider.press("Home")
    expect(camera(console, "Wide camera").get_by_label("Exposure", exact=True)).to_have_value("0.03")
    box = box_of(slider)
    console.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(slider).to_have_attribute("aria-valuetext", "5.48 ms")  # sqrt(0.03 · 1000), and a slider's step
    expect(camera(console, "Wide camera").get_by_label("Exposure", exact=True)).to_have_value("5.48")


def test_ticks_choose_values_that_suit_the_lamps_and_one_fovea_changes_both(
    stub: StubServer, open_rig: OpenRig
) -> None:
    console = open_rig()
    left = camera(console, "Left fovea")
    left.get_by_role("button", name="Exposure of the left fovea: 8.33 ms").click()
    left.get_by_role("button", name="Frame rate of the left fovea: 100 Hz").click()
    expect(left.get_by_label("Frame rate", exact=True)).to_have_value("100")
    orders = [
        ("/cameras/left", {"exposure_ms": 8.33, "linked": True}),
        ("/cameras/left", {"frame_rate_hz": 100, "linked": False}),  # each eye's own
    ]
    expect_value(console.page, lambda: sent(stub, "PATCH"), orders)
    camera(console, "Right fovea").get_by_label("Pixel format").select_option("Mono8")
    expect(camera(console, "Left fovea").get_by_label("Pixel format")).to_have_value("Mono8")
    expect(console.page.get_by_role("alertdialog")).to_have_count(0)


def test_refused_value_says_the_range_and_the_old_one_stands(stub: StubServer, open_rig: OpenRig) -> None:
    stub.refusals["PATCH /cameras/left"] = problem(422, "Out of range", REFUSAL)
    console = open_rig()
    left = camera(console, "Left fovea")
    enter(left, "Exposure", "5000")
    refused = left.get_by_role("group", name="Exposure of the left fovea").get_by_role("alert")
    expect(refused).to_have_text(
        "Camera left: exposure 5000 ms is outside 0.03 to 1000 ms; choose one inside."
    )
    expect(left.get_by_label("Exposure", exact=True)).to_have_value("8")
    expect(console.page.locator(".toast")).to_have_count(0)  # it is said where it was asked
    stub.refusals.clear()
    enter(left, "Exposure", "4")
    expect(refused).to_be_hidden()


def test_foveae_that_differ_can_be_set_only_after_a_choice(stub: StubServer, open_rig: OpenRig) -> None:
    rig, _ = documents.changed(
        stub.answers["/rig"], "right", {"exposure_ms": 4.0, "pixel_format": "Mono8", "linked": False}
    )
    stub.answers["/rig"] = rig
    console = open_rig()
    asked = console.page.get_by_role("alertdialog")
    expect(asked).to_contain_text("The foveae differ")
    rows = ["Exposure8 ms4 ms", "Pixel formatBayerRG8Mono8"]
    expect(asked.locator("tbody tr")).to_have_text(rows)
    for name in ("Left fovea", "Right fovea"):
        expect(camera(console, name).get_by_label("Exposure", exact=True)).to_be_disabled()
        expect(camera(console, name).get_by_label("Pixel format")).to_be_disabled()
    expect(camera(console, "Wide camera").get_by_label("Exposure", exact=True)).to_be_enabled()
    asked.get_by_role("button", name="Use right's").click()
    expect(asked).to_have_count(0)
    order = ("/cameras/left", {"exposure_ms": 4.0, "pixel_format": "Mono8", "linked": False})
    expect_value(console.page, lambda: sent(stub, "PATCH"), [order])
    expect(camera(console, "Left fovea").get_by_label("Exposure", exact=True)).to_have_value("4")
    expect(camera(console, "Left fovea").get_by_label("Exposure", exact=True)).to_be_enabled()


def test_trigger_that_differs_is_told_and_blocks_nothing(stub: StubServer, open_rig: OpenRig) -> None:
    apart = [{"setting": "trigger", "left": "hardware", "right": "none"}]
    stub.answers["/rig"] = stub.answers["/rig"] | {"divergence": apart}
    console = open_rig()
    expect(console.page.get_by_text("Left: hardware; right: free running.")).to_be_visible()
    expect(camera(console, "Left fovea").get_by_label("Gain", exact=True)).to_be_enabled()


def test_reset_forgets_what_was_set(stub: StubServer, open_rig: OpenRig) -> None:
    wide = camera(open_rig(), "Wide camera")
    reset = wide.get_by_role("button", name="Reset to the rig file")
    expect(reset).to_be_disabled()
    enter(wide, "Black level", "5")
    reset.click()
    expect(wide.get_by_label("Black level", exact=True)).to_have_value("0")
    expect(reset).to_be_disabled()
    assert stub.bodies_of("DELETE", "/cameras/wide/settings") == [None]


def test_lost_camera_says_since_when_and_why_and_takes_nothing(stub: StubServer, open_rig: OpenRig) -> None:
    with_camera(stub, documents.lost("left", "no frame for 1 s; it is opened again in 2 s"))
    console = open_rig()
    left = camera(console, "Left fovea")
    expect(left.locator(".phase")).to_have_text("Lost, trying again")
    expect(left.locator("header .since").first).to_have_text("for 12 s")
    expect(left.locator(".link-state")).to_contain_text("No frame for 1 s; it is opened again in 2 s.")
    expect(left.locator(".notice")).to_contain_text("No frame for 1 s")
    expect(left.get_by_label("Gain", exact=True)).to_be_disabled()
    right = camera(console, "Right fovea")
    enter(right, "Gain", "6")  # alone: the other one would refuse
    assert sent(stub, "PATCH") == [("/cameras/right", {"gain_db": 6, "linked": False})]


def test_picture_that_stands_still_says_since_when_and_why(stub: StubServer, open_rig: OpenRig) -> None:
    link = {
        "phase": "degraded",
        "reason": "9 of the last 10 frames are incomplete",
        "since_s": 4.0,
        "epoch": 1,
    }
    with_camera(stub, documents.camera("wide") | {"link": link})
    wide = camera(open_rig(), "Wide camera")
    expect(wide.locator(".phase")).to_have_text("Degraded")
    badge = wide.locator(".frozen-badge")
    expect(badge).to_have_text(
        re.compile(r"^Frozen since \d\d:\d\d:\d\d: 9 of the last 10 frames are incomplete$"), timeout=15_000
    )


def test_camera_in_other_hands_says_what_to_do(stub: StubServer, open_rig: OpenRig) -> None:
    found = documents.lost("wide", "held by another program")
    held = {"device": "wide camera", "detail": "camera wide is held by another program", "remedy": "close it"}
    with_camera(stub, found, problems=[held], state="degraded")
    expect(camera(open_rig(), "Wide camera").locator(".link-state")).to_contain_text(
        "Camera wide is held by another program."
    )


def test_space_stops_the_mirrors_even_from_a_slider(stub: StubServer, open_rig: OpenRig) -> None:
    console = open_rig()
    camera(console, "Wide camera").get_by_role("slider", name="Gain").focus()
    with console.page.expect_request(lambda order: order.url.endswith("/stop") and order.method == "POST"):
        console.page.keyboard.press("Space")


def test_page_is_usable_on_a_phone_with_the_stop_in_reach(open_rig: OpenRig) -> None:
    console = open_rig(TOUCH)
    expect_to_fit(console.page)
    expect(camera(console, "Rail")).to_be_hidden()
    console.page.get_by_role("link", name="Pan-tilt and rail").click()
    camera(console, "Rail").scroll_into_view_if_needed()
    expect(console.page.get_by_role("button", name="STOP")).to_be_in_viewport()
    small = (
        "[...document.querySelectorAll('#rig-page :is(button, select, input[type=number])')]"
        ".filter(e => e.offsetParent && e.getBoundingClientRect().height < 32).map(e => e.outerHTML)"
    )
    expect_value(console.page, lambda: console.page.evaluate(small), [])


def test_panes_and_pages_come_and_go_with_the_address(open_rig: OpenRig) -> None:
    console = open_rig()
    page = console.page
    page.get_by_role("link", name="Calibrate", exact=True).click()
    expect(page.locator("#calibration")).to_be_visible()
    expect(page.locator("#rig-page")).to_be_hidden()
    page.go_back()
    expect(page.locator("#rig-page .pane-left")).to_be_visible()
    page.locator("#rig-page").get_by_role("link", name="Back to the console").click()
    expect(page.locator("#console .area-eyes .pane-right")).to_be_visible()
    expect(page.locator("#eyes > .pane")).to_have_count(2)
    for index, view in enumerate(("left", "right")):
        expect(page.locator("#eyes > .pane").nth(index)).to_have_attribute("data-view", view)
    expect(page.locator(".pane-wide .surface")).to_have_js_property("inert", False)
