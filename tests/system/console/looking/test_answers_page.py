"""How the console words an answer by its basis, and what the operator can correct of it."""

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.support.pages.answer_documents import FAR, HIDDEN, NEAR, SEES, fixation, target
from tests.support.pages.awaited import box_of, expect_to_fit, let_run
from tests.support.pages.console_page import DESKTOP, PHONE, Console, OpenConsole, posted
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

Answered = Callable[..., Console]
BOUND = {"basis": "bound", "bound": {"nearest_m": 1.3, "farthest_m": 8.0}}
ONE_EYE = {
    "basis": "fovea_and_wide",
    "distance_m": 2.729,
    "distance_sigma_m": 0.02,
    "point_rig_m": [0.15, 0.1, 2.72],
    "left_view": HIDDEN,
    "right_view": SEES,
}


NEAR_BY_BOTH = {
    "basis": "both_foveae",
    "distance_m": 7.945,
    "distance_sigma_m": 0.008,
    "distance_sigma_random_m": 0.00049,
    "point_rig_m": [0.15, 0.1, 7.94],
}


@pytest.fixture
def answered(stub: StubServer, open_console: OpenConsole) -> Answered:
    """Open the page on a server whose last fixation is as given."""

    def open_(*, options: dict[str, object] | None = None, **answer: object) -> Console:
        stub.answers["/fixations"] = [fixation(**answer)]
        stub.answers["/targets"] = [target(**answer)]
        console = open_console(stub.url, options=options)
        console.page.locator("#fixation .details").wait_for()
        return console

    return open_


def test_one_eye_and_the_wide_camera_are_named_and_the_other_eyes_pane_says_why(answered: Answered) -> None:
    page = answered(**ONE_EYE).page
    expect(page.locator("#fixation .state.good")).to_have_text(
        "Measured by the right fovea and the wide camera"
    )
    expect(page.locator("[data-role=distance]")).to_have_text("2.729 ± 0.020 m")
    expect(page.locator(".targets .basis")).to_have_text("right fovea")
    expect(page.locator(".pane-left .eye-note")).to_have_text("Hidden from the left eye by something nearer.")
    expect(page.locator(".pane-right .eye-note")).to_be_hidden()


def test_repeatability_is_told_and_the_table_of_steps_leaves_it_in_sight(answered: Answered) -> None:
    step = {
        "index": 0,
        "phase": "parallel",
        **{f"{eye}_a{axis}_deg": -12.345 for eye in ("left", "right") for axis in "xy"},
        **dict.fromkeys(("residual_x_px", "residual_y_px"), -1234.56),
        "score": 0.9,
        "compute_ms": 12.0,
    }
    steps = [step | {"index": index} for index in range(3)]
    page = answered(**NEAR_BY_BOTH, steps=steps, options={"viewport": PHONE}).page
    value = page.locator(".details .numbers dt", has_text="Repeatability").locator("+ dd")
    expect(value).to_be_hidden()
    page.locator(".details > summary").click()
    expect(value).to_have_text("± 0.49 mm")
    page.locator(".steps summary").click()
    expect(page.locator(".steps table")).to_be_visible()
    panel, number = box_of(page.locator("#fixation")), box_of(value)
    assert number["x"] + number["width"] <= panel["x"] + panel["width"]


def test_a_phone_shows_the_result_below_the_wide_view_without_scrolling(answered: Answered) -> None:
    page = answered(**ONE_EYE, options={"viewport": PHONE}).page
    strip = page.locator("#result")
    expect(strip).to_be_in_viewport(ratio=1.0)
    expect(strip).to_contain_text("2.729 ± 0.020 m")
    expect(strip).to_contain_text("right fovea and wide camera")
    expect_to_fit(page)
    page.evaluate("window.scrollTo(0, 700)")
    expect(page.locator(".pane-wide")).not_to_be_in_viewport()
    expect(strip).to_be_in_viewport(ratio=1.0)  # it stays below the bar
    strip.click()
    expect(page.locator("#fixation [data-role=distance]")).to_be_in_viewport()
    page.set_viewport_size(DESKTOP)
    expect(strip).to_be_hidden()  # the card is beside the view


