"""The views: they come, they are where they say, and the gestures on the wide one mean what they should."""

import json
import re

import cv2
import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import CDPSession, WebSocket, expect

from tests.support.pages.awaited import box_of, expect_to_fit, expect_value, settled
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared, is_fixation, posted
from tests.support.servers.server_process import PATIENCE_S, Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

CLICK_TOLERANCE_PX = 0.01  # the figure to reach; the arithmetic itself holds 1e-4
PICTURE_TOLERANCE_PX = 0.1  # sub-pixel registration of a bilinear picture with JPEG noise


@pytest.fixture
def console(open_shared: OpenShared, page_server: Server) -> Console:
    page_server.be_idle()
    found = open_shared(page_server.url)
    found.page.keyboard.press("0")  # the whole picture
    found.wait_for_frames("wide", "left", "right")
    return found


def zoom_to(console: Console, x_px: float, y_px: float, *, steps: int) -> None:
    console.page.mouse.move(*console.page_position(x_px, y_px))
    for _ in range(steps):
        console.page.mouse.wheel(0, -120)
    console.wait_until(f"document.querySelector('.pane-wide .zoom').textContent !== '100 %' || {steps} === 0")


def test_page_shows_what_the_rig_is_and_the_views_of_both_eyes_live_without_a_fixation(
    console: Console,
) -> None:
    expect(console.page).to_have_title("FoveaCam Duo")
    expect(console.page.locator(".rig-name")).to_have_text("Simulated FoveaCam Duo")
    console.page.locator(".badge.good", has_text="Ready").wait_for()
    console.page.locator(".badge", has_text="Calibrated").wait_for()
    for view in ("anaglyph", "difference", "depth", "wide_zoom"):
        if view == "wide_zoom":
            console.page.get_by_label("Other views of both eyes").select_option("Wide zoomed")
        else:
            console.page.locator(f"#tab-{view}").click()
        console.wait_for_frames(view)
        expect(console.page.locator(f".pane-{view} .rate")).to_have_text(re.compile(r"fps"))


def test_views_that_do_not_fit_stand_in_a_list_and_keep_to_the_keys(console: Console) -> None:
    page, rest = console.page, console.page.get_by_label("Other views of both eyes")
    tabs = page.get_by_role("tablist", name="Views of both eyes").get_by_role("tab")
    expect(tabs).to_have_text(["Anaglyph", "Difference", "Depth"])
    expect(rest.locator("option")).to_have_text(["More", "Wide depth", "Wide zoomed"])
    page.locator("#tab-anaglyph").click()
    page.keyboard.press("ArrowLeft")
    expect(rest).to_be_focused()
    expect(rest).to_have_value("wide_zoom")
    expect(page.locator(".pane-wide_zoom")).to_be_visible()
    page.set_viewport_size({"width": 2400, "height": 900})
    expect(tabs).to_have_count(5)
    expect(rest).to_be_hidden()
    expect(page.locator("#tab-wide_zoom")).to_have_attribute("aria-selected", "true")


def test_views_page_shows_the_same_views_alone(open_console: OpenConsole, page_server: Server) -> None:
    views = open_console(f"{page_server.url}view", options={"viewport": {"width": 440, "height": 700}})
    views.wait_for_frames("wide", "left", "right")
    expect(views.page.locator("#targets")).to_have_count(0)
    expect_to_fit(views.page)


@pytest.mark.parametrize("zoom_steps", [0, 14])
def test_click_asks_for_the_pixel_meant(console: Console, zoom_steps: int) -> None:
    zoom_to(console, 812.25, 431.6, steps=zoom_steps)
    console.page.keyboard.down("Shift")
    x, y = console.page_position(812.25, 431.6)
    console.page.mouse.move(x, y)
    console.page.mouse.down()
    console.page.mouse.move(x + 17.3, y - 9.1)
    console.page.mouse.up()
    console.page.keyboard.up("Shift")
    asked = posted(console.click(805.125, 433.75))["pixel"]
    assert abs(asked["x_px"] - 805.125) < CLICK_TOLERANCE_PX
    assert abs(asked["y_px"] - 433.75) < CLICK_TOLERANCE_PX


