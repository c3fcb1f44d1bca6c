"""The console in a browser, as a person finds it: what is on the page, and clicks on the wide view."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import (
    Browser,
    BrowserContext,
    CDPSession,
    ConsoleMessage,
    Error,
    Page,
    Request,
    ViewportSize,
    expect,
)

from foveacam_bench.stream.console_page import CHROMIUM
from tests.support.pages.awaited import POLL_MS, settled, wait_for
from tests.support.servers.server_process import PATIENCE_S, Server

PATIENCE_MS = 1000.0 * PATIENCE_S
expect.set_options(timeout=PATIENCE_MS)
_HEADLESS_SHELL = Path("/usr/bin/chromium-headless-shell")
BROWSER = _HEADLESS_SHELL if _HEADLESS_SHELL.exists() else CHROMIUM
"""Chromium; where it is installed, without windows around the page, at three quarters of the time."""
FIXATION_PATIENCE_MS = 1.5 * PATIENCE_MS
"""A fixation renders and matches several pictures beside the live views: it is more than one request."""
WIDE_WIDTH_PX = 1440
DESKTOP: ViewportSize = {"width": 1440, "height": 900}
PHONE: ViewportSize = {"width": 360, "height": 740}
NO_STORAGE = "Object.defineProperty(window, 'localStorage', { get() { throw new DOMException('off'); } })"
CHANGEABLE = {"viewport", "color_scheme"}
"""Options of a browser profile that a tab can change."""
PLAIN = {"scene": False, "hints": False}
"""Settings of a page without its dearest part, and without what goes away by itself."""
LEAVE = """() => {
  for (const dialog of document.querySelectorAll("dialog[open]")) dialog.close();
  for (const button of document.querySelectorAll(".toast [aria-label=Dismiss]")) button.click();
  document.activeElement?.blur();
  window.scrollTo(0, 0);
  location.hash = "#/";
}"""
EMPTY = "/favicon.ico"
"""A page of a server on which nothing runs."""
IDLE_TABS = 2
"""A tab at each of the servers that the tests of a file take turns with."""
TOUCH = {"viewport": PHONE, "has_touch": True, "is_mobile": True}


@dataclass
class Console:
    """The page in a browser, and what went wrong in it."""

    page: Page
    errors: list[str] = field(default_factory=list)

    def wait_until(self, expression: str) -> None:
        """Wait until the expression holds. The page forbids eval, which Playwright's own wait needs."""
        wait_for(self.page, lambda: bool(self.page.evaluate(expression)), f"the page never had: {expression}")

    def load(self, url: str) -> None:
        """Load a page, and wait for the console's panels, which come after its first picture."""
        self.page.goto(url)
        self.wait_until("!document.getElementById('console') || Boolean(window.foveacam)")

    def wait_for_frames(self, *views: str) -> None:
        """Wait until each of the views has shown a new frame from now on."""
        before = self.frames()
        for view in views:
            self.wait_until(f"(window.foveacam?.frames()['{view}'] ?? 0) > {before.get(view, 0)}")

    def frames(self) -> dict[str, int]:
        return dict(self.page.evaluate("window.foveacam ? foveacam.frames() : {}"))

    def page_position(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return where the wide pixel is on the page, from the canvas' box alone, CSS px."""
        left, top, width = self.wide_box()
        scale = width / WIDE_WIDTH_PX
        return left + (x_px + 0.5) * scale, top + (y_px + 0.5) * scale

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return which wide pixel is at a place of the page, from the canvas' box alone."""
        left, top, width = self.wide_box()
        scale = width / WIDE_WIDTH_PX
        return (x - left) / scale - 0.5, (y - top) / scale - 0.5

    def wide_box(self) -> tuple[float, float, float]:
        """Return left, top and width of the wide picture once it stays where it is, CSS px."""
        box = settled(
            self.page,
            lambda: self.page.evaluate(
                "(() => { const box = document.querySelector('.pane-wide .picture').getBoundingClientRect();"
                " return [box.left, box.top, box.width]; })()"
            ),
        )
        return float(box[0]), float(box[1]), float(box[2])

    def click(self, x_px: float, y_px: float) -> Request:
        """Click on the wide pixel; return the order that the page sent."""
        with self.page.expect_request(is_fixation) as order:
            self.page.mouse.click(*self.page_position(x_px, y_px))
        return order.value

    def fixate(self, x_px: float, y_px: float) -> None:
        """Click on the wide pixel and wait for the outcome of that click, whatever the page showed before."""
        answer = self.click(x_px, y_px).response()
        assert answer is not None
        outcome = self.page.locator(f'#fixation[data-job="{answer.json()["id"]}"] .numbers')
        expect(outcome).to_be_attached(timeout=FIXATION_PATIENCE_MS)

    def wait_until_steered(self, server: Server, ax_deg: float, ay_deg: float) -> None:
        """Wait until both eyes look in this direction, within two wide pixels."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            mirrors = server.get("/mirrors")
            off_deg = [
                abs(mirrors[eye][axis] - wanted)
                for eye in ("left", "right")
                for axis, wanted in (("ax_deg", ax_deg), ("ay_deg", ay_deg))
            ]
            if max(off_deg) < 0.036:
                return
            self.page.wait_for_timeout(POLL_MS)
        raise AssertionError(f"the eyes never looked at {ax_deg}, {ay_deg}: {mirrors}")


OpenConsole = Callable[..., Console]
OpenShared = Callable[[str], Console]
OpenWizard = Callable[..., Console]


def is_fixation(request: Request) -> bool:
    return request.method == "POST" and request.url.endswith("/api/v1/fixations")


def posted(request: Request) -> dict[str, Any]:  # Any: a JSON document
    assert request.post_data is not None
    return dict(json.loads(request.post_data))


@dataclass
class Tabs:
    """Browser profiles of the tests, one for each server and each set of options that a tab cannot change.

    A profile costs four times what loading the page costs, so that the next test gets it again: with an empty
    page, nothing stored and nothing routed. The empty page is one of the same server: a page with an opener
    policy gets a new process after any other page, which costs half as much again as to load it.
    """

    browser: Browser
    stack: ExitStack
    idle: dict[str, list[Console]] = field(default_factory=dict)
    sessions: dict[Page, CDPSession] = field(default_factory=dict)

    def open_tab(self, url: str, settings: dict[str, Any], options: dict[str, Any]) -> tuple[str, Console]:
        """Return an empty tab with these settings and options, and the name to give it back under."""
        fixed = {} if options.keys() <= CHANGEABLE else options
        name = json.dumps(fixed, sort_keys=True)
        console = self._idle_tab(name, _origin(url)) or self._new_tab(fixed)
        page = console.page
        if not fixed:
            page.set_viewport_size(options["viewport"])
        page.emulate_media(color_scheme=options.get("color_scheme", "light"), reduced_motion="reduce")
        session = self.sessions[page] = page.context.new_cdp_session(page)
        session.send("Page.enable")
        session.send("Page.addScriptToEvaluateOnNewDocument", {"source": keep_settings(settings)})
        return name, console

    def _idle_tab(self, name: str, origin: str) -> Console | None:
        """Return the tab that waits at a server; where there are enough tabs, another one."""
        waiting = self.idle.setdefault(name, [])
        for console in waiting:
            if _origin(console.page.url) == origin:
                waiting.remove(console)
                return console
        return waiting.pop(0) if len(waiting) >= IDLE_TABS else None

    def _new_tab(self, options: dict[str, Any]) -> Console:
        context = self.browser.new_context(**options)
        context.set_default_timeout(PATIENCE_MS)
        self.stack.callback(context.close)
        return console_of(context.new_page())

    def release_tab(self, name: str, console: Console) -> None:
        """Leave no trace of a test."""
        page = console.page
        origin = _origin(page.url)
        page.unroute_all()
        session = self.sessions.pop(page)
        try:
            page.goto(origin + EMPTY)
        except Error:  # its server has ended
            page.context.close()
            return
        session.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
        session.detach()  # which takes the script with the settings along
        page.context.clear_cookies()
        for other in page.context.pages:
            if other is not page:
                other.close()
        console.errors.clear()
        self.idle[name].append(console)


@dataclass
class SharedPages:
    """Pages that the tests of a file take turns with: each is loaded once."""

    tabs: Tabs
    opened: dict[str, tuple[str, Console]] = field(default_factory=dict)

    def open(self, url: str) -> Console:
        """Load the page at an address, or return it as the test before left it, without its messages."""
        base, _, part = url.partition("#")
        if base not in self.opened:
            self.opened[base] = _, console = self.tabs.open_tab(url, PLAIN, {"viewport": DESKTOP})
            console.load(url)
            return console
        console = self.opened[base][1]
        console.page.set_viewport_size(DESKTOP)
        console.page.evaluate(LEAVE)
        if part:
            console.page.evaluate("part => { location.hash = part }", part)
        return console

    def take_errors(self) -> list[str]:
        """Return what went wrong in the pages since this was asked before."""
        errors = [error for _, console in self.opened.values() for error in console.errors]
        for _, console in self.opened.values():
            console.errors.clear()
        return errors

    def release(self) -> None:
        for name, console in self.opened.values():
            self.tabs.release_tab(name, console)


def _origin(url: str) -> str:
    """Return scheme, host and port of an address."""
    parts = urlsplit(url)
    return f"{parts.scheme}://{parts.netloc}"


def keep_settings(settings: dict[str, Any]) -> str:
    """Return the script that lets the page find these settings unless it has kept others."""
    kept = json.dumps(json.dumps(settings))
    return f"localStorage.getItem('foveacam.settings') ?? localStorage.setItem('foveacam.settings', {kept})"


@contextmanager
def contexts(browser: Browser, settings: dict[str, Any], options: dict[str, Any]) -> Iterator[BrowserContext]:
    """Open a browser profile in which the page finds these settings."""
    context = browser.new_context(**options)
    context.set_default_timeout(PATIENCE_MS)
    context.add_init_script(keep_settings(settings))
    yield context
    context.close()


def console_of(page: Page) -> Console:
    """Return the page with its errors collected; an answer of the server that says no is not one."""
    console = Console(page)

    def collect(message: ConsoleMessage) -> None:
        refused = message.text.startswith("Failed to load resource: the server responded with a status of 4")
        if message.type == "error" and not refused:
            console.errors.append(message.text)

    page.on("console", collect)
    page.on("pageerror", lambda error: console.errors.append(str(error)))
    return console
