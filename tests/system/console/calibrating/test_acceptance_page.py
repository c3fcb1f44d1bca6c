"""The acceptance page: a run from its start to its verdict, findings, figures, earlier runs."""

import re

import pytest
from playwright.sync_api import expect

from tests.support.pages import acceptance_documents as acceptances
from tests.support.pages import calibration_documents as documents
from tests.support.pages.awaited import box_of, expect_to_fit
from tests.support.pages.console_page import PHONE, TOUCH, Console, OpenConsole, OpenShared
from tests.support.pages.stub_server import StubServer, problem

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

ADDRESS = "#/acceptance"
RUN = "Run the acceptance"
HINT = "#acceptance-page .panel .strip"


@pytest.fixture
def console(stub: StubServer, open_stub: OpenShared) -> Console:
    """The page of a rig that was never measured."""
    console = open_stub(ADDRESS)
    console.page.locator("#acceptance-title").wait_for()
    stub.wait_for_listener()
    return console


def follow_job(stub: StubServer, state: str) -> None:
    """Let the run that a page has started be in this state."""
    progress = {"done": 214, "total": 588, "eta_s": 322.0, "note": "timing"}
    stub.send_event(
        "job.updated", documents.job("job-1", kind="acceptance", state=state, changes={"progress": progress})
    )


def test_run_is_started_followed_and_its_result_shown(stub: StubServer, console: Console) -> None:
    page = console.page
    expect(page.locator("#acceptance-page")).to_contain_text("Never run yet.")
    page.get_by_role("button", name=RUN).click()
    assert stub.posted_bodies("/acceptances") == [{}]
    expect(page.get_by_role("button", name=RUN)).to_be_disabled()
    follow_job(stub, "running")
    bar = page.locator("#acceptance-page .job")
    expect(bar).to_contain_text("214 of 588, 5 min left")
    expect(page.locator(".badges a")).to_have_text("Acceptance 36 %")
    expect(page.locator(".badges a")).to_have_attribute("href", ADDRESS)
    stub.answers["/acceptances"] = [acceptances.passed()]
    follow_job(stub, "succeeded")
    expect(page.locator("#acceptance-page .verdict")).to_have_text("Accepted")
    expect(bar).to_be_hidden()
    expect(page.get_by_role("button", name=RUN)).to_be_enabled()


def test_cancelled_run_keeps_the_checks_made(stub: StubServer, open_console: OpenConsole) -> None:
    page = open_console(stub.url + ADDRESS).page  # which knows of no earlier job of this id
    stub.wait_for_listener()
    page.get_by_role("button", name=RUN).click()
    follow_job(stub, "running")
    stub.answers["/jobs/job-1/cancel"] = documents.job("job-1", kind="acceptance", state="cancelling")
    page.get_by_role("button", name="Cancel").click()
    stub.answers["/acceptances"] = [acceptances.ended_early()]
    stub.send_event("calibration.acceptance", {"id": "accept-1", "accepted": False, "faults": []})
    follow_job(stub, "cancelled")
    expect(page.locator("#acceptance-page .job")).to_contain_text("The checks made until then are kept.")
    expect(page.locator("#acceptance-page .verdict")).to_have_text("Ended early")
    assert stub.posted_bodies("/jobs/job-1/cancel") == [None]


def test_fault_is_named_with_its_remedy_and_its_figure_marked(
    stub: StubServer, open_stub: OpenShared
) -> None:
    stub.answers["/acceptances"] = [acceptances.failed()]
    page = open_stub(ADDRESS).page
    expect(page.locator("#acceptance-page .verdict")).to_have_text("Not accepted")
    finding = page.locator(".findings li")
    expect(finding.locator(".state")).to_have_text("Left: the strobe comes 2.1 ms after the trigger.")
    expect(finding.locator(".remedy")).to_contain_text("Remove the strobe's delay")
    rows = page.locator("[data-check=triggers] .measured li")
    expect(rows.first).to_have_text(re.compile("2.1 ms.*at most 0.45 ms.*outside"))
    expect(rows.last).to_have_text(re.compile("0.15 ms.*within"))
    expect(page.locator("[data-check=returns]")).to_contain_text("Waits for: Trigger and strobe lines.")
    report = page.get_by_role("link", name="Open the report")
    expect(report).to_have_attribute("href", "/api/v1/acceptances/accept-1/report.html")
    expect(report).to_have_attribute("target", "_blank")


