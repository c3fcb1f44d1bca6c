"""The first tour: five steps that go on by what the person does, and help about the page that is open."""

import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.capture_documents import estimate
from tests.support.pages.console_page import PHONE, OpenShared
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]


@pytest.fixture
def stub(stub: StubServer) -> StubServer:
    stub.answers |= {"/captures": [], "/captures/estimates": estimate()}
    return stub


def start(page: Page) -> Locator:
    """Start the tour by the keyboard alone; return its card."""
    page.keyboard.press("?")
    page.get_by_role("button", name="Take the tour").press("Enter")
    card = page.get_by_role("region", name="First tour")
    expect(card.get_by_role("heading")).to_have_text("1 of 5: Look")
    return card


def test_the_tour_goes_on_by_what_is_done_and_leads_to_each_place(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/").page
    card = start(page)
    stub.wait_for_listener()
    card.get_by_role("button", name="To the wide view").press("Enter")
    expect(page.locator(".pane-wide .surface")).to_be_focused()
    card.get_by_role("button", name="Skip").click()
    expect(card.get_by_role("heading")).to_have_text("2 of 5: Look around")
    card.get_by_role("button", name="Skip").click()
    card.get_by_role("button", name="To the ruler").click()
    expect(page.locator(".pane-wide .measure-button")).to_be_focused()
    stub.send_event("measurement.created", {"id": "m-1"})
    expect(card.get_by_role("heading")).to_have_text("4 of 5: Capture")
    card.get_by_role("button", name="To the capture page").click()
    expect(page).to_have_url(re.compile("#/capture$"))
    expect(page.locator("#capture-page input:focus")).to_have_count(1)
    card.get_by_role("button", name="Skip").click()
    expect(card.get_by_role("heading")).to_have_text("5 of 5: Gallery")
    card.get_by_role("button", name="Skip").click()
    expect(card.get_by_role("heading")).to_have_text("That was the tour")
    card.get_by_role("button", name="Close").click()
    expect(card).to_be_hidden()


def test_the_tour_is_left_at_any_step_and_leaves_room_on_a_phone(open_stub: OpenShared) -> None:
    page = open_stub("#/").page
    page.set_viewport_size(PHONE)
    page.keyboard.press("?")
    page.get_by_role("button", name="Take the tour").click()
    card = page.get_by_role("region", name="First tour")
    expect_to_fit(page)
    expect(page.get_by_role("navigation", name="Pages")).to_be_in_viewport()
    expect(page.get_by_role("button", name="STOP")).to_be_in_viewport()
    card.get_by_role("button", name="Leave the tour").click()
    expect(card).to_be_hidden()


@pytest.mark.parametrize(
    ("address", "name"), [("#/", "Looking"), ("#/capture", "Capturing"), ("#/rig/mirrors", "Devices")]
)
def test_help_leads_to_the_guide_about_the_page_that_is_open(
    open_stub: OpenShared, address: str, name: str
) -> None:
    page = open_stub(address).page
    page.keyboard.press("?")
    link = page.get_by_role("link", name=f"Guide to this page: {name}")
    expect(link).to_be_focused()
    expect(link).to_have_attribute("href", re.compile(f"/guide/{name.lower()}$"))
    page.keyboard.press("Escape")
