"""Recordings in the browser, on a real server: made by the button, listed, played, measured anew."""

import re
import shutil

import pytest
from playwright.sync_api import APIResponse, Locator, Route, expect

from tests.support.pages.awaited import box_of, expect_to_fit, let_run, settled
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared
from tests.support.scenes.recorded_looks import PERIOD_S, Z_M, look
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

LOOKS = 4
FRAMES = 2 * LOOKS
"""Moments that differ: the wide camera's, and 10 ms later both foveae's."""


@pytest.fixture(scope="module", autouse=True)
def _recorded(page_server: Server) -> None:
    folder = page_server.data / "recordings"
    whole = look(folder / "plane.fcap", looks=LOOKS)
    shutil.copy(whole, folder / "cut off.fcap")
    with (folder / "cut off.fcap").open("r+b") as file:
        file.truncate(whole.stat().st_size // 2)


@pytest.fixture(autouse=True)
def _not_arranged(page_server: Server) -> None:
    for left in (page_server.data / "recordings").glob("*.ui.json"):
        left.unlink()


def card(console: Console, name: str) -> Locator:
    return console.page.locator(".card").filter(
        has=console.page.get_by_role("heading", name=name, exact=True)
    )


def shows(console: Console, role: str, index: int) -> None:
    """Wait until a pane shows that frame."""
    expect(console.page.locator(f".player-{role}")).to_have_attribute(
        "data-shown", re.compile(rf"/frames/{role}/{index}\.jpg")
    )


def test_a_recording_is_stepped_scrubbed_played_and_measured(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/recordings")
    page = console.page
    card(console, "plane").get_by_role("link", name="plane").click()
    step, line = page.locator(".player .step"), page.get_by_role("slider", name="Moment")
    expect(step).to_have_text(f"frame 1 of {FRAMES}")
    shows(console, "wide", 0)
    expect(page.locator(".player-prints polygon")).to_have_count(2)

    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    expect(step).to_have_text(f"frame 3 of {FRAMES}")
    shows(console, "wide", 1)
    line.fill(str(2 * PERIOD_S + 0.01))
    shows(console, "left", 2)
    page.get_by_role("button", name="One frame back").click()
    expect(step).to_have_text(f"frame 5 of {FRAMES}")
    page.keyboard.press("End")
    expect(step).to_have_text(f"frame {FRAMES} of {FRAMES}")

    page.get_by_label("Speed").select_option("0.25")
    page.get_by_role("button", name="Play").click()  # from the begin, as it stood at its end
    expect(step).to_have_text(f"frame {FRAMES} of {FRAMES}")
    expect(page.get_by_role("button", name="Play")).to_be_visible()  # it stopped there by itself
    shows(console, "right", LOOKS - 1)
    page.keyboard.press("a")
    expect(page.locator(".player-anaglyph img")).to_be_visible()
    expect(page.locator(".player-left")).to_be_hidden()

    page.get_by_role("button", name="Compute depth").click()
    expect(page.locator(".depth-centre strong")).to_contain_text(f"{Z_M:.0f}.0")
    expect(page.locator(".depth-centre strong")).to_contain_text("± 0.")
    expect(page.get_by_alt_text("Depth at 0:00.31")).to_be_visible()


def test_one_that_was_cut_off_says_so_is_removed_and_comes_back(
    page_server: Server, open_console: OpenConsole
) -> None:
    console = open_console(f"{page_server.url}#/gallery/recordings", options=TOUCH)
    page = console.page
    expect(card(console, "cut off")).to_contain_text("ends before its recording does")
    expect(card(console, "plane")).to_contain_text("Complete")
    card(console, "cut off").get_by_role("link", name="cut off").click()
    expect(page.locator(".strip.warn").filter(has_text="reading the file through")).to_be_visible()
    shows(console, "wide", 0)
    expect_to_fit(page)

    label = page.locator(".recording-page").get_by_label("Label")
    label.fill("half a plane")
    label.press("Enter")
    expect(page.get_by_text("Saved", exact=True)).to_be_visible()
    page.get_by_role("button", name="Put in the trash").click()
    expect(card(console, "plane")).to_be_visible()
    expect(card(console, "cut off")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(card(console, "cut off")).to_contain_text("half a plane")
    expect_to_fit(page)


def test_the_timeline_zooms_reorders_switches_tracks_off_and_is_found_as_it_was_left(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/recordings")
    page = console.page
    card(console, "plane").get_by_role("link", name="plane").click()
    track = page.locator(".replay-timeline .track")
    expect(track.locator(".track-name")).to_have_text(["Wide", "Left", "Right", "Telemetry"])
    shows(console, "left", 0)

    whole = settled(page, page.locator(".ruler .tick").count)
    line = track.nth(1).locator(".track-line")
    line.hover()
    page.mouse.wheel(0, -800)
    expect(page.locator(".ruler .tick").first).not_to_have_text("0:00.00")
    page.keyboard.press("0")
    expect(page.locator(".ruler .tick")).to_have_count(whole)

    page.get_by_role("button", name="Left", exact=True).click()
    page.keyboard.press("v")
    expect(page.locator(".player-left .no-picture")).to_have_text("Left is switched off in the timeline (V).")
    page.get_by_role("button", name="Left", exact=True).press("Alt+ArrowUp")
    expect(track.locator(".track-name")).to_have_text(["Left", "Wide", "Right", "Telemetry"])
    page.get_by_label("3D", exact=True).select_option("difference")
    page.get_by_role("button", name="Switch on Left").click()
    expect(page.locator(".player-difference img")).to_be_visible()
    page.get_by_role("button", name="Outlines").click()
    expect(page.locator(".player-prints polygon")).to_have_count(0)
    expect(page.locator(".player-prints .verged text")).to_have_text("z 4.00 m")
    box = box_of(line)
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(page.locator(".player .step")).to_have_text("frame 2 of 4")  # of the focused camera
    with page.expect_response(lambda answer: answer.request.method == "PUT" and answer.ok):
        page.get_by_label("Speed").select_option("2")

    page.reload()
    expect(track.locator(".track-name")).to_have_text(["Left", "Wide", "Right", "Telemetry"])
    expect(page.get_by_label("Speed")).to_have_value("2")
    expect(page.locator(".player-difference img")).to_be_visible()
    expect(page.locator(".player-prints .verged")).to_have_count(1)
    expect(page.locator(".player-prints polygon")).to_have_count(0)


def test_panes_stand_in_a_window_of_their_own_and_follow_the_player(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/recordings")
    page = console.page
    card(console, "plane").get_by_role("link", name="plane").click()
    shows(console, "wide", 0)
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Open Wide in a window of its own").click()
    window = opened.value
    pane = window.locator(".player-wide")
    expect(pane).to_have_attribute("data-shown", re.compile(r"/frames/wide/0\.jpg"))
    page.keyboard.press("End")
    expect(pane).to_have_attribute("data-shown", re.compile(rf"/frames/wide/{LOOKS - 1}\.jpg"))
    window.keyboard.press("Home")
    shows(console, "wide", 0)
    window.get_by_label("Split Wide: new pane to the right").click()
    expect(window.locator(".player-left img")).to_be_visible()
    expect(window).to_have_url(re.compile(r"row-500\(wide,left\)"))

    page.goto(f"{page_server.url}#/gallery/recordings")
    expect(window.locator("#lost")).to_contain_text("The player of this recording is closed")
    window.close()


def test_an_arrangement_that_cannot_be_used_asks_before_it_is_overwritten(
    page_server: Server, open_shared: OpenShared
) -> None:
    sidecar = page_server.data / "recordings" / "plane.fcap.ui.json"
    sidecar.write_text("{")
    console = open_shared(f"{page_server.url}#/gallery/recordings")
    page = console.page
    card(console, "plane").get_by_role("link", name="plane").click()
    warning = page.locator(".arrangement")
    expect(warning).to_contain_text("plane.fcap.ui.json cannot be read")
    kept: list[str] = []
    page.on("request", lambda order: kept.append(order.url) if order.method == "PUT" else None)
    page.get_by_label("Speed").select_option("4")
    let_run(page, 1500)  # a change is kept after half of it
    assert kept == []
    assert sidecar.read_text() == "{"

    page.get_by_role("button", name="Overwrite it").click()
    expect(warning).to_be_empty()
    assert "foveacam player layout" in sidecar.read_text()


def test_recordings_are_sent_opened_and_exported(page_server: Server, open_console: OpenConsole) -> None:
    whole = page_server.data / "recordings" / "plane.fcap"
    folder = page_server.data / "import"
    folder.mkdir()
    shutil.copy(whole, folder / "from the lab.fcap")
    console = open_console(f"{page_server.url}#/gallery/recordings", options=TOUCH)
    page = console.page
    choose = page.locator('input[accept=".fcap,.fovea"]')
    choose.set_input_files({"name": "notes.fcap", "mimeType": "", "buffer": b"no recording at all"})
    expect(page.locator(".sending .refused")).to_contain_text('it begins with the text "no recording')
    page.get_by_role("button", name="Forget notes").click()
    choose.set_input_files(whole)
    expect(page.locator(".sending .refused")).to_contain_text("already")
    page.get_by_label("Name of plane").fill("plane again")
    page.get_by_role("button", name="Send it under this name").click()
    expect(card(console, "plane again")).to_contain_text("Complete")
    expect(page.locator(".sending")).to_have_count(0)
    page.get_by_role("button", name="On the server's machine").click()
    page.locator(".folder-files").get_by_role("button", name="Open", exact=True).click()
    expect(card(console, "from the lab")).to_contain_text("Complete")
    expect_to_fit(page)

    card(console, "plane again").get_by_role("link", name="plane again").click()
    page.locator(".recording-page").get_by_label("Format").select_option("prores")
    with page.expect_download() as made:
        page.get_by_role("button", name="Export", exact=True).click()
    assert made.value.suggested_filename.endswith(".mov")
    expect_to_fit(page)
    for name in ("plane again", "from the lab"):  # the tests of the other recordings count the cards
        (page_server.data / "recordings" / f"{name}.fcap").unlink()


def test_the_button_in_the_bar_records_until_it_is_pressed_again(
    page_server: Server, open_console: OpenConsole
) -> None:
    console = open_console(page_server.url)
    page = console.page
    page.get_by_role("button", name="Record", exact=True).click()
    stop = page.get_by_role("button", name="Stop the recording")
    expect(stop).to_contain_text("0 dropped")
    page.goto(f"{page_server.url}#/gallery/recordings")
    live = page.locator(".card").filter(has_text="Being recorded")
    expect(live).to_contain_text("Recording")
    expect(live.locator(".tally-words")).to_contain_text(re.compile(r"\b[1-9]\d* frames, none dropped"))

    stop.click()

    expect(page.get_by_role("button", name="Record", exact=True)).to_be_visible()
    expect(live).to_have_count(0)
    expect(page.locator(".card")).to_have_count(3)
    expect(page.locator(".card").first).to_contain_text("Complete")
    expect(page.locator(".card").first).to_contain_text("recording 0001")
    page.get_by_role("button", name="Show it").click()
    expect(page.locator(".player .step")).to_contain_text("frame 1 of")


def test_a_press_ends_a_recording_whose_begin_is_still_to_be_answered(
    page_server: Server, open_shared: OpenShared
) -> None:
    page = open_shared(f"{page_server.url}#/gallery/recordings").page
    held: list[tuple[Route, APIResponse]] = []

    def hold_begin(route: Route) -> None:
        if route.request.method == "POST":
            held.append((route, route.fetch()))
        else:
            route.continue_()

    page.route("**/api/v1/recordings", hold_begin)
    page.get_by_role("button", name="Record", exact=True).click()
    live = page.locator(".card").filter(has_text="Being recorded")
    expect(live.locator(".tally-words")).to_contain_text(re.compile(r"\b[1-9]\d* frames"))

    page.get_by_role("button", name="Stop the recording").click()

    expect(page.get_by_role("button", name="Record", exact=True)).to_be_visible()
    [(route, begun)] = held
    route.fulfill(response=begun)
    page.unroute_all()


def test_an_end_is_shown_although_an_older_answer_comes_while_the_list_is_read(
    page_server: Server, open_shared: OpenShared
) -> None:
    page = open_shared(f"{page_server.url}#/gallery/recordings").page
    page.get_by_role("button", name="Record", exact=True).click()
    live = page.locator(".card").filter(has_text="Being recorded")
    expect(live.locator(".tally-words")).to_contain_text(re.compile(r"\b[1-9]\d* frames"))  # it has started
    older: list[Route] = []
    later: list[Route] = []

    def answer_list(route: Route) -> None:
        found = route.fetch()
        for each in older:
            each.fulfill(json=being_made | {"state": "ending"})
        older.clear()
        route.fulfill(response=found)

    [being_made] = [
        found for found in page_server.send("GET", "/recordings").json() if found["state"] == "recording"
    ]
    page.route(f"**/api/v1/recordings/{being_made['id']}", lambda route: older.append(route))
    page.wait_for_event("request", lambda request: request.url.endswith(being_made["id"]))
    page.route("**/api/v1/recordings", lambda route: later.append(route))
    page.route("**/api/v1/recordings?text=*", answer_list)
    page_server.send("POST", f"/recordings/{being_made['id']}/stop")
    with page.expect_response("**/api/v1/recordings?text=*"):
        pass
    for route in later:
        route.continue_()
    page.unroute_all()
    expect(live).to_have_count(0)


def test_a_key_records_under_the_next_number_of_the_prefix(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/recordings")
    page = console.page
    page.get_by_role("button", name="How to record").click()
    prefix = page.get_by_label("Name, before its number")
    prefix.fill("../walk")
    expect(prefix).to_have_attribute("aria-invalid", "true")
    expect(page.locator(".record-options .refused")).to_contain_text("begins with a dot")
    prefix.fill("walk")
    expect(page.locator(".record-options .why").first).to_contain_text("is named “walk 0001”")
    page.get_by_label("Compress each frame").check()
    page.get_by_role("button", name="How to record").focus()  # a field keeps its letters

    page.keyboard.press("r")
    expect(page.get_by_role("button", name="Stop the recording “walk 0001”")).to_contain_text("0 dropped")
    expect(page.locator(".record-options .why").first).to_contain_text("is named “walk 0002”")
    page.keyboard.press("r")
    expect(page.get_by_role("button", name="Record", exact=True)).to_be_visible()
    expect(card(console, "walk 0001")).to_contain_text("Complete")
