"""The operator's work: look, read the result, keep targets, stop, and be told what is wrong."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Playwright, expect

from foveacam_bench.stream.console_page import CHROMIUM_ARGUMENTS
from tests.support.pages.awaited import (
    box_of,
    expect_to_fit,
    expect_value,
    let_run,
    match_of,
    settled,
    wait_for,
)
from tests.support.pages.console_page import (
    BROWSER,
    DESKTOP,
    PHONE,
    TOUCH,
    Console,
    OpenConsole,
    OpenShared,
    console_of,
    contexts,
)
from tests.support.pages.stub_server import StubServer
from tests.support.servers.running_server import running
from tests.support.servers.server_process import Server, server_of

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

TEXTURED_PX = (812.0, 420.0)  # the poster of the scene "bench"
LONG = "A name as long as the rig takes: the third bolt from the left on the flange 80"


@pytest.fixture
def console(open_shared: OpenShared, page_server: Server) -> Console:
    page_server.be_idle()
    found = open_shared(page_server.url)
    found.wait_for_frames("wide")
    return found


def new_target(console: Console, server: Server) -> Locator:
    """Look at something, and return its row once it stands in the list: the distance is there before it."""
    rows = console.page.locator(".targets li")
    for target in server.send("GET", "/targets").json():  # a click on one that is there would correct it
        server.send("DELETE", f"/targets/{target['id']}")
    expect(rows).to_have_count(0)
    console.fixate(*TEXTURED_PX)
    expect(rows).to_have_count(1)
    return rows.first


def test_click_ends_with_a_distance_and_its_error(console: Console, page_server: Server) -> None:
    console.fixate(*TEXTURED_PX)
    match = match_of(console.page.locator("[data-role=distance]"), r"(\d+\.\d+)\s±\s(\d+\.\d+)\sm")
    kept = page_server.send("GET", "/fixations?limit=1").json()[0]
    assert float(match[1]) == pytest.approx(kept["distance_m"], abs=float(match[2]))
    assert float(match[2]) == pytest.approx(kept["distance_sigma_m"], rel=0.06)
    expect(console.page.locator("#fixation .state.good")).to_have_text("Measured by both foveae")
    steps = len(kept["steps"])
    console.page.locator("#fixation .details > summary").click()
    plot = console.page.locator("#fixation").get_by_role("img", name=f"Residual per step: {steps} steps")
    expect(plot).to_be_visible()
    expect(console.page.locator("#fixation .steps tbody tr")).to_have_count(steps)


def test_escape_cancels_the_fixation_that_runs(console: Console, page_server: Server) -> None:
    for _ in range(4):  # its own comes after these: it is not over before Escape is pressed
        page_server.send("POST", "/fixations", {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}})
    console.click(*TEXTURED_PX)
    console.page.locator("#fixation button", has_text="Cancel").and_(
        console.page.locator(":enabled")
    ).wait_for()
    with console.page.expect_response(re.compile("/cancel$")) as cancel:
        console.page.keyboard.press("Escape")
    assert cancel.value.ok


def test_target_is_renamed_looked_at_again_and_deleted_with_undo(
    console: Console, page_server: Server
) -> None:
    row = new_target(console, page_server)
    name = row.get_by_role("textbox")
    name.fill("two")
    name.press("Space")  # a space, and no stop
    expect(name).to_have_value("two ")
    name.fill(LONG)
    with console.page.expect_response(lambda answer: answer.request.method == "PATCH"):
        row.get_by_role("textbox").press("Enter")
    assert (
        page_server.get("/stop")["engaged"] is False
    )  # an order by the space would have come before this answer
    expect_to_fit(console.page)
    with console.page.expect_response(re.compile(r"/targets/.*/fixate$")) as again:
        row.get_by_role("button", name="Look again").click()
    assert again.value.status == 202
    row.get_by_role("button", name="Delete").click()
    expect(console.page.locator(".targets li")).to_have_count(0)
    console.page.get_by_role("button", name="Undo").click()
    expect(console.page.locator(".targets li")).to_have_count(1)
    assert LONG in [target["label"] for target in page_server.send("GET", "/targets").json()]


def test_space_stops_even_with_a_button_focused_and_moving_is_refused_until_released(
    console: Console, page_server: Server
) -> None:
    console.page.get_by_role("button", name="Help").focus()
    console.page.keyboard.press("Space")
    console.page.locator("#stopped", has_text="parked").wait_for()
    assert page_server.get("/stop")["engaged"] is True
    expect(console.page.locator("dialog[open]")).to_have_count(0)
    console.click(*TEXTURED_PX)
    toast = console.page.locator(".toast")
    toast.get_by_role("button", name="Release the stop").click()
    console.page.locator("#stopped").wait_for(state="hidden")
    assert page_server.get("/stop")["engaged"] is False


def test_refused_click_names_who_has_control_and_is_counted(console: Console, page_server: Server) -> None:
    grant = page_server.send("POST", "/lease", {"holder": "Grace"}).json()
    try:
        console.click(*TEXTURED_PX)
        toast = console.page.locator(".toast")
        expect(toast).to_contain_text("Grace")
        expect(toast).to_contain_text("ask Grace, wait, or take over")  # once, not as a remedy again
        console.click(700.0, 500.0)
        expect(toast).to_contain_text("×2")
        expect(console.page.locator(".badge.button")).to_have_text("Grace has control")
    finally:
        page_server.send("DELETE", "/lease", headers={"X-Lease": grant["token"]})


def test_control_is_taken_and_given_back(console: Console, page_server: Server) -> None:
    console.page.get_by_role("button", name="Control is free").click()
    console.page.get_by_label("Your name").fill("Ada")
    console.page.get_by_role("button", name="Take control").click()
    expect(console.page.locator(".badge.mine")).to_have_text("You have control")
    assert page_server.get("/lease")["holder"] == "Ada"
    console.page.keyboard.press("Escape")
    console.fixate(*TEXTURED_PX)
    console.page.locator(".badge.mine").click()
    console.page.get_by_role("button", name="Give it back").click()
    expect(console.page.locator(".badge.button")).to_have_text("Control is free")


def test_dark_and_light_follow_the_system_and_the_button(open_console: OpenConsole, stub: StubServer) -> None:
    page = open_console(stub.url, options={"viewport": DESKTOP, "color_scheme": "dark"}).page
    ground = page.locator("body")
    dark: str = settled(page, lambda: ground.evaluate("body => getComputedStyle(body).backgroundColor"))
    page.emulate_media(color_scheme="light")
    page.reload()
    expect(ground).not_to_have_css("background-color", dark)
    page.get_by_role("button", name="More").click()
    page.get_by_role("button", name="Dark or light").click()
    expect(ground).to_have_css("background-color", dark)


@pytest.mark.parametrize("path", ["", "view"])
def test_phone_needs_no_scrolling_sideways(open_console: OpenConsole, page_server: Server, path: str) -> None:
    phone = open_console(page_server.url + path, options=TOUCH)
    phone.wait_for_frames("wide", "left")
    expect_to_fit(phone.page)
    stop = box_of(phone.page.locator("#stop"))
    assert stop["x"] + stop["width"] <= PHONE["width"]
    assert stop["y"] + stop["height"] <= PHONE["height"]


def test_help_and_settings_open_by_key_and_close_by_escape(console: Console) -> None:
    console.page.keyboard.press("?")
    expect(console.page.locator("dialog[open]")).to_contain_text("STOP: park the mirrors now")
    expect(console.page.locator("dialog[open] dl a[href*='/guide/']")).to_have_count(6)
    console.page.keyboard.press("Escape")
    expect(console.page.locator("dialog[open]")).to_have_count(0)
    console.page.keyboard.press("i")
    expect(console.page.locator(".pane-wide .rate")).to_be_hidden()


def test_missing_devices_are_named_with_their_remedy(open_console: OpenConsole, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        'kind = "serial"\nrig_id = "bench-two"\nname = "Bench two"\n[mirrors]\nport = "/dev/ttyNOWHERE"\n'
    )
    with running(tmp_path / "data", rig=str(rig)) as found:
        console = open_console(server_of(found).url)
        problems = console.page.locator("#problems")
        expect(problems).to_contain_text("/dev/ttyNOWHERE")
        expect(console.page.locator(".pane-wide .notice")).to_contain_text("No wide camera")
        expect(console.page.locator(".badge.warn").first).to_have_text("Degraded")
        console.page.locator("#rig tr.missing").first.wait_for()


def test_page_without_webgl_says_so_and_works(
    playwright: Playwright, page_server: Server, browser: Browser
) -> None:
    page_server.be_idle()
    plain = playwright.chromium.launch(
        executable_path=BROWSER, args=[*CHROMIUM_ARGUMENTS, "--disable-3d-apis"]
    )
    try:
        with contexts(plain, {"scene": True}, {}) as context:
            console = console_of(context.new_page())
            console.load(page_server.url)
            console.page.get_by_text("this browser has no WebGL").wait_for()
            console.wait_for_frames("wide", "left", "right")
            console.fixate(*TEXTURED_PX)
            console.page.locator("#scene a", has_text="PLY").wait_for()
            assert console.errors == []
    finally:
        plain.close()


def test_3d_pane_loads_beside_the_views_and_leaves_the_keyboard_alone(
    open_console: OpenConsole, page_server: Server
) -> None:
    page_server.be_idle()
    console = open_console(page_server.url, settings={"scene": True})
    canvas = console.page.frame_locator("#scene iframe").locator("canvas[data-engine]")
    canvas.wait_for()
    console.wait_for_frames("wide", "left", "right")
    expect(console.page.locator("body")).to_be_focused()
    canvas.click(position={"x": 30, "y": 60})
    console.page.keyboard.press("Space")
    console.page.locator("#stopped", has_text="parked").wait_for()


def test_the_3d_pane_below_the_fold_does_not_scroll_the_page_to_itself(
    open_console: OpenConsole, tmp_path: Path
) -> None:
    with running(tmp_path / "data", viewer=True) as found:
        page = open_console(
            server_of(found).url,
            settings={"scene": True},
            options={"viewport": {"width": 1024, "height": 768}},
        ).page
        scene = page.frame_locator("#scene iframe")
        scene.locator("[data-dock-minimize]").first.wait_for(state="attached")  # viser gives the focus to it
        let_run(page, 1000)
        expect_value(page, lambda: page.evaluate("scrollY"), 0)


@pytest.mark.parametrize(
    "options",
    [{"viewport": DESKTOP}, {"viewport": {"width": 1120, "height": 700}}, TOUCH],
    ids=["desktop", "small desktop", "phone"],
)
def test_known_share_of_the_depth_is_worded_in_full_in_the_head_of_the_3d_pane(
    open_console: OpenConsole, stub: StubServer, options: dict[str, object]
) -> None:
    stub.answers["/wide_depth"] = {
        "known_cells": 40,
        "known_fraction": 0.0213,
        "nearest_m": 1.8,
        "farthest_m": 8.0,
        "survey_job_id": None,
    }
    head = open_console(stub.url, options=options).page.locator(".area-scene > header")
    share, link = head.locator(".wide-depth-known"), head.get_by_role("link", name="Open in a tab")
    expect(share).to_have_text("Depth known in 2 % of the view")
    share_box, link_box, head_box = box_of(share), box_of(link), box_of(head)
    assert max(share_box["height"], link_box["height"]) < 32  # one line each
    beside = share_box["x"] + share_box["width"] <= link_box["x"]
    assert beside or share_box["y"] >= link_box["y"] + link_box["height"]
    wait_for(head.page, lambda: head.evaluate("head => head.scrollWidth <= head.clientWidth"))
    assert share_box["y"] + share_box["height"] <= head_box["y"] + head_box["height"]
    share.click()  # shows the view of it on this page
    expect(head.page.locator(".pane-wide_depth")).to_be_visible()
    assert len(head.page.context.pages) == 1
