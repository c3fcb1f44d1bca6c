"""The pages of the console and the documents beside it, and the looks in which each is checked."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from foveacam_bench.stream.console_page import PATIENCE_S, wait_until, wait_until_live

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

LookName = Literal["light", "dark", "phone"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PageLook:
    """Size of the window, CSS px, and colours."""

    width: int
    height: int
    color_scheme: Literal["light", "dark"]


LOOKS: Mapping[LookName, PageLook] = {
    "light": PageLook(width=1440, height=900, color_scheme="light"),
    "dark": PageLook(width=1440, height=900, color_scheme="dark"),
    "phone": PageLook(width=360, height=740, color_scheme="light"),
}
CONSOLE_PAGES: Mapping[str, str] = {
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
"""The address of each page, and the element that holds it."""
DOCUMENTS = ("view", "windows", "replay", "display", "docs", "guide/looking", "guide/calibrating")
"""Paths of pages that are documents of their own."""


def apply_look(page: "Page", name: LookName) -> None:
    """Set the size of the window and the colours."""
    look = LOOKS[name]
    page.set_viewport_size({"width": look.width, "height": look.height})
    page.emulate_media(color_scheme=look.color_scheme)


def open_sized_page(context: "BrowserContext", url: str, *, width: int, height: int) -> "Page":
    """Open the console in a window of this size, CSS px, and wait until the wide view shows frames."""
    page = context.new_page()
    page.set_viewport_size({"width": width, "height": height})
    page.goto(url)
    wait_until_live(page, ("wide",))
    wait_until(page, lambda: page.evaluate("Boolean(window.foveacam)"))
    return page


def show_console_page(page: "Page", address: str) -> None:
    """Go to a page of the console and wait until nothing in it is loading."""
    place = CONSOLE_PAGES[address]
    go_to(page, address)
    page.locator(place).wait_for(timeout=1e3 * PATIENCE_S)
    wait_until(page, lambda: page.locator(f"{place} waiting-note").count() == 0)


def show_document(page: "Page", url: str) -> None:
    """Load a document and wait until it has text."""
    page.goto(url, timeout=1e3 * PATIENCE_S)
    wait_until(page, lambda: re.search(r"\S", page.locator("body").inner_text()))


def go_to(page: "Page", address: str) -> None:
    """Change the part of the address that names a page of the console."""
    page.evaluate("address => { location.hash = address }", address)