def test_limits_are_told_once_with_their_reason_and_the_click_can_be_corrected(
    stub: StubServer, answered: Answered
) -> None:
    reason = "farther than 1.3 m, nearer than 8.0 m. Out of reach: choose a point nearer to the middle."
    page = answered(**BOUND, reason=reason, options={"viewport": PHONE}).page
    expect(page.locator("[data-role=bound]")).to_have_text("farther than 1.3 m, nearer than 8.0 m")
    expect(page.locator("#fixation .outcome .lead:visible")).to_have_text(
        "Out of reach: choose a point nearer to the middle."  # the limits stand once
    )
    expect(page.locator(".targets .distance")).to_have_text("1.3 … 8.0 m")
    expect_to_fit(page)
    with page.expect_response("**/corrections"):
        page.get_by_role("button", name="Nearer").click()
    assert stub.posted_bodies("/fixations/fix-1/corrections") == [{"direction": "nearer"}]


def test_button_that_is_being_pressed_stays_while_the_shape_comes(
    stub: StubServer, answered: Answered
) -> None:
    page = answered(**ONE_EYE).page
    stub.wait_for_listener()
    nearer = page.get_by_role("button", name="Nearer")
    nearer.hover()
    page.mouse.down()
    stub.send_event("cloud.created", {"id": "cld-1", "fixation_id": "fix-1"})
    expect(page.locator(".outcome .downloads")).to_be_visible()
    with page.expect_request("**/corrections"):
        page.mouse.up()


def test_one_of_two_distances_is_chosen_with_a_click(stub: StubServer, answered: Answered) -> None:
    several = {**{key: NEAR[key] for key in NEAR if key != "probability"}, "alternatives": [NEAR, FAR]}
    page = answered(**several).page
    choices = page.locator(".alternative")
    expect(choices).to_have_count(2)
    expect(choices.nth(1)).to_contain_text("38 %")
    expect(page.get_by_text("None of these")).to_have_count(0)
    stub.answers["/fixations/fix-1/choice"] = fixation(**several, chosen_alternative=1)
    with page.expect_response("**/mirrors/steer") as steered:
        choices.nth(1).click()
    assert posted(steered.value.request)["distance_m"] == FAR["distance_m"]
    assert stub.posted_bodies("/fixations/fix-1/choice") == [{"alternative": 1}]
    expect(choices.nth(1)).to_have_attribute("aria-pressed", "true")
    expect(page.locator("[data-role=distance]")).to_have_text("2.729 ± 0.020 m")


def test_the_chance_that_no_listed_distance_is_right_is_told(answered: Answered) -> None:
    several = {key: NEAR[key] for key in NEAR if key != "probability"}
    page = answered(**several, alternatives=[{**NEAR, "probability": 0.5}, {**FAR, "probability": 0.24}]).page
    expect(page.locator(".alternatives")).to_contain_text("None of these: 26 %")


def estimate(step: int, distance_m: float, sigma_m: float, basis: str) -> dict[str, object]:
    known = {"distance_m": distance_m, "distance_sigma_m": sigma_m, "basis": basis}
    return {"fixation_id": "fix-2", "job_id": "job-2", "step": step, "elapsed_ms": 90.0, **known}


def test_distance_is_shown_as_it_becomes_known_and_spoken_once(stub: StubServer, answered: Answered) -> None:
    page = answered(**ONE_EYE).page
    stub.wait_for_listener()
    stub.answers["/fixations/estimates"] = [
        estimate(0, 8.0, 0.6, "surroundings")
    ]  # read after a reconnection
    stub.answers["/jobs/job-2"] = {"id": "job-2", "state": "running", "result_url": None, "problem": None}
    both = {**ONE_EYE, "basis": "both_foveae", "state": "verged"}
    announcer, number = page.locator("#announcer"), page.locator("[data-role=estimate]")
    stub.send_event("fixation.estimate", estimate(0, 8.0, 0.6, "surroundings"))
    expect(number).to_have_text("8.00 ± 0.60 m")
    expect(page.locator(".outcome .lead:visible")).to_have_text("so far: from its surroundings")
    expect(announcer).to_have_text("About 8.00 ± 0.60 m so far. Looking.")
    top_px = box_of(number)["y"]
    stub.send_event("fixation.estimate", estimate(1, 8.13, 0.004, "both_foveae"))
    expect(number).to_have_text("8.1300 ± 0.0040 m")
    expect(announcer).to_have_text("About 8.00 ± 0.60 m so far. Looking.")
    stub.send_event("fixation.done", fixation(**both, id="fix-2", job_id="job-2"))
    answer = page.locator("[data-role=distance]")
    expect(answer).to_have_text("2.729 ± 0.020 m")
    expect(announcer).to_contain_text("2.729 ± 0.020 m")
    assert abs(box_of(answer)["y"] - top_px) <= 12.0


