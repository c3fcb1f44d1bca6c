"""The console in headless Chromium: starts browser, profile and page, and waits for its contents."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from foveacam_hardware.contract import NotConnected, Timeout, install_command

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

CHROMIUM = Path("/usr/bin/chromium")
CHROMIUM_ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
VIEWS = ("wide", "left", "right")
WIDE_WIDTH_PX = 1440
PATIENCE_S = 60.0
_POLL_MS = 20


@contextmanager
def chromium() -> "Iterator[Browser]":
    """Run headless Chromium; raise `NotConnected` where it or Playwright is missing."""
    try:
        from playwright.sync_api import sync_playwright  # of the extra `dev`
    except ImportError as error:
        raise NotConnected(
            "the bench 'console' drives a browser by Playwright, which is not installed here",
            asked="playwright",
            found="nothing",
            remedy=f"install the extra: {install_command('dev')}",
        ) from error
    if not CHROMIUM.exists():
        raise NotConnected(
            f"the bench 'console' needs Chromium at {CHROMIUM}",
            asked=str(CHROMIUM),
            found="nothing",
            remedy="run tests/system/install-chromium.sh",
        )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(CHROMIUM_ARGUMENTS))
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def open_context(browser: "Browser", *, scene: bool) -> "Iterator[BrowserContext]":
    """Open a browser profile; `scene`: whether its pages show the 3D pane."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    settings = json.dumps(json.dumps({"scene": scene}))
    context.add_init_script(f"localStorage.setItem('foveacam.settings', {settings})")
    try:
        yield context
    finally:
        context.close()


def open_page(context: "BrowserContext", url: str) -> "Page":
    """Open the console and wait until all views show frames."""
    page = context.new_page()
    page.goto(url)
    wait_until_live(page)
    return page


def wait_until_live(page: "Page", views: tuple[str, ...] = VIEWS) -> None:
    """Wait until each view has shown a new frame."""
    before = frames_shown(page)
    wait_until(page, lambda: all(frames_shown(page).get(view, 0) > before.get(view, 0) for view in views))


def frames_shown(page: "Page") -> dict[str, int]:
    """Return the number of drawn frames by view; empty before the page has started."""
    return dict(page.evaluate("window.foveacam ? foveacam.frames() : {}"))


def wait_until(page: "Page", holds: Callable[[], object]) -> None:
    """Wait until `holds` returns something true; raise `Timeout` after `PATIENCE_S`."""
    end_s = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > end_s:
            raise Timeout(
                f"the page did not get so far within {PATIENCE_S:.0f} s; is the machine overloaded?"
            )
        page.wait_for_timeout(_POLL_MS)


def page_position(page: "Page", x_px: float, y_px: float) -> tuple[float, float]:
    """Return the position of a wide pixel on the page, CSS px, from the drawn canvas' box alone."""
    left, top, width = page.evaluate(
        "(() => { const box = document.querySelector('.pane-wide .picture').getBoundingClientRect();"
        " return [box.left, box.top, box.width]; })()"
    )
    scale = width / WIDE_WIDTH_PX
    return left + (x_px + 0.5) * scale, top + (y_px + 0.5) * scale
