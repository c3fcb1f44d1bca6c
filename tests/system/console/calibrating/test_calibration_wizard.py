"""Calibrating from the console: health in view, steps that run and end, and what is read on the way."""

import re

import pytest
from playwright.sync_api import Locator, Route, expect

from tests.support.pages import calibration_documents as documents
from tests.support.pages.awaited import wait_for
from tests.support.pages.console_page import Console, OpenShared, OpenWizard
from tests.support.pages.stop import expect_stop_in_reach
from tests.support.pages.stub_server import StubServer, problem

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120), pytest.mark.usefixtures("measured")]

RUNS = f"/calibration_sessions/{documents.SESSION_ID}/runs"


def step(console: Console, name: str) -> Locator:
    return console.page.locator(f"#step-{name}")


def test_top_bar_says_how_healthy_the_calibration_is_and_opens_the_wizard(
    stub: StubServer, open_stub: OpenShared
) -> None:
    console = open_stub("#/")
    badge = console.page.locator(".badges a")
    expect(badge).to_have_text("Calibration good · 3 h")
    expect(badge).to_have_attribute("title", re.compile("agree as well as on the day"))
    expect(console.page.locator("#rig")).to_contain_text("good: The rows of both eyes agree")
    expect(console.page.locator("#problems")).to_be_hidden()
    stub.answers["/calibrations/health"] = documents.health("recalibrate")
    stub.send_event("calibration.health", {"verdict": "recalibrate"})
    expect(badge).to_have_text("Recalibrate · 3 h")
    expect(console.page.locator("#problems")).to_contain_text("2.4 px apart")
    badge.click()
    expect(console.page.locator("#wizard-title")).to_be_focused()
    console.page.go_back()
    expect(console.page.locator("main")).to_be_visible()


def test_live_views_come_along_and_return_and_clicks_in_the_wizard_steer_nothing(
    stub: StubServer, open_stub: OpenShared
) -> None:
    console = open_stub("#/")
    console.wait_for_frames("wide")
    console.page.get_by_role("link", name="Calibrate", exact=True).click()
    console.page.get_by_role("link", name=re.compile("1 Wide camera")).click()
    picture = step(console, "wide").locator(".pane-wide .surface")
    expect(picture).to_be_visible()
    picture.click(force=True)
    console.page.get_by_role("link", name="Back to the console").click()
    expect(console.page.locator("#wide .pane-wide .surface")).to_be_visible()
    assert stub.posted_bodies("/fixations", count=0) == []
    eyes = console.page.locator("#eyes > .pane")
    expect(eyes).to_have_count(2)
    expect(eyes.first).to_have_class(re.compile("pane-left"))


