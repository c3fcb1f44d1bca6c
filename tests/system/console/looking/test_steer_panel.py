"""Steering by hand in the page: pads, keys, numbers, a gamepad, and the wide view."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, Page, expect

from foveacam_hardware.contract import PARKED
from foveacam_server.rig import hand_steering
from tests.support.pages.awaited import box_of, expect_to_fit, expect_value, let_run
from tests.support.pages.console_page import PHONE, Console, OpenConsole, OpenShared
from tests.support.pages.stub_server import StubServer
from tests.support.pages.stub_steering import Document
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

BEATS_MS = 250.0
"""Three signs of life of what is held."""
LET_GO = {"type": "steer", "held": False}
GAMEPAD = """
window.pad = null;
navigator.getGamepads = () => [window.pad];
window.press = (buttons, ...axes) => {
  const pressed = Array.from({ length: 16 }, (_, index) => ({ pressed: buttons.includes(index) }));
  window.pad = { connected: true, axes, buttons: pressed };
};
"""


def panel(page: Page) -> Locator:
    return page.get_by_role("region", name="Steer by hand", exact=True)


def pad(page: Page, name: str) -> Locator:
    return panel(page).get_by_role("group", name=name, exact=True).get_by_role("application")


def drag(page: Page, surface: Locator, *ways: tuple[float, float]) -> None:
    """Press in the middle of a pad and move by shares of its side; do not let go."""
    surface.scroll_into_view_if_needed()
    box = box_of(surface)
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    for across, down in ways:
        page.mouse.move(
            box["x"] + (0.5 + across) * box["width"], box["y"] + (0.5 + down) * box["height"], steps=5
        )


def eyes(rig: Running) -> Document:
    found: Document = rig.get("/mirrors").json()
    return found


@pytest.fixture
def steered(page_rig: Running, open_shared: OpenShared) -> Iterator[Page]:
    """The rig's page on the simulated rig, once it may steer; mirrors at rest afterwards."""
    page = open_shared(f"http://127.0.0.1:{page_rig.port}/#/rig/mirrors").page
    expect(panel(page).locator(".steer-status")).to_contain_text("Drag in a pad")
    yield page
    page_rig.http.delete("/api/v1/stop")
    page_rig.services.hardware.hand.make_way("a test has ended")
    page_rig.post("/mirrors/park")


@pytest.fixture
def stubbed(stub: StubServer, open_console: OpenConsole) -> Page:
    page = open_console(f"{stub.url}#/rig/mirrors").page
    expect(panel(page).locator(".steer-status")).to_contain_text("Drag in a pad")
    return page


def test_the_pad_of_directions_steers_both_eyes_which_then_stay(page_rig: Running, steered: Page) -> None:
    drag(steered, pad(steered, "Both eyes"), (0.1, 0.0), (0.2, -0.1))  # of ±10°
    expect(panel(steered).locator(".steer-status")).to_have_text("You are steering.")
    page_rig.poll("/mirrors", lambda found: abs(found["left"]["ax_deg"] - 4.0) < 0.2)
    page_rig.poll("/mirrors", lambda found: abs(found["right"]["ay_deg"] + 2.0) < 0.2)
    steered.mouse.up()
    expect(panel(steered).locator(".steer-status")).to_contain_text("Drag in a pad")
    stays = eyes(page_rig)
    assert stays["right"]["ax_deg"] == pytest.approx(stays["left"]["ax_deg"], abs=0.05)
    assert stays["right"]["ay_deg"] == pytest.approx(-2.0, abs=0.2)


def test_an_eyes_own_pad_splits_and_the_wide_view_brings_them_together(
    page_rig: Running, open_console: OpenConsole, steered: Page
) -> None:
    drag(steered, pad(steered, "Left eye"), (0.2, 0.0))
    page_rig.poll("/mirrors", lambda found: found["left"]["x_v"] > 60.0)
    steered.mouse.up()
    assert eyes(page_rig)["right"]["x_v"] == pytest.approx(0.0, abs=0.1)
    split = panel(steered).get_by_role("button", name="Split")
    expect(split).to_have_attribute("aria-pressed", "true")
    expect(pad(steered, "Both eyes")).to_be_hidden()

    steered.evaluate("location.hash = '#/'")
    console = Console(steered)
    console.wait_for_frames("wide")
    steered.keyboard.down("Alt")
    steered.mouse.move(*console.page_position(800.0, 540.0))
    steered.mouse.down()
    steered.mouse.move(*console.page_position(850.0, 540.0), steps=4)
    page_rig.poll("/mirrors", lambda found: 0.5 < found["right"]["ax_deg"] < 4.0)
    steered.mouse.up()
    steered.keyboard.up("Alt")

    page_rig.poll("/mirrors", lambda found: abs(found["left"]["ax_deg"] - found["right"]["ax_deg"]) < 0.05)
    steered.evaluate("location.hash = '#/rig/mirrors'")
    expect(panel(steered).get_by_role("button", name="Together")).to_have_attribute("aria-pressed", "true")


