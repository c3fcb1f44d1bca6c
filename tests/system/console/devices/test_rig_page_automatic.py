"""The rig's page: what cameras set by themselves is offered, shown as read back, and can be left."""

import copy
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from tests.support.pages import rig_documents as documents
from tests.support.pages.awaited import expect_value
from tests.support.pages.console_page import Console, OpenShared
from tests.support.pages.stub_server import StubServer, problem

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

OpenCamera = Callable[[str], Locator]
READ_BACK = "Set by the camera, read back once a second."


@pytest.fixture
def console(stub: StubServer, open_stub: OpenShared) -> Console:
    opened = open_stub("#/rig")
    expect(opened.page.locator(".camera .phase")).to_have_count(3)
    return opened


def camera(console: Console, name: str) -> Locator:
    return console.page.get_by_role("region", name=name, exact=True)


def reads_back(stub: StubServer, role: str, **settings: object) -> None:
    """Let the server say something else of a camera from now on."""
    rig = copy.deepcopy(stub.answers["/rig"])
    for found in rig["cameras"]:
        if found["role"] == role:
            found["settings"].update(settings)
    stub.answers["/rig"] = rig


def sent(stub: StubServer) -> list[object]:
    return [body for method, _, body in stub.requests if method == "PATCH"]


def test_exposure_that_the_camera_sets_is_shown_as_read_back_and_cannot_be_set(
    stub: StubServer, console: Console
) -> None:
    wide = camera(console, "Wide camera")
    mode = wide.get_by_label("Automatic exposure")
    entry = wide.get_by_label("Exposure", exact=True)
    expect(mode.locator("option")).to_have_text(["Off", "Once", "Continuous"])
    mode.select_option("continuous")
    expect(entry).to_be_disabled()
    expect(wide.get_by_role("slider", name="Exposure")).to_be_disabled()
    expect(wide.get_by_role("button", name="Exposure of the wide camera: 10 ms")).to_be_disabled()
    expect(wide.get_by_text(READ_BACK)).to_be_visible()
    reads_back(stub, "wide", exposure_ms=23.4)
    expect(entry).to_have_value("23.4")
    mode.select_option("off")
    expect(entry).to_be_enabled()
    expect(wide.get_by_text(READ_BACK)).to_be_hidden()
    orders = [
        {"exposure_auto": "continuous", "linked": False},
        {"exposure_auto": "off", "linked": False},
    ]
    expect_value(console.page, lambda: sent(stub), orders)


def test_once_shows_that_it_looks_and_is_off_when_it_has_found(stub: StubServer, console: Console) -> None:
    wide = camera(console, "Wide camera")
    mode = wide.get_by_label("Automatic exposure")
    mode.select_option("once")
    expect(wide.get_by_text("The camera is looking for an exposure…")).to_be_visible()
    reads_back(stub, "wide", exposure_ms=6.5, exposure_auto="off")
    expect(mode).to_have_value("off")
    expect(wide.get_by_label("Exposure", exact=True)).to_have_value("6.5")
    expect(wide.get_by_label("Exposure", exact=True)).to_be_enabled()


def test_foveae_find_one_exposure_for_both_and_have_none_of_their_own(
    stub: StubServer, console: Console
) -> None:
    right = camera(console, "Right fovea")
    mode = right.get_by_label("Automatic exposure")
    expect(mode.locator("option")).to_have_text(["Off", "Once"])
    mode.select_option("once")
    for name in ("Left fovea", "Right fovea"):
        expect(camera(console, name).get_by_label("Exposure", exact=True)).to_have_value("12.5")
        expect(camera(console, name).get_by_label("Automatic exposure")).to_have_value("off")
    assert stub.bodies_of("PATCH", "/cameras/right") == [{"exposure_auto": "once", "linked": True}]
    stub.refusals["PATCH /cameras/right"] = problem(409, "Stopped", "the stop is engaged")
    mode.select_option("once")
    told = right.get_by_role("group", name="Exposure of the right fovea").get_by_role("alert")
    expect(told.first).to_have_text("The stop is engaged.")
    expect(mode).to_have_value("off")
    stub.refusals.clear()


def test_rate_of_its_own_is_each_cameras_and_shown_as_read_back(stub: StubServer, console: Console) -> None:
    left = camera(console, "Left fovea")
    box, entry = left.get_by_label("Automatic frame rate"), left.get_by_label("Frame rate", exact=True)
    box.check()
    expect(entry).to_be_disabled()
    reads_back(stub, "left", frame_rate_hz=87.5)
    expect(entry).to_have_value("87.5")
    expect(camera(console, "Right fovea").get_by_label("Automatic frame rate")).not_to_be_checked()
    box.uncheck()
    expect(entry).to_be_enabled()
    orders = [
        {"frame_rate_auto": True, "linked": False},
        {"frame_rate_auto": False, "linked": False},
    ]
    expect_value(console.page, lambda: sent(stub), orders)


def test_what_a_camera_lacks_is_not_offered_and_modes_that_differ_are_told(
    stub: StubServer, console: Console
) -> None:
    rig = copy.deepcopy(stub.answers["/rig"])
    for found in rig["cameras"]:
        found["ranges"].update(exposure_auto=["off"], frame_rate_auto=False)
    left = next(found for found in rig["cameras"] if found["role"] == "left")
    left["settings"]["exposure_auto"] = "continuous"
    stub.answers["/rig"] = rig | {"divergence": documents.divergence(rig)}
    asked = console.page.get_by_role("alertdialog")
    expect(asked.locator("tbody tr")).to_have_text(["Automatic exposurecontinuousoff"])
    wide = camera(console, "Wide camera")
    expect(wide.get_by_label("Automatic exposure")).to_be_hidden()
    expect(wide.get_by_label("Automatic frame rate")).to_be_hidden()