def test_picture_is_drawn_where_clicks_say_it_is(open_console: OpenConsole, page_server: Server) -> None:
    bare = {"footprints": False, "field": False, "marks": False, "wide_size": "full"}
    console = open_console(page_server.url, settings=bare)
    console.wait_for_frames("wide")
    zoom_to(console, 600.0, 500.0, steps=4)
    console.page.mouse.move(5, 5)
    console.wait_for_frames("wide")
    surface = console.page.locator(".pane-wide .surface")
    box = box_of(surface)
    x, y = float(np.ceil(box["x"]) + 20), float(np.ceil(box["y"]) + 20)
    seen = grey(console.page.screenshot(clip={"x": x, "y": y, "width": 512, "height": 384}))
    snapshot = grey(
        httpx.get(
            f"{page_server.url}api/v1/views/wide/snapshot.jpg", trust_env=False, timeout=PATIENCE_S
        ).content
    )
    left, top, width = console.wide_box()
    per_css = 1440.0 / width
    origin_px = np.array([x + 0.5 - left, y + 0.5 - top]) * per_css - 0.5
    binning = 1440 // snapshot.shape[1]
    origin_px = (origin_px + 0.5) / binning - 0.5
    scale = per_css / binning
    there = np.array([[scale, 0.0, origin_px[0]], [0.0, scale, origin_px[1]]])
    expected = cv2.warpAffine(snapshot, there, (512, 384), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    start = np.eye(2, 3, dtype=np.float32)
    likeness, shift = cv2.findTransformECC(
        seen.astype(np.float32), expected.astype(np.float32), start, cv2.MOTION_TRANSLATION
    )
    assert likeness > 0.99
    assert np.abs(shift[:, 2]).max() * per_css < PICTURE_TOLERANCE_PX


def grey(picture: bytes) -> NDArray[np.float64]:
    decoded = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert decoded is not None
    return decoded.astype(np.float64)


def test_drag_asks_for_the_rectangle(console: Console) -> None:
    console.page.mouse.move(*console.page_position(700.0, 420.0))
    console.page.mouse.down()
    console.page.mouse.move(*console.page_position(640.0, 470.0))
    with console.page.expect_request(is_fixation) as order:
        console.page.mouse.move(*console.page_position(600.0, 500.0))
        console.page.mouse.up()
    box = posted(order.value)["rectangle"]
    wanted = {"x_px": 600.0, "y_px": 420.0, "width_px": 100.0, "height_px": 80.0}
    assert {name: pytest.approx(value, abs=CLICK_TOLERANCE_PX) for name, value in wanted.items()} == box


def test_alt_drag_steers_over_the_steering_socket_to_where_it_ends(
    console: Console, page_server: Server
) -> None:
    page = console.page
    page.locator(".overlay .field .edge").first.wait_for(state="attached")  # drawn once the lens is known
    said: list[str | bytes] = []
    steered: list[str] = []
    page.on("request", lambda order: steered.append(order.url) if order.url.endswith("/steer") else None)

    def listen(socket: WebSocket) -> None:
        if socket.url.endswith("/mirrors/steering"):
            socket.on("framesent", lambda message: said.append(message))

    page.on("websocket", listen)
    page.keyboard.down("Alt")
    page.mouse.move(*console.page_position(700.0, 500.0))
    page.mouse.down()
    x, y = console.page_position(700.0, 500.0)
    further, _ = console.page_position(760.0, 500.0)
    for step in range(60):
        page.mouse.move(x + (further - x) * step / 60, y)
    page.mouse.move(*console.page_position(780.0, 520.0))
    page.mouse.up()
    page.keyboard.up("Alt")
    meant = direction_of(console, page_server, 780.0, 520.0)
    console.wait_until_steered(page_server, meant["ax_deg"], meant["ay_deg"])
    expect_value(page, lambda: json.loads(said[-1]).get("held"), False)  # let go: the eyes stay
    assert json.loads(said[0])["type"] == "begin"
    assert steered == []  # no request beside the socket


def direction_of(console: Console, server: Server, x_px: float, y_px: float) -> dict[str, float]:
    """Return what the page takes the direction of a wide pixel to be."""
    script = "async ([lens, x, y]) => (await import('/static/js/video/angles.js')).directionOf(lens, {x, y})"
    return dict(console.page.evaluate(script, [server.get("/rig")["calibration"]["wide"], x_px, y_px]))


def test_keyboard_moves_a_crosshair_and_fixates_there(open_console: OpenConsole, page_server: Server) -> None:
    console = open_console(page_server.url)
    console.wait_for_frames("wide")
    surface = console.page.locator(".pane-wide .surface")
    surface.focus()
    console.page.keyboard.press("Shift+ArrowRight")
    console.page.keyboard.press("ArrowUp")
    with console.page.expect_request(is_fixation) as order:
        console.page.keyboard.press("Enter")
    _, _, width = console.wide_box()
    step_px = 1.0 / max(1.0, width / 1440.0)
    asked = posted(order.value)["pixel"]
    assert asked["x_px"] == pytest.approx(719.5 + 10 * step_px)
    assert asked["y_px"] == pytest.approx(539.5 - step_px)


def test_tap_fixates_long_press_draws_a_rectangle_and_two_fingers_zoom_and_ask_for_nothing(
    open_console: OpenConsole, page_server: Server
) -> None:
    phone = open_console(page_server.url, options={**TOUCH, "device_scale_factor": 2})
    phone.wait_for_frames("wide")
    with phone.page.expect_request(is_fixation) as tap:
        phone.page.touchscreen.tap(*phone.page_position(800.0, 500.0))
    assert posted(tap.value)["pixel"]["x_px"] == pytest.approx(800.0, abs=CLICK_TOLERANCE_PX)
    session = phone.page.context.new_cdp_session(phone.page)
    check_long_press(phone, session)
    orders: list[str] = []
    phone.page.on("request", lambda request: orders.append(request.url) if is_fixation(request) else None)
    _, _, width = phone.wide_box()
    for kind, spread in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80)):
        touch(session, kind, (180 - spread / 2, 250), (180 + spread / 2, 250))
    touch(session, "touchEnd")
    expect_value(phone.page, lambda: phone.wide_box()[2], pytest.approx(2 * width, rel=0.02))
    assert orders == []


