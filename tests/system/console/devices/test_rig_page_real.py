"""The rig's page on the simulated rig: read-back, a pair set apart, a camera that goes and returns."""

import math
import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, expect

from foveacam_hardware.contract import AutoMode, Role
from tests.support.pages.awaited import expect_value
from tests.support.pages.console_page import Console, OpenShared
from tests.support.servers.running_server import API, Running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PATIENCE_MS = 60_000


@pytest.fixture
def console(page_rig: Running, open_shared: OpenShared) -> Iterator[Console]:
    """The page, once all three cameras stream."""
    opened = open_shared(f"http://127.0.0.1:{page_rig.port}/#/rig")
    expect(opened.page.locator(".camera .phase.good")).to_have_count(3, timeout=PATIENCE_MS)
    yield opened
    for role in Role:
        page_rig.http.delete(f"{API}/cameras/{role.value}/settings")


def camera(console: Console, name: str) -> Locator:
    return console.page.get_by_role("region", name=name, exact=True)


def exposure(console: Console, name: str) -> Locator:
    return camera(console, name).get_by_label("Exposure", exact=True)


def test_exposure_is_changed_and_read_back_as_the_camera_took_it(page_rig: Running, console: Console) -> None:
    entry = exposure(console, "Wide camera")
    expect(entry).to_have_value("7.999")
    entry.fill("5")
    entry.press("Enter")
    expect(entry).not_to_have_value("5")  # whole lines
    taken_ms = page_rig.rig.wide.settings.exposure_ns / 1e6
    assert taken_ms == pytest.approx(5.0, abs=0.002)
    expect(entry).to_have_value(f"{taken_ms:.4g}")
    console.wait_for_frames("wide")


def test_value_that_the_camera_refuses_leaves_the_old_one_and_says_the_range(
    page_rig: Running, console: Console
) -> None:
    before = page_rig.rig.wide.settings
    entry = exposure(console, "Wide camera")
    entry.fill("5000")
    entry.press("Enter")
    expect(camera(console, "Wide camera").locator(".refused:not(:empty)")).to_contain_text("0.03 to 1000 ms")
    expect(entry).to_have_value("7.999")
    assert page_rig.rig.wide.settings == before


def test_exposure_that_the_camera_sets_is_read_back_and_left_by_hand(
    page_rig: Running, console: Console
) -> None:
    wide = camera(console, "Wide camera")
    entry = exposure(console, "Wide camera")
    page_rig.http.patch(f"{API}/cameras/wide", json={"exposure_ms": 1.0})
    expect(entry).to_have_value(re.compile(r"^(1|0\.99\d)"))
    wide.get_by_label("Automatic exposure").select_option("continuous")
    expect(entry).to_have_value(re.compile(r"^([4-9]|\d\d)\b"), timeout=PATIENCE_MS)
    expect(entry).to_be_disabled()
    wide.get_by_label("Automatic exposure").select_option("off")
    expect(entry).to_be_enabled()
    assert page_rig.rig.wide.settings.exposure_auto is AutoMode.OFF


def test_foveae_that_somebody_set_apart_are_brought_together(page_rig: Running, console: Console) -> None:
    page_rig.http.patch(f"{API}/cameras/left", json={"exposure_ms": 4.0, "gain_db": 2.0})
    asked = console.page.get_by_role("alertdialog")
    expect(asked.locator("tbody tr")).to_have_count(2)
    expect(exposure(console, "Left fovea")).to_be_disabled()
    asked.get_by_role("button", name="Use left's").click()
    expect(asked).to_have_count(0)
    expect(exposure(console, "Right fovea")).to_have_value("3.999")
    left, right = page_rig.rig.left.settings, page_rig.rig.right.settings
    assert (left.exposure_ns, left.gain_db) == (right.exposure_ns, right.gain_db)


def test_camera_that_is_pulled_is_told_and_is_back_by_itself(page_rig: Running, console: Console) -> None:
    console.wait_for_frames("wide")
    wide = camera(console, "Wide camera")
    unplugged = page_rig.truth.world.faults.unplugged
    unplugged.add(Role.WIDE)
    try:
        expect(wide.locator(".phase.bad")).to_be_visible(timeout=PATIENCE_MS)
        expect(wide.locator(".link-state .reason")).not_to_be_empty()
        expect(wide.locator(".notice")).to_contain_text("No wide camera")
        expect(exposure(console, "Wide camera")).to_be_disabled()
    finally:
        unplugged.discard(Role.WIDE)
    expect(wide.locator(".phase")).to_have_text("Streaming", timeout=PATIENCE_MS)
    expect(exposure(console, "Wide camera")).to_be_enabled()
    console.wait_for_frames("wide")


def test_both_triggers_are_tested_and_found_good(console: Console) -> None:
    console.page.get_by_role("link", name="Mirrors", exact=True).click()
    trigger = camera(console, "Trigger")
    trigger.get_by_role("button", name="Test both triggers").click()
    verdicts = ["OK: hardware and software", "OK: hardware and software"]
    expect(trigger.locator(".verdicts .badge")).to_have_text(verdicts, timeout=PATIENCE_MS)


def test_what_is_broken_on_purpose_is_seen_and_mended(page_rig: Running, console: Console) -> None:
    console.page.get_by_role("link", name="Faults", exact=True).click()
    faults = camera(console, "Faults")
    world = page_rig.truth.world.faults
    faults.get_by_label("Strobe cable off: right").click()
    expect(faults.get_by_label("Strobe cable off: right")).to_be_checked()
    expect_value(console.page, lambda: world.no_strobe, {Role.RIGHT})
    faults.get_by_role("button", name="Knock both mounts").click()
    expect(faults.get_by_label("Rolled, °: left")).to_have_value(re.compile(r"^-?0\.1$"))
    knocked = world.in_force
    assert math.hypot(knocked.knocked_left.shift_x_deg, knocked.knocked_left.shift_y_deg) == pytest.approx(
        0.3, abs=0.002
    )
    entry = faults.get_by_label("Knocked down, °: right")
    entry.fill("0.5")
    entry.press("Enter")
    expect_value(console.page, lambda: world.in_force.knocked_right.shift_y_deg, 0.5)
    expect(entry).to_have_value("0.5")
    assert world.in_force.knocked_left == knocked.knocked_left
    entry.fill("9")
    entry.press("Enter")
    assert world.in_force.knocked_right.shift_y_deg == 0.5
    faults.get_by_role("button", name="Mend everything").click()
    expect(entry).to_have_value("0")
    expect(faults.get_by_label("Strobe cable off: right")).not_to_be_checked()
    assert world.in_force.words == []
