"""The fault tray: its button in the top bar, its rows, dismissing, failures of the page itself."""

import pytest
from playwright.sync_api import Locator, Page, expect

from foveacam_bench.console.accessibility import serious_findings
from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.calibration_documents import Document
from tests.support.pages.console_page import TOUCH, OpenConsole, OpenShared
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]


def fault(name: str, **changes: object) -> Document:
    document: Document = {
        "id": f"fault-{name}",
        "level": "error",
        "scope": "device",
        "name": name,
        "what": f"camera {name}: no frame for 2.1 s",
        "remedy": "check its cable and power; it is tried again by itself",
        "first_utc": "2026-03-01T10:00:00Z",
        "last_utc": "2026-03-01T10:04:00Z",
        "count": 3,
        "present": True,
        "over_utc": None,
    }
    return document | changes


def over(name: str, **changes: object) -> Document:
    return fault(name, present=False, over_utc="2026-03-01T10:05:00Z", **changes)


def button(page: Page) -> Locator:
    return page.locator(".fault-button")


def rows(page: Page) -> Locator:
    return page.locator(".fault-tray li")


def test_the_button_counts_the_tray_lists_what_to_do_and_faults_are_dismissed(
    stub: StubServer, open_stub: OpenShared
) -> None:
    warning = over("health", level="warning", scope="calibration", what="rows are 2.4 px apart", remedy=None)
    stub.answers["/faults"] = [fault("left"), over("right"), warning]
    page = open_stub("#/").page
    expect(button(page)).to_have_text("3")
    expect(button(page)).to_have_attribute(
        "aria-label", "Faults and warnings, 3: 2 errors, 1 warning; 1 present"
    )
    assert serious_findings(page) == []  # the number beside the sign is a part of the name

    page.locator("body").press("e")
    expect(rows(page)).to_have_count(3)
    expect(rows(page).first).to_contain_text("Device: left")
    expect(rows(page).first).to_contain_text("present")
    expect(rows(page).first).to_contain_text("Check its cable and power")
    expect(rows(page).first).to_contain_text("3 times")
    expect(rows(page).nth(2)).to_contain_text("Calibration: health")

    page.keyboard.press("Escape")
    expect(rows(page).first).to_be_hidden()
    stub.answers_after["DELETE /faults/fault-health"] = {"/faults": [fault("left"), over("right")]}
    stub.answers_after["DELETE /faults"] = {"/faults": [fault("left")]}
    button(page).click()
    rows(page).nth(2).get_by_role("button", name="Dismiss: Calibration: health").press("Enter")
    expect(rows(page)).to_have_count(2)

    page.get_by_role("button", name="Dismiss all that are over").click()
    expect(rows(page)).to_have_count(1)
    expect(page.get_by_role("button", name="Dismiss all that are over")).to_have_count(0)
    expect(page.locator(".fault-tray:focus-within")).to_have_count(1)


def test_a_fault_that_comes_and_goes_is_shown_without_a_reload(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/").page
    expect(button(page)).to_have_attribute("aria-label", "Faults and warnings: none")
    expect(button(page)).to_have_text("")
    stub.wait_for_listener()

    stub.answers["/faults"] = [fault("left")]
    stub.send_event("fault.changed", fault("left"))
    expect(button(page)).to_have_text("1")

    stub.answers["/faults"] = []
    stub.send_event("fault.dismissed", {"ids": ["fault-left"]})
    expect(button(page)).to_have_text("")
    button(page).click()
    expect(page.locator(".fault-tray")).to_contain_text("No faults and no warnings.")


def test_errors_of_the_page_are_listed_and_dismissed_in_it(stub: StubServer, open_stub: OpenShared) -> None:
    page = open_stub("#/").page
    expect(button(page)).to_be_visible()
    throw = "window.dispatchEvent(new ErrorEvent('error', { message: 'x is not a function', lineno: 7 }))"
    page.evaluate(f"{throw}; {throw}")
    button(page).click()
    expect(rows(page)).to_have_count(1)
    expect(rows(page)).to_contain_text("This page: script")
    expect(rows(page)).to_contain_text("2 times")

    rows(page).get_by_role("button", name="Dismiss").click()
    expect(page.locator(".fault-tray")).to_contain_text("No faults and no warnings.")
    assert not any(method == "DELETE" for method, _, _ in stub.requests)


def test_a_phone_shows_long_texts_within_its_width(stub: StubServer, open_console: OpenConsole) -> None:
    long_word = "/data/" + "calibration_sessions_" * 12
    stub.answers["/faults"] = [fault("left", what=f"{long_word} cannot be written"), over("right")]
    console = open_console(stub.url, options=TOUCH)
    page = console.page
    button(page).tap()
    expect(rows(page)).to_have_count(2)
    expect_to_fit(page)
    tray = "document.querySelector('.fault-tray')"
    console.wait_until(f"{tray}.scrollWidth <= {tray}.clientWidth")


def test_a_lost_server_is_present_until_it_is_back(stub: StubServer, open_console: OpenConsole) -> None:
    console = open_console(stub.url)
    page = console.page
    console.wait_for_frames("wide")
    stub.away = True
    try:
        page.reload()
        expect(button(page)).to_have_text("1")
        button(page).click()
        expect(rows(page)).to_contain_text("Connection: server")
        expect(rows(page).locator(".badge")).to_have_text("present")
    finally:
        stub.away = False
    expect(rows(page).locator(".badge")).to_have_text("over")
    console.errors.clear()  # the browser tells of the refused sockets
