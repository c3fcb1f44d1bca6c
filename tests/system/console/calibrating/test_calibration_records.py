"""Records, drift and the pan-tilt from the console, and the wizard on a phone."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.pages import calibration_documents as documents
from tests.support.pages.awaited import expect_to_fit, expect_value
from tests.support.pages.calibration_results import drift_check
from tests.support.pages.console_page import TOUCH, OpenConsole, OpenWizard
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120), pytest.mark.usefixtures("measured")]

LONG = "A label as long as a label may be: north hall, after the move, second mirror, 80"
STEPS = ["overview", "wide", "mirrors", "fit", "check", "settle"]
FACTORY_ID = "b" * 32
PRESSABLE = "#calibration :is(button, a, input, select):visible:not([aria-label], [id])"
UNNAMED = """all => all.filter((each) => !each.innerText.trim() && !each.closest('label')
  && !each.querySelector('[alt]')).map((each) => each.outerHTML)"""


def test_record_offers_report_and_files_and_is_taken_into_use(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("overview")
    expect(console.page.locator(".records .current")).to_contain_text(["Bench, spring", "Bench, spring"])
    links = console.page.locator(".records li", has_text="As delivered").locator("a")
    expect(links).to_have_count(3)
    for index, path in enumerate(("report", "file?format=foveacam", "file?format=authors")):
        expect(links.nth(index)).to_have_attribute("href", f"/api/v1/calibrations/{FACTORY_ID}/{path}")
    with console.page.expect_response(re.compile("/activate$")):
        console.page.get_by_role("button", name="Use As delivered").click()
    assert stub.posted_bodies(f"/calibrations/{FACTORY_ID}/activate") == [None]


def test_two_records_are_compared_in_pixels(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.answers["/calibrations/compare"] = {
        "a": "a" * 32,
        "b": FACTORY_ID,
        "pointing_difference_px": {"rms": 3.21, "max": 9.5},
        "picture_url": None,
    }
    console = open_wizard("overview")
    compare = console.page.get_by_role("button", name="Compare", exact=True)
    console.page.get_by_label("Compare Bench, spring").check()
    expect(compare).to_be_disabled()
    console.page.get_by_label("Compare As delivered").check()
    compare.click()
    expect(console.page.locator(".compared")).to_contain_text("rms 3.210 px, max 9.500 px")


def test_damaged_file_is_named_and_not_sent(
    stub: StubServer, open_wizard: OpenWizard, tmp_path: Path
) -> None:
    console = open_wizard("overview")
    file = console.page.get_by_label("Import a calibration file")
    torn = tmp_path / "torn.json"
    torn.write_text('{"format": "foveacam-cal')
    file.set_input_files(torn)
    expect(console.page.locator(".toast")).to_contain_text("torn.json")
    assert stub.posted_bodies("/calibrations/import", count=0) == []
    whole = tmp_path / "whole.json"
    whole.write_text('{"format": "foveacam-calibration"}')
    with console.page.expect_response(re.compile("/import$")):
        file.set_input_files(whole)
    assert stub.posted_bodies("/calibrations/import") == [{"format": "foveacam-calibration"}]


def test_record_is_discarded_with_a_way_back(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.answers[f"/calibrations/{FACTORY_ID}"] = None
    stub.answers[f"/calibrations/{FACTORY_ID}/restore"] = {}
    stub.answers["/calibrations"] += [documents.record("c" * 32, "Shipped", kept=False)]
    console = open_wizard("overview")
    expect(console.page.get_by_role("button", name="Use Shipped")).to_be_visible()
    expect(console.page.get_by_role("button", name="Discard Shipped")).to_have_count(0)
    expect(console.page.get_by_role("button", name="Discard Bench, spring")).to_have_count(0)  # it is in use
    console.page.get_by_role("button", name="Discard As delivered").click()
    expect(console.page.get_by_text("“As delivered” is in the trash")).to_be_visible()
    assert stub.bodies_of("DELETE", f"/calibrations/{FACTORY_ID}") == [None]
    with console.page.expect_response(re.compile("/restore$")):
        console.page.get_by_role("button", name="Undo").click()


def test_measurements_are_combined_when_two_are_ticked(stub: StubServer, open_wizard: OpenWizard) -> None:
    other = documents.empty_session("ses-0e", "Evening")
    made = documents.empty_session("ses-0c", "combined from 4 sweeps of 324 poses")
    stub.answers |= {
        "/calibration_sessions": [documents.full_session(), other],
        "/calibration_sessions/combined": made,
        "/calibration_sessions/ses-0c": made,
    }
    stub.answers_after["POST /calibration_sessions/combined"] = {
        "/calibration_sessions": [made, documents.full_session(), other]
    }
    console = open_wizard("overview")
    combine = console.page.get_by_role("button", name="Combine", exact=True)
    expect(combine).to_be_disabled()
    console.page.get_by_label("Combine Bench, spring").check()
    expect(combine).to_be_disabled()
    console.page.get_by_label("Combine Evening").check()
    combine.click()
    expect(console.page.locator("#session")).to_have_attribute("title", made["label"])
    assert stub.posted_bodies("/calibration_sessions/combined") == [
        {"sessions": [documents.SESSION_ID, "ses-0e"]}
    ]


def test_measurement_is_deleted_only_after_a_second_word(stub: StubServer, open_wizard: OpenWizard) -> None:
    console = open_wizard("overview")
    console.page.get_by_role("button", name="Delete Bench, spring").click()
    expect(console.page.get_by_text("Delete all that it measured?")).to_be_visible()
    assert [path for method, path, _ in stub.requests if method == "DELETE"] == []
    with console.page.expect_response(lambda answer: answer.request.method == "DELETE"):
        console.page.get_by_role("button", name="Delete", exact=True).click()


def test_drift_is_measured_shown_with_its_error_and_its_trend(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("overview")
    expect(console.page.get_by_text("Never checked yet.")).to_be_visible()
    console.page.get_by_label("Distance of the target").fill("4.2")
    console.page.get_by_role("button", name="Measure and correct").click()
    expect(console.page.locator(".job")).to_contain_text("Drift check")
    assert stub.posted_bodies("/drift_checks") == [{"distance_m": 4.2, "apply": True}]
    stub.answers["/drift_checks"] = [drift_check(applied=True)]
    ended = documents.job("job-1", kind="drift", state="succeeded")
    stub.set_job(ended)
    drift = console.page.locator(".drift")
    expect(drift.locator(".badge.good")).to_have_text("corrected")
    expect(drift.locator("tbody tr").first).to_contain_text("+0.0312°")
    expect(drift.locator(".trend")).to_have_js_property("complete", True)


def test_pan_tilt_homes_turns_by_steps_to_stations_and_holds(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("wide")
    side = console.page.locator(".wizard-side")
    with console.page.expect_response(re.compile("/pan_tilt/homings$")):
        side.get_by_role("button", name="Home").click()
    side.get_by_label("Step").select_option("0.5")
    for button in ("Turn right", "Turn up"):
        with console.page.expect_response(re.compile("/pan_tilt/moves$")):
            side.get_by_role("button", name=button).click()
    with console.page.expect_response(re.compile("/pan_tilt/moves$")):
        side.get_by_role("button", name="Turn to the station board").click()
    with console.page.expect_response(re.compile("/pan_tilt/holds$")):
        side.get_by_role("button", name="Hold").click()
    assert stub.posted_bodies("/pan_tilt/moves", count=3) == [
        {"pan_deg": 0.5, "tilt_deg": 0.0},
        {"pan_deg": 0.0, "tilt_deg": -0.5},
        {"station": "board"},
    ]


def test_rig_without_a_pan_tilt_says_what_that_means(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.answers["/pan_tilt"] |= {"present": False, "connected": False, "stations": []}
    console = open_wizard("mirrors")
    side = console.page.locator(".wizard-side")
    expect(side).to_contain_text("This rig has no pan-tilt")
    expect(side.get_by_role("button", name="Hold")).to_be_hidden()
    expect(console.page.locator("#step-mirrors .why")).to_contain_text("no pan-tilt")


def test_rig_turned_by_hand_is_told_which_way(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.answers["/pan_tilt"] |= {"moves_itself": False, "pan_deg": None, "tilt_deg": None}
    note = {"done": 3, "total": 81, "eta_s": None, "note": "turn the rig 4.2° to the right"}
    stub.set_job(documents.job("job-7", changes={"progress": note}))
    console = open_wizard("mirrors")
    expect(console.page.locator(".wizard-side .order")).to_have_text("Turn the rig 4.2° to the right.")
    expect(console.page.get_by_role("button", name="Turn left")).to_be_hidden()


def test_phone_shows_every_step_without_scrolling_sideways(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.session = stub.session | {"label": LONG, "problems": ["wide.json is cut short"]}
    stub.answers["/calibrations"][0]["label"] = LONG
    stub.answers["/drift_checks"] = [drift_check()]
    phone = open_console(f"{stub.url}#/calibration", options=TOUCH)
    expect(phone.page.locator(".damage")).to_contain_text("Wide.json is cut short.")
    for step in STEPS:
        phone.page.evaluate(f"location.hash = '#/calibration/{step}'")
        phone.page.locator(f"#step-{step}").wait_for()
        expect_to_fit(phone.page)
        expect(phone.page.locator("#stop"), step).to_be_visible()


def test_everything_that_can_be_pressed_has_a_name(open_wizard: OpenWizard) -> None:
    console = open_wizard("overview")
    for step in STEPS:
        console.page.locator(f"#to-{step}").click()
        console.page.locator(f"#step-{step}").wait_for()
        expect(console.page.locator(f"#to-{step}")).to_have_attribute("aria-current", "step")
        expect_value(console.page, lambda: console.page.locator(PRESSABLE).evaluate_all(UNNAMED), [])
