"""The vergence loop's page: target, status, axes, drag, settings, match, tuning."""

import re
import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, Page, Request, Response, expect

from tests.support.pages.awaited import expect_to_fit, expect_value, settled, wait_for
from tests.support.pages.calibration_documents import Document, job
from tests.support.pages.console_page import PHONE, Console, OpenConsole, OpenShared, posted
from tests.support.pages.stub_server import StubServer, problem
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

CLICKED_PX = (812.0, 420.0)  # the poster of the scene "bench"
SETTLED_WITHIN_S = 10.0
AXES = ["pan_x", "pan_y", "verge", "shift_y"]
TUNED = {
    "tuned_utc": "2026-03-01T10:00:00Z",
    "settings": {},
    "relays": [
        {"axis": axis, "amplitude_deg": 0.1, "swing_deg": 0.1, "period_looks": 2.0, "ultimate_gain": 1.2}
        for axis in AXES
    ],
    "steps": [
        {
            "axis": "verge",
            "settle_before_ms": None,
            "settle_ms": 412.0,
            "overshoot_before": 0.0,
            "overshoot": 0.05,
        }
    ],
    "cost_before": 0.88,
    "cost_relay": 0.4,
    "cost": 0.36,
    "candidates": 0,
    "picture_url": "/api/v1/loop/tune.png",
}


@pytest.fixture
def loop_page(open_shared: OpenShared, page_server: Server) -> Iterator[Console]:
    """The page on the simulated rig; the loop has ended and its settings are the defaults afterwards."""
    console = open_shared(f"{page_server.url}#/loop")
    console.wait_for_frames("wide")
    yield console
    page_server.send("DELETE", "/loop")
    page_server.send("DELETE", "/loop/settings")
    page_server.be_idle()


def status(page: Page) -> Locator:
    return page.locator("#loop-page .loop-status")


def start(console: Console) -> Request:
    """Click on the poster and wait until the loop tracks it; return the order."""
    with console.page.expect_request(is_target) as order:
        console.page.mouse.click(*console.page_position(*CLICKED_PX))
    expect(status(console.page)).to_have_attribute("data-status", "tracking")
    return order.value


def until_tracked(server: Server, expected_px: tuple[float, float]) -> None:
    """Wait until the target is within 4 px: led by its estimated velocity, it swings when frames are late."""
    deadline_s = time.monotonic() + SETTLED_WITHIN_S
    while True:
        target = server.get("/loop")["target"]
        target_px = (target["x_px"], target["y_px"])
        if target_px == pytest.approx(expected_px, abs=4.0):
            return
        assert time.monotonic() < deadline_s, f"the target is still at {target_px}, not {expected_px}"
        time.sleep(0.1)


def is_target(request: Request) -> bool:
    return request.method == "POST" and request.url.endswith("/api/v1/loop")


def answers_settings(response: Response) -> bool:
    return response.request.method == "PATCH" and response.url.endswith("/loop/settings")


def test_a_click_starts_the_loop_which_shows_its_match_is_paused_goes_on_and_ends(loop_page: Console) -> None:
    page = loop_page.page
    expect(page.locator("#loop-page .detail")).to_contain_text("Click in the wide view")
    body = posted(start(loop_page))
    assert body["pixel"]["x_px"] == pytest.approx(CLICKED_PX[0], abs=0.6)
    assert body["frame_seq"] > 0
    expect(status(page).locator(".distance")).to_have_text(re.compile(r"^\d+(\.\d+)? ± \d+(\.\d+)? m$"))
    expect(
        page.locator("#loop-page").get_by_role("img", name=re.compile("^(Errors of|Distance with)"))
    ).to_have_count(2)
    check_match(loop_page)
    page.keyboard.press("p")
    expect(status(page)).to_have_attribute("data-status", "held")
    page.get_by_role("button", name="Go on").click()
    expect(status(page)).to_have_attribute("data-status", "tracking")
    page.get_by_role("button", name="End").click()
    expect(status(page)).to_have_attribute("data-status", "off")
    expect(page.locator(".toast")).to_have_count(0)


def check_match(console: Console) -> None:
    """Check that what the loop matches is loaded while it is shown, and only then."""
    picture = console.page.locator(".loop-match img")
    expect(picture).to_have_count(0)
    console.page.get_by_text("What the loop matches").click()
    console.wait_until("(document.querySelector('.loop-match img')?.naturalWidth ?? 0) > 100")
    first = settled(console.page, lambda: picture.get_attribute("src"))
    expect(picture).not_to_have_attribute("src", first)
    console.page.get_by_text("What the loop matches").click()
    expect(picture).to_be_hidden()


