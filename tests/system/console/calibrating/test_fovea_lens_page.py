"""The lens of a fovea on the page of the step wide: its order, its result, its views, what it is for."""

import re

import pytest
from playwright.sync_api import Locator, Page, Route, expect

from tests.support.pages import calibration_documents as documents
from tests.support.pages.awaited import expect_to_fit, let_run, wait_for
from tests.support.pages.calibration_documents import SESSION_ID
from tests.support.pages.console_page import PHONE, OpenConsole, OpenWizard
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

URL = f"/calibration_sessions/{SESSION_ID}"


def panel(page: Page) -> Locator:
    return page.get_by_role("region", name="Lens of a fovea")


def test_views_are_asked_for_by_camera_and_the_panel_says_what_it_is_for(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = documents.empty_session()
    page = open_wizard("wide", fresh=True).page
    expect(panel(page)).to_contain_text("Nothing here changes a calibration")
    panel(page).get_by_label("Camera").select_option("Right fovea")
    panel(page).get_by_text("Board and options").click()
    panel(page).get_by_label("Views wanted").fill("12")
    with page.expect_response(lambda response: response.url.endswith("/runs")):
        panel(page).get_by_role("button", name="Take views").click()

    assert stub.posted_bodies(f"{URL}/runs") == [
        {"step": "lens", "options": {"camera": "right", "views": 12}}
    ]
    expect(page.locator(".jobbar")).to_contain_text("Lens of a fovea")
    expect(page.locator(".live-right")).to_be_visible()
    expect(page.locator(".live-wide")).to_be_hidden()


def test_result_says_what_the_views_tell_fits_a_phone_and_views_are_taken_out(
    stub: StubServer, open_wizard: OpenWizard
) -> None:
    stub.session = documents.empty_session() | {"lenses": [documents.fovea_lens("left")]}
    page = open_wizard("wide", fresh=True).page
    table = panel(page).locator("table")
    expect(panel(page)).to_contain_text("2.869° × 2.152°")
    expect(table).to_contain_text("28758.9 ± 2.1 px")
    expect(table.locator("tr", has_text="Centre, x")).to_contain_text("assumed")
    expect(table.locator("tr", has_text="k2, p1, p2, k3")).to_contain_text("assumed")
    expect(panel(page).locator(".samples li")).to_have_count(6)
    page.set_viewport_size(PHONE)
    expect_to_fit(page)

    with page.expect_response(lambda response: response.request.method == "DELETE"):
        panel(page).get_by_role("button", name="Remove view 6").click()
    assert stub.bodies_of("DELETE", f"{URL}/lenses/left/samples/view5") == [None]

    panel(page).get_by_label("Camera").select_option("Right fovea")
    expect(panel(page).locator(".samples li")).to_have_count(0)
    expect(table).to_have_count(0)


def test_too_few_views_say_so(stub: StubServer, open_wizard: OpenWizard) -> None:
    few = documents.fovea_lens("left", views=2, determined=False)
    stub.session = documents.empty_session() | {"lenses": [few]}
    page = open_wizard("wide", fresh=True).page
    expect(panel(page)).to_contain_text("2 views of the board, at least 3 are needed")


def test_what_is_typed_stays_when_the_session_comes_late(stub: StubServer, open_console: OpenConsole) -> None:
    stub.session = documents.empty_session()
    held: list[Route] = []
    session = re.compile(f"{URL}$")
    page = open_console(
        f"{stub.url}#/calibration/wide",
        prepare=lambda page: page.route(session, lambda route: held.append(route)),
    ).page
    options = page.get_by_role("region", name="Views of the board")
    options.get_by_text("Board and options").click()
    options.get_by_label("Columns").fill("7")
    wait_for(page, lambda: bool(held))
    with page.expect_response(session):
        held[0].continue_()
    let_run(page, 200)
    expect(options.get_by_label("Columns")).to_have_value("7")


def test_the_board_is_described_as_it_was_printed(stub: StubServer, open_wizard: OpenWizard) -> None:
    stub.session = documents.empty_session()
    page = open_wizard("wide", fresh=True).page
    options = page.get_by_role("region", name="Views of the board")
    options.get_by_text("Board and options").click()
    for label, value in (("Columns", "7"), ("Rows", "4"), ("Square", "30"), ("Marker", "22")):
        options.get_by_label(label).fill(value)
    options.get_by_label("Dictionary").select_option("6X6_250")
    options.get_by_label("Drawn by OpenCV before 4.6").check()
    page.set_viewport_size(PHONE)
    expect_to_fit(page)
    with page.expect_response(lambda response: response.url.endswith("/runs")):
        options.get_by_role("button", name="Take views").click()
    (posted,) = stub.posted_bodies(f"{URL}/runs")
    assert posted["options"]["board"] == {
        "kind": "charuco",
        "columns": 7,
        "rows": 4,
        "square_mm": 30,
        "marker_mm": 22,
        "dictionary": "6X6_250",
        "legacy_pattern": True,
    }
    options.get_by_label("Board", exact=True).select_option("Checkerboard")
    expect(options.get_by_label("Dictionary")).to_be_hidden()
