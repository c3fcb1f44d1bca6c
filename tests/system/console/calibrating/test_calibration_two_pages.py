"""The calibration page beside other pages and programs: whose work is shown, who has control, whose files."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.pages import calibration_documents as documents
from tests.support.pages.console_page import OpenWizard
from tests.support.pages.stub_server import StubServer, problem

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120), pytest.mark.usefixtures("measured")]

OTHER_ID = "ses-0ther"
RUNS = f"/calibration_sessions/{documents.SESSION_ID}/runs"


def test_page_opens_the_measurement_in_which_somebody_else_begins_to_work(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("overview")
    choice = console.page.get_by_label("Measurement", exact=True)
    expect(choice).to_have_value(documents.SESSION_ID)
    other = documents.empty_session(OTHER_ID, "Night shift") | {"running": "job-9"}
    stub.answers[f"/calibration_sessions/{OTHER_ID}"] = other
    stub.answers["/calibration_sessions"] = [other, stub.session]
    job = documents.job("job-9", kind="calibration.wide")
    stub.answers |= {"/jobs/job-9": job, "/jobs": [job]}
    stub.send_event("job.updated", job)
    progress = {"session_id": OTHER_ID, "step": "wide", "done": 1, "total": 40, "note": ""}
    stub.send_event("calibration.progress", progress)
    expect(choice).to_have_value(OTHER_ID)
    choice.select_option(documents.SESSION_ID)
    back = console.page.locator(".job").get_by_role("button", name="Show its measurement")
    back.click()
    expect(choice).to_have_value(OTHER_ID)
    expect(back).to_be_hidden()


def test_cancelled_step_goes_on_with_the_options_that_it_had(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("mirrors", fresh=True)  # a page of the test before may still ask for its job
    mirrors = console.page.locator("#step-mirrors")
    mirrors.get_by_text("Grid and options").click()
    mirrors.get_by_label("Nodes across").fill("5")
    mirrors.get_by_label("Start over").check()
    mirrors.get_by_role("button", name="Go on measuring").click()
    expect(console.page.locator(".job.running")).to_be_visible()
    stub.set_job(documents.job("job-1", state="cancelled"))
    console.page.locator(".job.warn").get_by_role("button", name="Go on").click()
    expect(console.page.locator(".job.running")).to_be_visible()
    assert [order["options"] for order in stub.posted_bodies(RUNS, count=2)] == [
        {"nodes": [5, 5], "restart": True},
        {"nodes": [5, 5]},
    ]


def test_unfinished_measurement_is_gone_on_with_unless_told_otherwise(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = stub.session | {"fit": None, "check": None}
    console = open_wizard("overview", fresh=True)
    console.page.get_by_role("button", name="Calibrate everything").click()
    sheet = console.page.locator("dialog[open]")
    expect(
        sheet.get_by_label("Go on with “Bench, spring”: 28 views of the board, 121 of 162 nodes")
    ).to_be_checked()
    expect(sheet.get_by_label("Label")).to_be_hidden()
    sheet.get_by_role("button", name="Start").click()
    expect(console.page.locator(".job")).to_be_visible()
    assert stub.posted_bodies("/calibration_sessions", count=0) == []
    assert stub.posted_bodies(RUNS) == [{"step": "all", "options": {"activate": True}}]


def test_who_lacks_control_can_take_it_where_the_order_was_refused(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.answers["/lease"] = {"holder": "Ada", "expires_in_s": 20.0}
    busy = problem(409, "Busy", "Ada holds the control lease") | {"type": "/problems/busy"}
    stub.refusals[f"POST {RUNS}"] = busy
    console = open_wizard("check")
    expect(console.page.locator(".badges")).to_contain_text("Ada has control")
    console.page.locator("#step-check").get_by_role("button", name="Check again").click()
    with console.page.expect_request(re.compile("/lease$")) as order:
        console.page.get_by_role("button", name="Take control over from Ada").click()
    assert json.loads(order.value.post_data or "") == {"holder": "operator", "take_over": True}


def test_file_of_the_authors_is_imported_with_the_distance_of_its_markers(
    stub: StubServer, open_wizard: OpenWizard, tmp_path: Path
) -> None:
    console = open_wizard("overview")
    bundle = tmp_path / "bundle.json"
    bundle.write_text('{"schema": "fovea-device-config@1"}')
    console.page.get_by_label("Import a calibration file").set_input_files(bundle)
    sheet = console.page.locator("dialog[open]")
    sheet.get_by_label("From the wide camera to the markers").fill("2.5")
    with console.page.expect_request(re.compile(r"/import\?distance_m=2\.5$")):
        sheet.get_by_role("button", name="Import").click()
    expect(console.page.locator(".toast.good")).to_contain_text("Imported")


def test_export_that_is_refused_is_told_and_saves_nothing(stub: StubServer, open_wizard: OpenWizard) -> None:
    path = f"/calibrations/{'a' * 32}/file"
    stub.refusals[f"GET {path}"] = problem(422, "Not possible", "its session is not kept", "export ours")
    console = open_wizard("overview")
    console.page.get_by_role("link", name="Export Bench, spring in the authors’ format").click()
    expect(console.page.locator(".toast")).to_contain_text("Its session is not kept.")