def test_a_slider_moves_its_axis_which_is_held_until_it_is_released(
    loop_page: Console, page_server: Server
) -> None:
    page = loop_page.page
    start(loop_page)
    shift = page.locator('.axis[data-axis="shift_y"]')
    hold = shift.get_by_role("button", name="Hold Vertical shift")
    expect(hold).to_have_attribute("aria-pressed", "false")
    shift.get_by_role("slider").press("PageUp")
    expect(hold).to_have_attribute("aria-pressed", "true")
    wait_for(page, lambda: axis_of(page_server, "shift_y")["command_deg"] > 0.1)
    shift.get_by_role("spinbutton").fill("-0.25")
    shift.get_by_role("spinbutton").press("Enter")
    expect(shift.get_by_role("spinbutton")).to_have_value("-0.250")
    loop_page.wait_until("document.querySelector('.axis[data-axis=shift_y] input[type=range]').value < 460")
    expect_value(page, lambda: axis_of(page_server, "shift_y")["command_deg"], pytest.approx(-0.25))
    shift.get_by_role("spinbutton").fill("9")
    shift.get_by_role("spinbutton").press("Enter")
    expect(shift.get_by_role("alert")).to_have_text("9° is out of its range, -2.0° to 2.0°.")
    expect(shift.get_by_role("spinbutton")).to_have_value("-0.250")
    hold.click()
    expect(hold).to_have_attribute("aria-pressed", "false")


def test_alt_drag_takes_the_eyes_then_the_target_and_a_click_in_one_eyes_picture_parts_them(
    loop_page: Console, page_server: Server
) -> None:
    page = loop_page.page
    start(loop_page)
    page.keyboard.down("Alt")
    page.mouse.move(*loop_page.page_position(800, 600))
    page.mouse.down()
    page.mouse.move(*loop_page.page_position(700, 640), steps=8)
    expect(status(page)).to_have_attribute("data-status", "manual")
    page.mouse.up()
    page.keyboard.up("Alt")
    expect(status(page)).to_have_attribute("data-status", "tracking")
    until_tracked(page_server, CLICKED_PX)
    page.locator("#loop-page .lent-left canvas").first.click(position={"x": 150, "y": 80})
    expect(status(page)).to_have_attribute("data-status", "split")
    page.get_by_role("button", name="Unite the eyes").click()
    expect(status(page)).to_have_attribute("data-status", "tracking")


def test_a_setting_changes_is_refused_where_it_was_typed_and_is_put_back(
    loop_page: Console, page_server: Server
) -> None:
    page = loop_page.page
    gain = page.get_by_role("group", name="Kp of the pan")
    number = gain.get_by_role("spinbutton")
    number.fill("0.35")
    with page.expect_response(answers_settings):
        number.press("Enter")
    assert page_server.get("/loop")["settings"]["pan"] == {"kp": 0.35, "ki": 0.02, "kd": 0.0}
    number.fill("5")
    number.press("Enter")
    expect(gain.get_by_role("alert")).to_contain_text("at most 2")
    expect(number).to_have_value("0.35")
    with page.expect_response(answers_settings):
        page.get_by_label("Correct for, mode").select_option("never")
    with page.expect_response(answers_settings):
        page.get_by_label("Tracker", exact=True).select_option("off")
    kept = page_server.get("/loop")["settings"]
    assert (kept["correct_for_ms"], kept["tracker"]) == (0.0, "off")
    page.get_by_role("button", name="Reset Pan gains").click()
    expect(number).to_have_value("0.1")
    assert page_server.get("/loop")["settings"]["tracker"] == "off"
    page.get_by_role("button", name="Reset all settings").click()
    expect(page.get_by_label("Tracker", exact=True)).to_have_value("template")


