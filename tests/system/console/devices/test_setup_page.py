"""Setting a rig up in the browser, from nothing to a rig that is open, without touching a file."""

import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import APIResponse, Locator, Page, Route, expect

from foveacam_hardware.drivers.cameras.aravis import library
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.rig_config import load_rig_config
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from tests.support.devices.gige_cameras import fake_program
from tests.support.pages import rig_documents
from tests.support.pages.awaited import expect_to_fit, expect_value, settled, wait_for
from tests.support.pages.console_page import TOUCH, Console, OpenConsole
from tests.support.pages.stub_server import StubServer
from tests.support.servers.running_server import running
from tests.support.servers.server_process import Server, server_of

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

OpenSetup = Callable[..., Console]
GIGE = "GV-7"


@pytest.fixture(scope="module")
def own_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server whose rig these tests exchange, and whose live views hardly render.

    It finds one network camera only: it takes a picture with each that it finds, and others on this machine
    belong to tests that run at the same time.
    """

    def find_own() -> list[FoundCamera]:
        return [camera for camera in search() if camera.info.serial == GIGE]

    search = library.find_cameras
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(library, "find_cameras", find_own)
        with running(tmp_path_factory.mktemp("data"), live_hz=(0.2, 0.2)) as found:
            yield server_of(found)


@pytest.fixture
def open_setup(own_server: Server, open_console: OpenConsole) -> Iterator[OpenSetup]:
    """Open the page with a draft of nothing, on the simulated rig."""
    own_server.send("POST", "/rig/setup/draft", {"path": None})
    name = own_server.get("/rig")["name"]

    def open_() -> Console:
        console = open_console(f"{own_server.url}#/setup")
        expect(console.page.locator(".setup-camera").first).to_be_visible()
        return console

    yield open_
    if own_server.get("/rig")["name"] != name:
        own_server.send("POST", "/rig/setup/open", {"path": None})


def card(page: Page, kind: str, name: str) -> Locator:
    return page.locator(f'[data-camera="{kind} {name}"]')


def give(page: Page, kind: str, name: str, role: str) -> None:
    """Give a camera a role by its card."""
    chip = card(page, kind, name).get_by_role("button", name=role, exact=True)
    chip.click()
    expect(chip).to_have_attribute("aria-pressed", "true")


def enter(page: Page, field: str, value: str) -> None:
    entry = page.locator(f"#setup-{field}")
    entry.fill(value)
    entry.press("Tab")


def step(page: Page, device: str) -> Locator:
    return page.locator(f'.start-steps [data-step="{device}"]')


def open_now(page: Page) -> None:
    page.get_by_role("button", name="Open this rig now").click()
    page.get_by_role("alertdialog").get_by_role("button", name="Open it").click()


def save(page: Page) -> Path:
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("The file contains all of this already.")).to_be_visible()
    return Path(settled(page, page.locator(".inside > .lead.number").first.inner_text))


def test_simulated_rig_is_set_up_from_nothing_opened_and_undone(
    own_server: Server, open_setup: OpenSetup
) -> None:
    page = open_setup().page
    expect(card(page, "simulated", "left").locator("img")).to_be_visible()
    give(page, "simulated", "wide", "wide")
    give(page, "simulated", "left", "right")
    field = page.locator(".role-right")
    expect(field).to_contain_text("This is the simulated left camera; give right its own.")
    give(page, "simulated", "left", "left")
    give(page, "simulated", "right", "right")
    page.get_by_role("button", name="simulated", exact=True).click()
    enter(page, "name", "Bench two")
    enter(page, "rig_id", "bench-2")
    page.get_by_role("button", name="Does it answer?").first.click()
    expect(page.get_by_text("The controller answers: FoveaCam mirror controller")).to_be_visible()
    page.get_by_role("button", name="Small step of the mirrors").click()
    page.get_by_role("alertdialog").get_by_role("button", name="Move them").click()
    expect(page.get_by_text("came back, and the controller confirmed each")).to_be_visible()
    expect(page.locator(".difference")).to_contain_text('+name = "Bench two"')

    path = save(page)
    assert load_rig_config(path).name == "Bench two"
    open_now(page)
    expect(page.locator(".rig-name")).to_have_text("Bench two")
    expect(page.locator(".start-steps .good")).to_have_count(9)
    expect(page.get_by_text("This file's rig is open.")).to_be_visible()
    expect(page.get_by_label("Command", exact=True)).to_have_text(f"foveacam serve --rig {path}")

    enter(page, "name", "Bench three")
    save(page)
    page.get_by_role("button", name="Undo the last saving").click()
    expect(page.locator("#setup-name")).to_have_value("Bench two")
    assert load_rig_config(path).name == "Bench two"


def test_wrong_fields_are_listed_beside_save_and_lead_to_themselves(
    own_server: Server, open_setup: OpenSetup
) -> None:
    page = open_setup().page
    wrong = page.locator(".wrong-fields")
    expect(wrong.get_by_role("button")).to_have_text("Controller, Port")
    expect(page.get_by_role("button", name="Save", exact=True)).to_be_disabled()
    wrong.get_by_role("button", name="Controller, Port").click()
    expect(page.locator("#setup-mirrors-port")).to_be_focused()
    expect(page.locator("#setup-mirrors-port")).to_be_in_viewport()


def test_the_rig_that_runs_is_the_one_that_the_page_shows_with_what_saving_changes_folded(
    own_server: Server, open_setup: OpenSetup
) -> None:
    own_server.send("POST", "/rig/setup/draft", {"path": None, "simulated": True})
    page = open_setup().page
    chosen = page.locator("#setup-file option:checked")
    expect(chosen).to_have_text("the simulated rig, open now")
    expect(page.locator(".wrong-fields")).to_have_count(0)
    expect(page.get_by_role("button", name="Save", exact=True)).to_be_enabled()
    difference = page.locator(".difference")
    expect(difference).to_be_hidden()
    page.get_by_text(re.compile("^What saving changes: \\d+ lines$")).click()
    expect(difference).to_be_visible()
    page.locator("#setup-file").select_option("a new rig")
    expect(page.locator(".wrong-fields")).to_be_visible()
    give(page, "simulated", "wide", "wide")
    expect(page.locator("#setup-page")).to_contain_text("choose the simulated controller")
    expect(chosen).to_have_text("a new rig")  # whatever devices it takes
    page.locator("#setup-file").select_option(label="the simulated rig, open now")
    expect(page.locator(".wrong-fields")).to_have_count(0)


def test_simulated_rig_is_opened_in_another_scene(own_server: Server, open_setup: OpenSetup) -> None:
    page = open_setup().page
    scene = page.get_by_label("Scene of the simulated rig")
    expect(scene).to_have_value("bench")
    scene.select_option("toy")
    page.get_by_role("alertdialog").get_by_role("button", name="Cancel").click()
    expect(scene).to_have_value("bench")
    for name in ("toy", "bench"):
        scene.select_option(name)
        page.get_by_role("alertdialog").get_by_role("button", name="Open it").click()
        expect_value(page, lambda: own_server.get("/rig")["scene"], name)
        expect(scene).to_have_value(name)


def test_edit_by_hand_meanwhile_is_shown_and_kept(own_server: Server, open_setup: OpenSetup) -> None:
    page = open_setup().page
    enter(page, "rig_id", "by-hand")
    enter(page, "mirrors-port", "auto")
    path = save(page)
    path.write_text(path.read_text(encoding="utf-8") + "# measured on Monday\n", encoding="utf-8")
    enter(page, "markers-side_mm", "61")
    page.evaluate("document.querySelector('.setup-side .primary').scrollIntoView()")
    expect(page.get_by_text("The file was changed by somebody else meanwhile")).to_be_visible()
    save(page)
    written = path.read_text(encoding="utf-8")
    assert "# measured on Monday" in written
    assert tomllib.loads(written)["markers"]["side_mm"] == 61.0


def test_rig_of_basler_cameras_is_set_up_and_opened(own_server: Server, open_setup: OpenSetup) -> None:
    with ControllerProcess(RecordingCables()) as controller:
        page = open_setup().page
        for number, role in enumerate(("wide", "left", "right")):
            give(page, "pylon", f"0815-000{number}", role)
        expect(card(page, "pylon", "0815-0001").locator("img")).to_be_visible()
        enter(page, "rig_id", "basler")
        enter(page, "name", "Three Baslers")
        enter(page, "mirrors-port", controller.port)
        page.get_by_role("button", name="Does it answer?").first.click()
        expect(page.get_by_text("The controller answers: FoveaCam mirror controller")).to_be_visible()
        path = save(page)
        open_now(page)
        expect(page.locator(".rig-name")).to_have_text("Three Baslers")
        for device in ("rig", "mirrors", "wide", "left", "right"):
            expect(step(page, device)).to_have_class("good")
        expect(step(page, "calibration")).to_have_class("bad")
        expect(card(page, "pylon", "0815-0001")).to_contain_text("open as left")
        assert [camera["serial"] for camera in own_server.get("/rig")["cameras"]] == [
            "0815-0000",
            "0815-0001",
            "0815-0002",
        ]
        config = tomllib.loads(path.read_text(encoding="utf-8"))
        assert config["cameras"]["left"] == {"kind": "pylon", "serial": "0815-0001"}
        controller.unplug()
        expect(page.locator("#problems")).to_contain_text("mirrors")
        page.get_by_role("button", name="Does it answer?").first.click()
        expect(page.locator(".setup-values .note.bad").first).to_be_visible()


def test_gige_camera_is_found_chosen_opened_and_missed_when_it_leaves(
    own_server: Server, open_setup: OpenSetup
) -> None:
    with fake_program(GIGE) as camera:
        console = open_setup()
        page = console.page
        give(page, "aravis", GIGE, "wide")
        expect(card(page, "aravis", GIGE).locator("img")).to_be_visible()
        enter(page, "rig_id", "gige")
        page.get_by_label("Left and right expose").select_option("software")
        enter(page, "mirrors-port", "/dev/no-such-port")
        expect(page.locator("#setup-mirrors-port-notes")).to_contain_text("not there")
        save(page)
        open_now(page)
        expect(step(page, "wide")).to_have_class("good")
        expect(step(page, "mirrors")).to_contain_text("/dev/no-such-port")
        assert own_server.get("/rig")["cameras"][0]["serial"] == GIGE
        camera.kill()
        expect(page.locator("#problems")).to_contain_text(GIGE)
        page.get_by_role("button", name="Search again").click()
        expect(page.locator(".role-wide")).to_contain_text(f"Serial {GIGE} is not there")
        console.errors = [
            error for error in console.errors if "status of 503" not in error
        ]  # its last picture


def test_an_older_answer_replaces_no_choice_that_was_sent_meanwhile(
    own_server: Server, open_setup: OpenSetup
) -> None:
    page = open_setup().page
    read: list[tuple[Route, APIResponse]] = []
    held = iter((True, True))

    def hold_back(route: Route) -> None:
        if route.request.method == "GET" and next(held, False):
            read.append((route, route.fetch()))
        else:
            route.continue_()

    page.route("**/rig/setup/draft", hold_back)
    page.evaluate("location.hash = '#/rig'")
    page.evaluate("location.hash = '#/setup'")
    wait_for(page, lambda: len(read) == 1, "the draft is read when the page is opened")
    give(page, "simulated", "wide", "wide")
    wait_for(page, lambda: _chosen(own_server, "wide") is not None, "the server has the choice")
    route, answer = read.pop()
    route.fulfill(response=answer)
    wait_for(page, lambda: len(read) == 1, "the draft is read once more, after the answer was shown")
    give(page, "simulated", "left", "left")
    wait_for(page, lambda: _chosen(own_server, "left") is not None, "the server has the choice")
    route, answer = read.pop()
    route.fulfill(response=answer)

    assert _chosen(own_server, "wide") == {"kind": "simulated", "name": "wide"}
    expect(card(page, "simulated", "wide").get_by_role("button", name="wide", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )


def _chosen(server: Server, role: str) -> object:
    return server.get("/rig/setup/draft")["draft"]["cameras"][role]


def test_start_stands_over_the_console_at_what_failed_until_it_is_dismissed(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.answers["/rig/start"] = rig_documents.start(mirrors="failed", wide="active")
    page = open_console(stub.url).page
    strip = page.locator("#start")
    expect(strip).to_contain_text("The start met problems")
    expect(strip.locator("li.bad")).to_contain_text("Mirrors' controller")
    expect(strip.locator("li.warn")).to_contain_text("Wide camera")
    stub.answers["/rig/start"] = rig_documents.start(mirrors="failed")
    expect(strip.locator("li.warn")).to_have_count(0)
    expect(strip.get_by_role("link", name="Set up")).to_have_attribute("href", "#/setup")
    strip.get_by_role("button", name="Dismiss").click()
    expect(strip).to_be_hidden()


def test_page_fits_a_phone(own_server: Server, open_setup: OpenSetup, open_console: OpenConsole) -> None:
    page = open_console(f"{own_server.url}#/setup", options=TOUCH).page
    expect(page.locator(".setup-camera").first).to_be_visible()
    expect_to_fit(page)
