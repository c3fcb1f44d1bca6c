"""No page has a serious finding of axe-core: light, dark, and on a phone."""

import re
from typing import Literal

import pytest
from playwright.sync_api import Page, ViewportSize, expect

from tests.support.pages.accessibility import serious_findings
from tests.support.pages.console_page import DESKTOP, PHONE, OpenConsole, OpenShared
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

Look = Literal["light", "dark", "phone"]
ColorScheme = Literal["light", "dark"]
LOOKS: dict[Look, tuple[ViewportSize, ColorScheme]] = {
    "light": (DESKTOP, "light"),
    "dark": (DESKTOP, "dark"),
    "phone": (PHONE, "light"),
}
PAGES = {
    "#/": "#console",
    "#/capture": "#capture-page",
    "#/gallery": "#gallery",
    "#/gallery/recordings": "#gallery",
    "#/gallery/stills": "#gallery",
    "#/calibration": "#calibration",
    "#/calibration/wide": "#calibration",
    "#/calibration/mirrors": "#calibration",
    "#/calibration/fit": "#calibration",
    "#/rig": "#rig-page",
    "#/rig/mirrors": "#rig-page",
    "#/rig/positioners": "#rig-page",
    "#/rig/faults": "#rig-page",
    "#/follow": "#follow-page",
    "#/loop": "#loop-page",
    "#/compare": "#compare-page",
    "#/planner": "#planner",
    "#/setup": "#setup-page",
    "#/acceptance": "#acceptance-page",
    "#/rigs": "#rigs-page",
    "#/engine": "#engine-page",
    "#/people": "#people-page",
    "#/settings": "#settings-page",
}
DOCUMENTS = ("view", "windows", "replay", "display", "docs", "guide/looking", "guide/calibrating")


def dress(page: Page, look: Look) -> None:
    size, scheme = LOOKS[look]
    page.set_viewport_size(size)
    page.emulate_media(color_scheme=scheme)


@pytest.mark.parametrize("look", LOOKS)
def test_no_page_of_the_console_has_a_serious_finding(
    page_server: Server, open_console: OpenConsole, look: Look
) -> None:
    console = open_console(page_server.url)
    dress(console.page, look)
    if look == "light":
        console.fixate(720, 540)
    for address, place in PAGES.items():
        console.page.evaluate("address => { location.hash = address }", address)
        shown = console.page.locator(place)
        expect(shown).to_be_visible()
        expect(shown.locator("waiting-note")).to_have_count(0)
        assert serious_findings(console.page) == [], address


@pytest.mark.parametrize("look", LOOKS)
def test_no_document_beside_the_console_has_a_serious_finding(
    page_server: Server, open_shared: OpenShared, look: Look
) -> None:
    page = open_shared(page_server.url).page
    dress(page, look)
    try:
        for path in DOCUMENTS:
            page.goto(page_server.url + path)
            expect(page.locator("body")).to_have_text(re.compile(r"\S"))
            assert serious_findings(page) == [], path
    finally:
        page.goto(page_server.url)


def test_the_check_finds_what_is_wrong(page_server: Server, open_console: OpenConsole) -> None:
    page = open_console(page_server.url).page
    page.evaluate("""() => {
      const pale = Object.assign(document.createElement("p"), { textContent: "pale", style: "color:#ccc" });
      document.querySelector("main, #console").prepend(pale, document.createElement("button"));
    }""")
    found = serious_findings(page)
    assert any(line.startswith("color-contrast") for line in found)
    assert any(line.startswith("button-name") for line in found)