def test_a_stop_ends_it_until_it_is_pressed_again(page_rig: Running, steered: Page) -> None:
    drag(steered, pad(steered, "Both eyes"), (0.2, 0.0))
    page_rig.poll("/mirrors", lambda found: found["left"]["ax_deg"] > 3.0)
    steered.keyboard.press("Space")
    expect(panel(steered).locator(".steer-status")).to_have_text("The stop is engaged.")
    steered.mouse.move(10, 10, steps=3)
    let_run(steered, BEATS_MS)
    assert page_rig.rig.mirrors.state.volts == PARKED
    page_rig.http.delete("/api/v1/stop")
    expect(panel(steered).locator(".steer-status")).to_contain_text("Let go, and press again.")
    steered.mouse.move(200, 200, steps=3)
    let_run(steered, BEATS_MS)
    assert page_rig.rig.mirrors.state.volts == PARKED
    steered.mouse.up()
    drag(steered, pad(steered, "Both eyes"), (0.2, 0.0))
    page_rig.poll("/mirrors", lambda found: found["left"]["ax_deg"] > 3.0)
    steered.mouse.up()


def test_a_gamepad_steers_while_its_button_is_held_and_parks_when_it_goes(
    page_rig: Running, open_console: OpenConsole, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_steering, "PARK_S", 1.0)
    page = open_console(f"http://127.0.0.1:{page_rig.port}/#/rig/mirrors").page
    page.add_init_script(GAMEPAD)
    page.reload()
    page.evaluate("press([], 1, 0, 0, 0)")  # the stick alone
    note = panel(page).locator(".aside-note")
    expect(note).to_contain_text("hold A or a shoulder button")
    assert page_rig.rig.mirrors.state.volts == PARKED

    page.evaluate("press([0], 1, 0, 0, 0)")
    page_rig.poll("/mirrors", lambda found: found["left"]["ax_deg"] > 1.0 and found["right"]["ax_deg"] > 1.0)
    page.evaluate("press([], 1, 0, 0, 0)")
    expect(panel(page).locator(".steer-status")).to_contain_text("Drag in a pad")
    assert eyes(page_rig)["left"]["ax_deg"] > 1.0  # let go, they stay

    panel(page).get_by_role("button", name="Split").click()
    before = eyes(page_rig)
    page.evaluate("press([5], 0, 0, 0, 1)")  # the right stick down
    page_rig.poll("/mirrors", lambda found: found["right"]["y_v"] > before["right"]["y_v"] + 10.0)
    assert eyes(page_rig)["left"]["y_v"] == pytest.approx(before["left"]["y_v"], abs=0.1)

    page.evaluate("window.pad = null")
    expect(note).to_contain_text("was disconnected while steering")
    page_rig.poll("/mirrors", lambda found: found["left"]["x_v"] == found["right"]["y_v"] == 0.0)
    expect(panel(page).locator(".steer-status")).to_contain_text("no message came", ignore_case=True)


def test_without_a_calibration_both_eyes_get_equal_volts(stub: StubServer, open_console: OpenConsole) -> None:
    stub.answers["/rig"] = stub.answers["/rig"] | {"calibration": None, "steering": None}
    page = open_console(f"{stub.url}#/rig/mirrors").page
    expect(pad(page, "Both eyes")).to_be_hidden()
    drag(page, pad(page, "Right eye"), (0.25, 0.0), (0.25, 0.25))
    page.mouse.up()
    expect(panel(page).locator(".steer-status")).to_contain_text("Drag in a pad")

    expect_value(page, lambda: stub.steering.messages[-1], LET_GO)
    volts = stub.steering.orders()[-1]["volts"]
    assert volts["left"] == volts["right"] == pytest.approx({"x_v": 85.0, "y_v": 85.0}, abs=2.0)


def test_keys_numbers_and_a_double_click_steer_a_pad(stub: StubServer, stubbed: Page) -> None:
    panel(stubbed).get_by_role("button", name="Split").click()
    left = pad(stubbed, "Left eye")
    left.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown", "Shift+ArrowDown"):
        stubbed.keyboard.press(key)
    expect(left).to_have_attribute("data-now", "4.0 2.2")

    entry = panel(stubbed).get_by_label("Left eye, x", exact=True)
    entry.fill("-20")
    entry.press("Enter")
    expect(left).to_have_attribute("data-now", "−20.0 2.2")
    expect_value(stubbed, lambda: stub.steering.orders()[-1]["held"], False)

    left.dblclick()
    expect(left).to_have_attribute("data-now", "0.0 0.0")


def test_distance_and_shift_belong_to_the_gaze_and_the_panel_fits_a_phone(
    stub: StubServer, stubbed: Page
) -> None:
    panel(stubbed).get_by_label("Vertical shift").fill("0.25")
    panel(stubbed).get_by_label("Distance for steering").fill("0.5")

    def newest() -> tuple[float, float] | None:
        gazes = [order["gaze"] for order in stub.steering.orders()]
        return (gazes[-1]["distance_m"], gazes[-1]["vertical_shift_deg"]) if gazes else None

    expect_value(stubbed, newest, (1.0, 0.25))
    stubbed.set_viewport_size(PHONE)
    expect_to_fit(stubbed)


def test_a_page_that_is_hidden_lets_go(stub: StubServer, stubbed: Page) -> None:
    drag(stubbed, pad(stubbed, "Both eyes"), (0.2, 0.0))
    stubbed.evaluate(
        "Object.defineProperty(document, 'hidden', { value: true, configurable: true });"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )
    expect(panel(stubbed).locator(".steer-status")).to_contain_text("Drag in a pad")
    expect_value(stubbed, lambda: stub.steering.messages[-1], LET_GO)
    stubbed.mouse.up()
