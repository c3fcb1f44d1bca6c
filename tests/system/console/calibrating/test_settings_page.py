"""The settings page: of this browser and of all viewers, cameras and windows kept by name."""

import pytest
from playwright.sync_api import Locator, expect

from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]


def opened(server: Server, open_shared: OpenShared) -> Console:
    console = open_shared(f"{server.url}#/settings")
    expect(console.page.get_by_text("None is saved yet.")).to_be_visible()
    return console


def part(console: Console, title: str) -> Locator:
    return console.page.get_by_role("region", name=title, exact=True)


def test_cameras_are_saved_under_a_name_and_applied_after_a_change(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = opened(page_server, open_shared)
    cameras = part(console, "Cameras by name")
    before = page_server.get("/cameras/wide")["settings"]["gain_db"]
    cameras.get_by_label("Save the cameras as").fill("Bright room")
    cameras.get_by_role("button", name="Save").click()
    expect(cameras.get_by_text("Bright room")).to_be_visible()
    page_server.send("PATCH", "/cameras/wide", {"gain_db": before + 5.0})
    cameras.get_by_role("button", name="Apply").click()
    expect(console.page.get_by_text("The cameras are set as “Bright room”")).to_be_visible()
    assert page_server.get("/cameras/wide")["settings"]["gain_db"] == before
    cameras.get_by_role("button", name="Delete Bright room").click()
    expect(cameras.get_by_text("None is saved yet.")).to_be_visible()


def test_recordings_are_named_and_packed_as_the_settings_say(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = opened(page_server, open_shared)
    recordings = part(console, "Recordings")
    recordings.get_by_label("Name, before its number").fill("desk")
    expect(recordings.get_by_text("The next one is named “desk 0001”.")).to_be_visible()
    recordings.get_by_label("Compress each frame").check()
    kept = "JSON.parse(localStorage.getItem('foveacam.settings')).record"
    console.wait_until(f"{kept}.prefix === 'desk' && {kept}.compress === true")


def test_window_is_saved_under_a_name_and_opened_from_it(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = opened(page_server, open_shared)
    layout = "row-600(wide,column-500(left,right))"
    console.page.evaluate(f"localStorage.setItem('foveacam.layout', '{layout}')")
    console.page.reload()
    windows = part(console, "Windows by name")
    windows.get_by_label("Save the last window as").fill("Bench")
    windows.get_by_role("button", name="Save").click()
    expect(windows.get_by_role("link", name="Open")).to_have_attribute("href", f"/windows#{layout}")
    windows.get_by_role("button", name="Delete Bench").click()
    expect(windows.get_by_role("link", name="Open")).to_have_count(0)


def test_colours_and_theme_are_changed_in_one_place(page_server: Server, open_shared: OpenShared) -> None:
    console = opened(page_server, open_shared)
    page, glasses = console.page, part(console, "All viewers").get_by_role("combobox")
    glasses.select_option("red_blue")
    part(console, "This browser").get_by_role("combobox").first.select_option("dark")
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    page.reload()
    expect(glasses).to_have_value("red_blue")
    page_server.send("PUT", "/views/anaglyph/style", {"style": "red_cyan"})


def test_dialog_leads_to_the_page_and_the_page_fits_a_phone(
    page_server: Server, open_console: OpenConsole
) -> None:
    page = open_console(page_server.url, options=TOUCH).page
    page.get_by_role("button", name="More").click()
    page.get_by_role("button", name="Settings").click()
    page.get_by_role("link", name="All settings").click()
    expect(page.locator("#settings-title")).to_be_visible()
    expect_to_fit(page)
