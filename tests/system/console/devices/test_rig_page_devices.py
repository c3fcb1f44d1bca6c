"""The rig's page below the cameras, on a server that says what a test has put into it."""

import re

import pytest
from playwright.sync_api import Locator, expect

from tests.support.pages import rig_documents as documents
from tests.support.pages.console_page import OpenShared
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]


TABS = {
    "Trigger": "mirrors",
    "Controller": "mirrors",
    "Rail": "positioners",
    "Pan-tilt": "positioners",
    "Faults": "faults",
}


def panel(name: str, open_stub: OpenShared) -> Locator:
    """Open the rig's page where a panel is; return the panel."""
    return open_stub(f"#/rig/{TABS[name]}").page.get_by_role("region", name=name, exact=True)


def test_trigger_budget_says_where_the_settle_time_is_from(stub: StubServer, open_stub: OpenShared) -> None:
    trigger = panel("Trigger", open_stub)
    expect(trigger.locator(".budget")).to_contain_text("44.4 Hz")
    expect(trigger.locator(".budget")).to_contain_text("every 22.50 ms")
    expect(trigger).to_contain_text("measured 2026-03-02")


def test_self_test_is_followed_and_its_verdicts_are_explained(
    stub: StubServer, open_stub: OpenShared
) -> None:
    job = {
        "id": "job-7",
        "kind": "camera.self_test",
        "state": "running",
        "created_utc": "",
        "started_utc": None,
    }
    job |= {"ended_utc": None, "result_url": None, "problem": None}
    progress = {"done": 1, "total": 3, "eta_s": None, "note": "a command to the right camera"}
    stub.answers["/cameras/self_tests"] = stub.answers["/jobs/job-7"] = job | {"progress": progress}
    trigger = panel("Trigger", open_stub)
    expect(trigger.locator(".verdicts .badge")).to_have_text(["Untested", "Untested"])
    trigger.get_by_role("button", name="Test both triggers").click()
    expect(trigger.locator(".state.running")).to_contain_text("A command to the right camera. 1 of 3")
    expect(trigger.get_by_role("button", name="Test both triggers")).to_be_disabled()
    stub.answers["/cameras/self_tests/newest"] = documents.trigger_test("ok", "wiring")
    stub.answers["/jobs/job-7"] = job | {"state": "succeeded", "progress": progress}
    expect(trigger.locator(".verdicts .badge")).to_have_text(["OK: hardware and software", "Wiring"])
    expect(trigger.locator(".verdicts")).to_contain_text("command to frame 31 ms, pulse to frame 22 ms")
    trigger.get_by_text("What each verdict means").click()
    expect(trigger.locator(".meanings")).to_contain_text("Look at the trigger and strobe cables")


def test_controller_shows_its_line_its_clock_and_who_watches(stub: StubServer, open_stub: OpenShared) -> None:
    controller = panel("Controller", open_stub)
    for text in (
        "Connected, mirrors on",
        "11820340",
        "/dev/ttyACM0",
        "The guardian watches",
        "0.90 ms median, 2.1 ms p95, 7.5 ms longest",
        "96 bytes",
        "−12.25 ppm",
        "240.0 Hz",
    ):
        expect(controller).to_contain_text(text)
    controller.get_by_role("button", name="Recover mirrors").click()
    expect(controller.page.locator(".toast.good")).to_contain_text("DACs were restarted")
    with controller.page.expect_response(re.compile("/mirrors/disable$")):
        controller.get_by_role("button", name="Switch off").click()
    assert stub.posted_bodies("/mirrors/recover") and stub.posted_bodies("/mirrors/disable")


def test_rail_without_switches_asks_for_its_zero_until_it_is_confirmed(
    stub: StubServer, open_stub: OpenShared
) -> None:
    fault = "rail: it restarted by itself; bring it to its zero, then confirm that it stands there"
    lost = {"homed": False, "position_mm": None, "fault": fault, "awaits_zero": True}
    stub.answers["/rail"] = documents.rail() | lost
    rail = panel("Rail", open_stub)
    expect(rail).to_contain_text("confirm that it stands there")
    expect(rail.get_by_role("button", name="Home the rail")).to_be_hidden()
    stub.answers_after["POST /rail/zero_confirmations"] = {"/rail": documents.rail()}
    rail.get_by_role("button", name="The rail stands at its zero").click()
    expect(rail.locator(".pose")).to_have_text("0.0 mm")
    expect(rail.get_by_role("button", name="The rail stands at its zero")).to_be_hidden()


def test_rail_moves_to_places_and_positions_once_it_is_homed(stub: StubServer, open_stub: OpenShared) -> None:
    stub.answers["/rail"] = documents.rail() | {"homed": False, "position_mm": None}
    rail = panel("Rail", open_stub)
    expect(rail).to_contain_text("Home it first: it is not known where it stands.")
    expect(rail.get_by_role("button", name="Go to the place far left")).to_be_disabled()
    stub.answers_after["POST /rail/homings"] = {"/rail": documents.rail()}
    rail.get_by_role("button", name="Home the rail").click()
    with rail.page.expect_response(re.compile("/rail/moves$")):
        rail.get_by_role("button", name="Go to the place far left").click()
    rail.get_by_label("Position").fill("12.5")
    with rail.page.expect_response(re.compile("/rail/moves$")):
        rail.get_by_label("Position").press("Enter")
    rail.get_by_role("button", name="Hold the rail").click()
    expect(rail.locator(".pose")).to_have_text("0.0 mm")
    assert stub.posted_bodies("/rail/moves", count=2) == [{"place": "far left"}, {"position_mm": 12.5}]
