"""Recordings in the browser, on a real server: made by the button, listed, played, measured anew."""

import re
import shutil

import pytest
from playwright.sync_api import Locator, expect

from tests.unit.recorded_looks import PERIOD_S, Z_M, look

from .console_page import TOUCH, Console, OpenConsole
from .server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

LOOKS = 4
FRAMES = 2 * LOOKS
"""Moments that differ: the wide camera's, and 10 ms later both foveae's."""


@pytest.fixture(scope="module", autouse=True)
def _recorded(server: Server) -> None:
    folder = server.data / "recordings"
    whole = look(folder / "plane.fcap", looks=LOOKS)
    shutil.copy(whole, folder / "cut off.fcap")
    with (folder / "cut off.fcap").open("r+b") as file:
        file.truncate(whole.stat().st_size // 2)


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
    server: Server, open_console: OpenConsole
) -> None:
    console = open_console(f"{server.url}#/gallery/recordings")
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
    server: Server, open_console: OpenConsole
) -> None:
    console = open_console(f"{server.url}#/gallery/recordings", options=TOUCH)
    page = console.page
    expect(card(console, "cut off")).to_contain_text("ends before its recording does")
    expect(card(console, "plane")).to_contain_text("Complete")
    card(console, "cut off").get_by_role("link", name="cut off").click()
    expect(page.locator(".strip.warn").filter(has_text="reading the file through")).to_be_visible()
    shows(console, "wide", 0)
    assert console.overflow_px() <= 0

    label = page.locator(".recording-page").get_by_label("Label")
    label.fill("half a plane")
    label.press("Enter")
    expect(page.get_by_text("Saved", exact=True)).to_be_visible()
    page.get_by_role("button", name="Put in the trash").click()
    expect(card(console, "plane")).to_be_visible()
    expect(card(console, "cut off")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(card(console, "cut off")).to_contain_text("half a plane")
    assert console.overflow_px() <= 0


def test_the_button_in_the_bar_records_until_it_is_pressed_again(
    server: Server, open_console: OpenConsole
) -> None:
    console = open_console(server.url)
    page = console.page
    page.get_by_role("button", name="Record", exact=True).click()
    stop = page.get_by_role("button", name="Stop the recording")
    expect(stop).to_contain_text("0 dropped")
    page.goto(f"{server.url}#/gallery/recordings")
    live = page.locator(".card").filter(has_text="Being recorded")
    expect(live).to_contain_text("Recording")
    expect(live.locator(".tally-words")).to_contain_text(re.compile(r"\b[1-9]\d* frames, none dropped"))

    stop.click()

    expect(page.get_by_role("button", name="Record", exact=True)).to_be_visible()
    expect(live).to_have_count(0)
    expect(page.locator(".card")).to_have_count(3)
    expect(page.locator(".card").first).to_contain_text("Complete")
    page.get_by_role("button", name="Show it").click()
    expect(page.locator(".player .step")).to_contain_text("frame 1 of")