def test_page_that_opens_in_the_midst_shows_what_is_known_at_phone_width(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.answers["/fixations/estimates"] = [estimate(2, 8.0, 0.6, "surroundings")]
    stub.answers["/jobs/job-2"] = {"id": "job-2", "state": "running", "result_url": None, "problem": None}
    page = open_console(stub.url, options={"viewport": PHONE}).page
    expect(page.locator("[data-role=estimate]")).to_have_text("8.00 ± 0.60 m")
    expect(page.locator("#fixation .state.running")).to_have_text("Verging")
    expect_to_fit(page)


# The stub's picture has half the size that `Console.place` counts in.


def test_click_on_a_target_corrects_it_and_one_elsewhere_does_not(answered: Answered) -> None:
    console = answered(**ONE_EYE)
    console.wait_for_frames("wide")
    expect(console.page.locator(".targets li")).to_have_count(1)
    sent = posted(console.click(723.0, 542.0))
    assert sent.get("corrects") == "fix-1", sent
    let_run(console.page, 600)  # else it is the second half of a double click
    assert "corrects" not in posted(console.click(860.0, 620.0))


def test_zones_of_the_eyes_are_drawn_and_told_under_the_pointer(answered: Answered) -> None:
    console = answered(**BOUND)
    console.wait_for_frames("wide")
    verdict = console.page.locator(".loupe .verdict")
    expect(console.page.locator(".overlay .one-eye")).to_have_count(2)
    expect(console.page.locator(".reach-legend")).to_contain_text("far away")
    for x_px, words in (
        (700.0, "both foveae"),
        (290.0, "left fovea only"),
        (20.0, "beyond the mirrors' reach"),
    ):
        console.page.mouse.move(*console.page_position(x_px, 540.0))
        expect(verdict).to_have_text(words)


def test_hint_marks_good_targets_until_it_is_dismissed_and_again_by_help(
    stub: StubServer, open_console: OpenConsole
) -> None:
    places = ((500.0, 400.0), (700.0, 700.0), (900.0, 500.0))
    stub.answers["/suggestions/checks"] = [
        {"x_px": x, "y_px": y, "ax_deg": 0.0, "ay_deg": 0.0, "score": 1.0, "verified": True}
        for x, y in places
    ]
    console = open_console(stub.url, settings={"hints": True})
    page = console.page
    expect(page.locator(".overlay .try")).to_have_count(3)
    page.get_by_role("button", name="Hide the hint").click()
    expect(page.locator(".overlay .try")).to_have_count(0)
    page.reload()
    page.locator(".pane-wide .picture").wait_for()
    console.wait_until("JSON.parse(localStorage.getItem('foveacam.settings')).hints === false")
    page.get_by_role("button", name="Help").click()
    page.get_by_role("button", name="Mark good targets").click()
    expect(page.locator(".hint-bar.first")).to_contain_text("Click one of the marked things")


def test_real_mirrors_do_not_move_for_a_hint_that_nobody_asked_for(
    stub: StubServer, open_console: OpenConsole
) -> None:
    place = {"x_px": 500.0, "y_px": 400.0, "ax_deg": 0.0, "ay_deg": 0.0, "score": 1.0, "verified": False}
    stub.answers["/suggestions"] = [place]
    stub.answers["/rig"] = stub.answers["/rig"] | {"simulated": False}
    page = open_console(stub.url, settings={"hints": True}).page
    expect(page.locator(".overlay .try")).to_have_count(1)
    assert not any(path == "/suggestions/checks" for _, path, _ in stub.requests)


def test_hint_is_gone_with_the_first_target_until_help_brings_it_back(
    stub: StubServer, open_console: OpenConsole
) -> None:
    place = {"x_px": 500.0, "y_px": 400.0, "ax_deg": 0.0, "ay_deg": 0.0, "score": 1.0, "verified": True}
    stub.answers["/suggestions/checks"] = [place]
    stub.answers["/targets"] = []
    page = open_console(stub.url, settings={"hints": True}).page
    marks = page.locator(".overlay .try")
    expect(marks).to_have_count(1)
    stub.answers["/targets"] = [target(**ONE_EYE)]
    page.reload()
    expect(page.locator("#targets")).to_contain_text("2.729")
    expect(marks).to_have_count(0)
    page.get_by_role("button", name="Help").click()
    page.get_by_role("button", name="Mark good targets").click()
    expect(marks).to_have_count(1)