def test_tuning_shows_its_progress_why_it_ended_and_its_result(
    open_console: OpenConsole, stub: StubServer
) -> None:
    stub.answers["/loop"] = loop_document()
    stub.answers["/loop/history"] = []
    console = open_console(f"{stub.url}#/loop")
    page = console.page
    stub.refusals["POST /loop/tune"] = problem(409, "Busy", "the loop is being tuned already")
    tune = page.get_by_role("button", name="Tune", exact=True)
    tune.click()
    expect(page.locator("#loop-page .refused[role=alert]", has_text="tuned already")).to_be_visible()
    stub.refusals.clear()
    running = tuning_job("running", {"done": 3, "total": 7, "eta_s": 40.0, "note": "axes"})
    stub.answers["/loop/tune"] = stub.answers["/jobs/job-2"] = running
    tune.click()
    expect(page.locator("#loop-page .job")).to_contain_text("3 of 7 axes, 40 s left")
    expect(tune).to_be_disabled()
    stub.answers["/jobs/job-2/cancel"] = running | {"state": "cancelling"}
    page.get_by_role("button", name="Abort").click()
    stub.answers["/jobs/job-2"] = tuning_job("cancelled", running["progress"])
    expect(page.get_by_text("Aborted: the gains are as before.")).to_be_visible()
    stub.answers["/loop/tune"] = stub.answers["/jobs/job-2"] = tuning_job("succeeded", running["progress"])
    stub.answers["/loop"] = loop_document(tuned=TUNED)
    with page.expect_response(lambda answer: answer.url.endswith("/loop/tune")):
        page.get_by_role("button", name="Tune and polish").click()
    expect(page.locator("#loop-page .tuned tbody tr")).to_have_count(4)
    assert stub.posted_bodies("/loop/tune", count=3) == [
        {"polish": False},
        {"polish": False},
        {"polish": True},
    ]


def test_the_page_fits_a_phone_and_a_latched_trigger_is_reset(
    open_console: OpenConsole, stub: StubServer
) -> None:
    reason = "no strobe came: is the trigger line of the left eye connected?"
    latched = loop_document(status="trigger_fault", tuned=TUNED)
    latched["trigger"] |= {"latched": True, "reason": reason}
    stub.answers["/loop"] = latched
    stub.answers["/loop/history"] = []
    console = open_console(f"{stub.url}#/loop", options={"viewport": PHONE})
    expect(console.page.locator("#loop-page .strip.warn")).to_contain_text(reason)
    expect_to_fit(console.page)
    passing = loop_document()
    stub.answers_after["POST /loop/trigger/reset"] = {"/loop": passing, "/loop/trigger/reset": passing}
    console.page.get_by_role("button", name="Reset trigger").click()
    expect(console.page.locator("#loop-page .strip.warn")).to_have_count(0)


def axis_of(server: Server, name: str) -> Document:
    found: Document = next(one for one in server.get("/loop")["axes"] if one["axis"] == name)
    return found


def tuning_job(state: str, progress: Document) -> Document:
    return job("job-2", kind="loop_tune", state=state, changes={"progress": progress})


def loop_document(**changes: object) -> Document:
    """Return a loop that tracks."""
    gains = {"kp": 0.1, "ki": 0.02, "kd": 0.0}
    document: Document = {
        "running": True,
        "job_id": "job-1",
        "tune_job_id": None,
        "status": "tracking",
        "detail": "",
        "paused": False,
        "dragged": False,
        "looks": 12,
        "rate_hz": 8.0,
        "lead_ms": 33.0,
        "target": {"x_px": 300.0, "y_px": 200.0, "state": "tracked", "tracker_score": 0.98},
        "axes": [
            {
                "axis": axis,
                "command_deg": 1.4 if axis == "verge" else 0.0,
                "error_deg": 0.001,
                "least_deg": 0.0 if axis == "verge" else -2.0,
                "most_deg": 76.0 if axis == "verge" else 2.0,
                "held": False,
            }
            for axis in AXES
        ],
        "distance_m": 8.0,
        "distance_sigma_m": 0.01,
        "point_rig_m": [0.0, 0.0, 8.0],
        "fine": True,
        "eyes": [],
        "score_left": 0.84,
        "score_right": 0.85,
        "trigger": {
            "exposures": 40,
            "failures": 3,
            "in_a_row": 3,
            "latched": False,
            "reason": None,
            "pair_skew_us": 0.0,
            "after_trigger_us": 150.0,
            "wide_age_ms": 20.0,
        },
        "settings": {
            "sensitivity": 0.1,
            "template_scale": 0.333,
            "min_score": 0.2,
            "correct_for_ms": None,
            "expand_x": 3.0,
            "expand_y": 2.0,
            "pan": gains,
            "depth": gains,
            "vertical": gains,
            "tracker": "template",
            "box_width_px": 64,
            "box_height_px": 64,
            "predict": True,
            "lead_ms": 0.0,
            "most_hz": None,
        },
        "tuned": None,
    }
    return document | changes
