"""The resolution beside the views, the working binning of the rig's page, and a look at full resolution."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.support.pages.console_page import Console, OpenShared
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

TEXTURED_PX = (812.0, 420.0)  # the poster of the scene "bench"
PATIENCE_MS = 60_000


@pytest.fixture
def console(open_shared: OpenShared, page_server: Server) -> Iterator[Console]:
    """The console on a rig that works at binning 1, as it does again afterwards."""
    page_server.be_idle()
    before = page_server.get("/rig/binning")["working_binning"]
    page_server.send("PUT", "/rig/binning", {"working_binning": 1}).raise_for_status()
    found = open_shared(page_server.url)
    found.wait_for_frames("wide")
    yield found
    page_server.send("PUT", "/rig/binning", {"working_binning": before}).raise_for_status()


def test_a_binned_rig_says_its_resolution_and_offers_one_look_with_every_pixel(
    console: Console, page_server: Server
) -> None:
    page = console.page
    views = {name: page.locator(f".pane-{name} .resolution") for name in ("wide", "left")}
    expect(views["wide"]).to_have_text("55 px/°", timeout=PATIENCE_MS)
    expect(views["wide"]).to_have_attribute("title", "Every pixel of the sensor: 1440×1080")

    page.evaluate("location.hash = '#/rig'")
    panel = page.get_by_role("region", name="Working binning")
    panel.get_by_role("button", name="2×2").click()
    expect(panel.get_by_role("button", name="2×2")).to_have_attribute("aria-pressed", "true")
    expect(panel).to_contain_text("2×2 pixels as one: 720×540 of 1440×1080")
    expect(panel.locator("[data-role=switch]")).to_have_text(re.compile(r"^Switching took .*0\.\d\d s\.$"))

    page.evaluate("location.hash = ''")
    expect(views["wide"]).to_have_text("28 px/°", timeout=PATIENCE_MS)
    expect(views["left"]).to_have_text(re.compile(r"^25\d px/°$"), timeout=PATIENCE_MS)
    expect(views["wide"]).to_have_attribute("title", "2×2 pixels are one: 720×540 of 1440×1080")
    console.fixate(*TEXTURED_PX)
    note = page.locator("#fixation .note")
    expect(note).to_contain_text("of a look at 720×540", timeout=PATIENCE_MS)
    page.get_by_role("button", name="Full resolution").click()
    expect(note).to_contain_text("of a look at 1440×1080", timeout=PATIENCE_MS)
    expect(page.get_by_role("button", name="Full resolution")).to_have_count(0)
    assert page_server.get("/rig/binning")["working_binning"] == 2