def test_picture_of_a_check_is_loaded_once_it_is_unfolded(stub: StubServer, open_stub: OpenShared) -> None:
    stub.answers["/acceptances"] = [acceptances.passed()]
    page = open_stub(ADDRESS).page
    returns = page.locator("[data-check=returns]")
    picture = returns.locator("img")
    expect(picture).to_have_count(1)
    expect(picture).to_have_js_property("naturalWidth", 0)
    with page.expect_response("**/acceptances/accept-1/pictures/returns.png"):
        returns.locator("summary").click()
    expect(picture).to_be_visible()
    expect(page.locator("[data-check=devices] details")).to_have_count(0)


def test_earlier_run_is_shown_on_request(stub: StubServer, open_stub: OpenShared) -> None:
    stub.answers["/acceptances"] = [
        acceptances.failed("accept-2"),
        acceptances.passed("accept-1", created_utc="2026-03-13T08:00:00.000Z"),
    ]
    page = open_stub(ADDRESS).page
    runs = page.locator("#acceptance-page .runs button")
    expect(runs).to_have_count(2)
    expect(runs.first).to_contain_text("1 fault")
    expect(runs.first).to_have_attribute("aria-pressed", "true")
    runs.last.click()
    expect(page.locator("#acceptance-page .verdict")).to_have_text("Accepted")
    expect(page.get_by_role("link", name="Open the report")).to_have_attribute(
        "href", re.compile("/accept-1/")
    )
    expect(runs.last).to_have_attribute("aria-pressed", "true")


def test_rig_without_markers_is_told_how_to_get_them(stub: StubServer, open_stub: OpenShared) -> None:
    stub.answers["/pan_tilt"] |= {"present": False, "stations": []}
    page = open_stub(ADDRESS).page
    hint = page.locator(HINT)
    expect(hint).to_contain_text("no station with markers")
    hint.get_by_role("button", name="Open the calibration scene").click()
    with page.expect_request("**/rig/setup/open") as sent:
        page.get_by_role("alertdialog").get_by_role("button", name="Open it").click()
    assert sent.value.post_data_json == {"path": None, "scene": "calibration"}
    stub.answers["/acceptances"] = [acceptances.without_markers()]
    stub.wait_for_listener()
    stub.send_event("calibration.acceptance", {"id": "accept-1", "accepted": False, "faults": []})
    expect(page.get_by_role("region", name="Newest result").locator(".strip")).to_be_visible()
    expect(hint).to_have_count(1)


def test_refusal_shows_the_server_s_words(stub: StubServer, console: Console) -> None:
    page = console.page
    stub.refusals["POST /acceptances"] = problem(409, "Stopped", "the stop is engaged") | {
        "type": "/problems/stopped"
    }
    page.get_by_role("button", name=RUN).click()
    toast = page.locator(".toast")
    expect(toast).to_contain_text("The stop is engaged.")
    expect(toast.get_by_role("button", name="Release the stop")).to_be_visible()


def test_calibration_leads_to_the_page_and_it_fits_a_phone(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.answers["/acceptances"] = [acceptances.failed(), acceptances.passed("accept-0")]
    page = open_console(f"{stub.url}#/calibration", options=TOUCH).page
    page.get_by_role("link", name="Open the acceptance").click()
    expect(page.locator("#acceptance-title")).to_be_focused()
    expect(page.locator("[data-check=triggers] .measured")).to_be_visible()
    expect_to_fit(page)
    button = box_of(page.get_by_role("button", name=RUN))
    assert button["height"] >= 40
    assert button["x"] + button["width"] <= PHONE["width"]