def test_calibrating_everything_begins_a_session_and_runs_all_steps(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.reset()
    console = open_wizard("overview")
    expect(console.page.get_by_text("Nothing measured yet", exact=True)).to_be_visible()
    console.page.get_by_role("button", name="Calibrate everything").click()
    sheet = console.page.locator("dialog[open]")
    sheet.get_by_label("Label").fill("After the move")
    sheet.get_by_role("button", name="Start").focus()
    expect_stop_in_reach(console.page)
    sheet.get_by_role("button", name="Start").click()
    expect(console.page.locator(".job")).to_contain_text("Everything")
    assert stub.posted_bodies("/calibration_sessions") == [{"label": "After the move"}]
    assert stub.posted_bodies(RUNS) == [{"step": "all", "options": {"activate": True}}]


def test_page_goes_along_with_the_steps_while_everything_is_calibrated(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = stub.session | {"sweeps": [documents.sweep("markers", 5.0, done=81)]}
    stub.set_job(documents.job("job-7", kind="calibration.all"))
    console = open_wizard("overview", fresh=True)
    expect(console.page.locator(".job")).to_contain_text("Everything")
    progress = {"session_id": documents.SESSION_ID, "step": "mirrors", "done": 0, "total": 81, "note": ""}
    stub.send_event("calibration.progress", progress)
    expect(step(console, "mirrors")).to_be_visible()
    for done in (5, 6):
        near = documents.sweep("markers near", 2.5, done=done)
        stub.session = stub.session | {"sweeps": [stub.session["sweeps"][0], near]}
        with console.page.expect_response(re.compile(f"/{documents.SESSION_ID}$")):
            stub.send_event("calibration.progress", progress | {"done": done})
    chosen = step(console, "mirrors").locator(".station[aria-pressed=true]")
    expect(chosen).to_contain_text("markers near")
    console.page.get_by_role("link", name="Overview").click()
    stub.send_event("calibration.progress", progress | {"step": "fit"})
    expect(console.page.locator(".job")).to_contain_text("Everything: fit")
    expect(step(console, "overview")).to_be_visible()


def test_running_step_tells_how_far_it_is_and_can_be_cancelled(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.set_job(documents.job("job-7"))
    console = open_wizard("mirrors", fresh=True)
    bar = console.page.locator(".job")
    expect(bar).to_contain_text("34 of 81, 2 min left")
    expect(bar.get_by_role("progressbar")).to_have_attribute("aria-valuenow", "42")
    further = {"done": 35, "total": 81, "eta_s": 90.0, "note": "node 36"}
    stub.answers["/jobs/job-7"] = documents.job("job-7", changes={"progress": further})
    stub.send_event("calibration.progress", {"session_id": documents.SESSION_ID, "step": "mirrors"} | further)
    expect(bar).to_contain_text("35 of 81")
    expect(step(console, "mirrors").get_by_role("button", name="Go on measuring")).to_be_disabled()
    expect(console.page.locator(".badges a")).to_have_text(re.compile("Calibrating 4[13] %"))
    with console.page.expect_response(re.compile("/jobs/job-7/cancel$")):
        bar.get_by_role("button", name="Cancel").click()
    stub.set_job(documents.job("job-7", state="cancelled"))
    expect(bar).to_contain_text("What was measured is kept")
    expect(step(console, "mirrors").get_by_role("button", name="Go on measuring")).to_be_enabled()


def test_failed_step_says_why_and_what_to_do_until_dismissed(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("mirrors")
    step(console, "mirrors").get_by_role("button", name="Go on measuring").click()
    expect(console.page.locator(".job.running")).to_be_visible()
    why = problem(502, "Device fault", "the left marker was hidden throughout", "uncover marker 1")
    stub.set_job(documents.job("job-1", state="failed", changes={"problem": why}))
    bar = console.page.locator(".job.bad")
    expect(bar).to_contain_text("The left marker was hidden throughout.")
    expect(bar.locator(".remedy")).to_have_text("Uncover marker 1.")
    bar.get_by_role("button", name="Dismiss").click()
    expect(bar).to_be_hidden()


def test_refused_order_is_told_with_its_remedy(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.refusals[f"POST {RUNS}"] = problem(409, "Stopped", "the rig is stopped", "release the stop")
    console = open_wizard("check")
    step(console, "check").get_by_role("button", name="Check again").click()
    expect(console.page.locator(".toast")).to_contain_text("The rig is stopped.")
    expect(console.page.locator(".toast .remedy")).to_have_text("Release the stop.")
    expect(console.page.locator(".job")).to_be_hidden()


def test_nodes_fill_up_as_the_poses_come_and_say_why_an_eye_was_refused(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("mirrors")
    mirrors = step(console, "mirrors")
    refused = mirrors.locator(".node[data-index='12']")
    mirrors.locator(".node[data-index='11']").focus()
    console.page.keyboard.press("ArrowRight")
    expect(refused).to_be_focused()
    detail = mirrors.locator(".node-detail")
    expect(detail).to_contain_text("right refused (its marker is only partly in the picture")
    mirrors.get_by_role("button", name=re.compile("markers near")).click()
    waiting = mirrors.locator(".node[data-index='40'] .left")
    expect(waiting).to_have_attribute("data-state", "waiting")
    near = documents.sweep("markers near", 2.5, done=41)
    near["poses"][40]["right"] = "refused"
    stub.session = stub.session | {"sweeps": [stub.session["sweeps"][0], near]}
    pose = {"session_id": documents.SESSION_ID, "station": "markers near", "index": 40}
    stub.send_event("calibration.pose", pose | {"left": "centred", "right": "refused"})
    expect(waiting).to_have_attribute("data-state", "centred")
    mirrors.locator(".node[data-index='40']").hover()
    expect(detail).to_contain_text("left centred; right refused")


def test_pictures_of_the_procedure_replace_the_plain_ones_while_it_runs(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.set_job(documents.job("job-7"))
    stub.annotated = True
    console = open_wizard("mirrors")
    expect(console.page.get_by_role("region", name="View Left fovea, annotated")).to_be_visible()
    console.wait_for_frames("calibration_left", "calibration_right")
    stub.set_job(documents.job("job-7", state="succeeded"))
    expect(console.page.get_by_role("region", name="View Left fovea", exact=True)).to_be_visible()
    expect(console.page.get_by_role("region", name="View Left fovea, annotated")).to_be_hidden()


def test_what_is_ordered_right_after_a_new_measurement_belongs_to_it(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = documents.full_session() | {"id": "older", "label": "Older"}
    console = open_wizard("check")
    expect(console.page.get_by_label("Measurement", exact=True)).to_have_value("older")
    held: list[Route] = []
    console.page.route(
        "**/calibration_sessions",
        lambda route: held.append(route) if route.request.method == "POST" else route.continue_(),
    )
    console.page.get_by_role("button", name="New", exact=True).click()
    console.page.get_by_role("button", name="Check again").click()
    wait_for(console.page, lambda: len(held) == 1)
    assert not [path for _, path, _ in stub.requests if path.endswith("/runs")]
    with console.page.expect_response(re.compile("/runs$")):
        held[0].continue_()
    assert stub.posted_bodies(RUNS) == [{"step": "check", "options": {}}]


def test_check_holds_its_figures_against_the_goals_and_says_of_which_fit_it_is(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("check")
    goals = step(console, "check").locator(".goals")
    expect(goals).to_contain_text("0.21 px")
    expect(goals.locator(".badge.good")).to_have_text(["within 0.3 px", "within 2 px"])
    expect(goals.locator(".badge.warn")).to_have_text(["beyond 0.8 px"])
    expect(step(console, "check")).not_to_contain_text("Fitted again since")
    stub.session = stub.session | {"calibrations": ["a" * 32, "b" * 32]}
    stub.send_event("calibration.fitted", {"session_id": documents.SESSION_ID})
    expect(step(console, "check")).to_contain_text("Fitted again since: this check is of the previous fit")


def test_measured_settle_time_is_put_in_use_and_the_rig_files_again(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    wait = step(open_wizard("settle"), "settle").get_by_role("region", name="Wait after a move")
    expect(wait.locator("dl")).to_contain_text("14.0 msKnown fromthe rig file, not measured")
    back = wait.get_by_role("button", name="Use the rig file’s 14.0 ms")
    expect(back).to_be_disabled()
    wait.get_by_role("button", name="Use the measured 11.2 ms").click()
    expect(wait.locator("dl")).to_contain_text(
        re.compile("11.2 msKnown frommeasured Mar 14, 2026, .* in this session")
    )
    expect(wait.get_by_role("button", name="Use the measured 11.2 ms")).to_be_disabled()
    back.click()
    expect(wait.locator("dl")).to_contain_text("the rig file, not measured")
    orders = [
        (method, body) for method, path, body in stub.requests if path == "/settle_time" and method != "GET"
    ]
    assert orders == [("PUT", {"session_id": documents.SESSION_ID}), ("DELETE", None)]


def test_view_that_spoils_the_fit_stands_out_and_is_removed(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    wide = step(open_wizard("wide"), "wide")
    expect(wide.locator(".samples .far")).to_have_count(1)
    expect(wide.locator(".compare thead")).to_contain_text("Rational")
    remove = wide.get_by_role("button", name="Remove view 6")
    expect(remove).to_be_enabled()
    remove.press("Enter")
    expect(wide.locator(".samples li")).to_have_count(27)
    expect(wide.locator(".samples .far")).to_have_count(0)
    expect(remove).to_be_focused()


def test_step_that_lacks_an_earlier_one_is_off_and_names_it(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = documents.empty_session()
    console = open_wizard("mirrors")
    expect(step(console, "mirrors").get_by_role("button", name="Measure", exact=True)).to_be_disabled()
    expect(step(console, "mirrors").locator(".why")).to_contain_text("First step 1")
    console.page.get_by_role("link", name="4 Check").click()
    expect(step(console, "check").locator(".why")).to_contain_text("First step 3")


def test_options_of_the_sweep_are_sent_as_typed_and_left_out_where_empty(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    console = open_wizard("mirrors", fresh=True)
    mirrors = step(console, "mirrors")
    mirrors.get_by_text("Grid and options").click()
    mirrors.get_by_label("Nodes across").fill("5")
    mirrors.get_by_label("Across up to ±").fill("4.5")
    mirrors.get_by_label("Measure at").select_option("one")
    mirrors.get_by_role("button", name="Go on measuring").click()
    expect(console.page.locator(".job.running")).to_be_visible()
    assert stub.posted_bodies(RUNS) == [
        {"step": "mirrors", "options": {"stations": ["markers"], "nodes": [5, 5], "extent_ax_deg": 4.5}}
    ]


def test_paper_model_stands_beside_ours_and_the_parallax_is_stated(open_wizard: OpenWizard) -> None:
    console = open_wizard("fit")
    fit = step(console, "fit")
    expect(fit.locator("tr.chosen")).to_contain_text(["order 7", "order 6"])
    expect(fit.get_by_role("region", name="What each addition brings")).to_contain_text("8.60 px")
    expect(fit).to_contain_text("Paper: error on poses left out")
    expect(fit).to_contain_text("The target is 2.5 m away by its print; the parallax of Eq. 1 was taken out.")
    expect(fit).to_contain_text(
        "knocked during the sweeps: the left eye’s gaze jumped by 158.66 px, then by 4.10 px. This"
    )
    slider = fit.get_by_role("slider")
    slider.fill("80")
    expect(fit.locator(".pair")).to_have_attribute("style", re.compile("--part: ?80%"))


def test_calibrating_everything_without_stations_says_so_and_opens_a_scene_that_has_them(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.answers["/pan_tilt"]["stations"] = []
    page = open_wizard("overview").page
    page.get_by_role("button", name="Calibrate everything").click()
    dialog = page.get_by_role("dialog", name="Calibrate everything")
    expect(dialog.get_by_role("button", name="Start")).to_be_disabled()
    expect(dialog).to_contain_text("This rig has no station with markers.")
    dialog.get_by_role("button", name="Open the calibration scene").click()
    with page.expect_request("**/rig/setup/open") as sent:
        page.get_by_role("alertdialog").get_by_role("button", name="Open it").click()
    assert sent.value.post_data_json == {"path": None, "scene": "calibration"}