def test_two_fingers_zoom_while_the_measuring_tool_is_on_and_measure_nothing(
    open_console: OpenConsole, page_server: Server
) -> None:
    phone = open_console(page_server.url, options=TOUCH)
    phone.wait_for_frames("wide")
    page = phone.page
    page.locator(".pane-wide").get_by_role("button", name="Measure in the view").tap()
    expect(page.locator(".pane-wide .measure-bar")).to_be_visible()
    page.locator(".pane-wide .measure-bar").get_by_role("button", name="Length").tap()
    session = page.context.new_cdp_session(page)
    _, _, width = phone.wide_box()
    touch(session, "touchStart", (160, 250))  # one finger after the other
    for kind, spread in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80)):
        touch(session, kind, (180 - spread / 2, 250), (180 + spread / 2, 250))
    touch(session, "touchEnd")
    expect_value(page, lambda: phone.wide_box()[2], pytest.approx(2 * width, rel=0.02))
    expect(page.locator(".pane-wide .measure-bar .hint")).to_contain_text("two points")  # none is set


def check_long_press(phone: Console, session: CDPSession) -> None:
    """Check that a finger that stays draws a rectangle."""
    touch(session, "touchStart", phone.page_position(600.0, 400.0))
    phone.wait_until("document.querySelector('.overlay .rectangle') !== null")
    touch(session, "touchMove", phone.page_position(700.0, 500.0))
    with phone.page.expect_request(is_fixation) as drag:
        touch(session, "touchEnd")
    assert posted(drag.value)["rectangle"]["width_px"] == pytest.approx(100.0, abs=CLICK_TOLERANCE_PX)


def test_finger_scrolls_the_page_over_the_3d_pane_until_a_tap_hands_it_over(
    page_server: Server, open_console: OpenConsole
) -> None:
    phone = open_console(page_server.url, settings={"scene": True}, options=TOUCH)
    phone.wait_for_frames("wide")
    phone.fixate(812.0, 420.0)
    page = phone.page
    expect(page.locator(".scene-note")).to_have_text("Grey: not measured")
    expect(page.locator(".scene-note")).to_be_visible()
    pane, cover = page.locator("#scene"), page.get_by_role("button", name="Tap to turn and zoom")
    expect(pane.locator("iframe")).to_be_visible()
    pane.scroll_into_view_if_needed()
    session = page.context.new_cdp_session(page)

    def swipe_up() -> float:
        """Return how far the page was scrolled by it, CSS px."""
        page.evaluate("scrollTo(0, 100)")
        box = box_of(pane)
        x, y = box["x"] + 60, box["y"] + 0.6 * box["height"]
        touch(session, "touchStart", (x, y))
        for moved in (15, 40, 70, 100):
            touch(session, "touchMove", (x, y - moved))
        touch(session, "touchEnd")
        return settled(page, lambda: float(page.evaluate("scrollY"))) - 100

    assert swipe_up() > 50
    page.evaluate("scrollTo(0, 100)")
    cover.tap()
    expect(cover).to_be_hidden()
    assert swipe_up() == 0
    page.locator("#tab-targets").tap()
    expect(pane).not_to_have_class(re.compile("turning"))


def touch(session: CDPSession, kind: str, *places: tuple[float, float]) -> None:
    points = [{"x": x, "y": y} for x, y in places]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def test_the_colours_of_the_anaglyph_are_chosen_for_all_viewers(
    console: Console, page_server: Server
) -> None:
    console.page.locator("#tab-anaglyph").click()
    pane = console.page.locator(".pane-anaglyph")
    colours = pane.get_by_label("Colours of the left and the right glass")
    expect(colours).to_have_value("red_cyan")
    with console.page.expect_response(lambda answer: answer.url.endswith("/anaglyph/style")):
        colours.select_option("blue_red")
    assert httpx.get(f"{page_server.url}api/v1/views/anaglyph/style").json() == {"style": "blue_red"}
    httpx.put(f"{page_server.url}api/v1/views/anaglyph/style", json={"style": "red_cyan"}).raise_for_status()
