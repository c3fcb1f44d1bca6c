"""A browser on the console of a real server."""

import json
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    Playwright,
    Request,
    expect,
    sync_playwright,
)
from tests.system.conftest import slow_views

CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE_S = 30.0
START_PATIENCE_S = 180.0  # where the renderer has not been compiled yet, a server does that first
expect.set_options(timeout=1000.0 * PATIENCE_S)  # two cores are shared with servers and another browser
_POLL_MS = 30
WIDE_WIDTH_PX = 1440
DESKTOP = {"width": 1440, "height": 900}
PHONE = {"width": 360, "height": 740}
TOUCH = {"viewport": PHONE, "has_touch": True, "is_mobile": True}


@dataclass(frozen=True)
class Server:
    """`foveacam serve` in a process of its own."""

    process: subprocess.Popen[bytes]
    url: str

    @property
    def port(self) -> int:
        port = httpx.URL(self.url).port
        assert port is not None
        return port

    def get(self, path: str) -> dict[str, Any]:  # Any: a JSON document
        return dict(self.send("GET", path).json())

    def send(
        self, method: str, path: str, body: object = None, *, headers: dict[str, str] | None = None
    ) -> httpx.Response:
        url = f"{self.url}api/v1{path}"
        return httpx.request(method, url, json=body, headers=headers, timeout=PATIENCE_S, trust_env=False)

    def be_idle(self) -> None:
        """Release the stop, cancel what waits or runs, and wait until nothing does."""
        self.send("DELETE", "/stop")
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            busy = [job for job in self.send("GET", "/jobs").json() if job["ended_utc"] is None]
            if not busy:
                return
            for job in busy:
                self.send("POST", f"/jobs/{job['id']}/cancel")
            time.sleep(_POLL_MS / 1000)
        raise AssertionError(f"jobs never ended: {busy}")

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(20)


StartServer = Callable[..., Server]


def greeting(process: subprocess.Popen[bytes], log: Path) -> str:
    """Return the address that the server prints once it is ready."""
    end_s = time.monotonic() + START_PATIENCE_S
    while time.monotonic() < end_s and process.poll() is None:
        if found := re.search(r"is ready: (\S+)", log.read_text()):
            return found[1]
        time.sleep(_POLL_MS / 1000)
    process.kill()
    process.wait()
    raise AssertionError(f"the server did not start: {log.read_text()}")


@contextmanager
def servers(data: Path) -> Iterator[StartServer]:
    """Start servers that end with the context."""
    started: list[Server] = []
    with ExitStack() as stack:

        def start(*arguments: str) -> Server:
            log = data.with_suffix(f".{len(started)}.log")
            command = [sys.executable, "-m", "foveacam_server", "serve", "--port", "0", "--data", str(data)]
            with log.open("w") as output:
                process = subprocess.Popen(
                    [*command, *arguments], stdout=output, stderr=subprocess.STDOUT, env=slow_views()
                )
            server = Server(process, greeting(process, log))
            started.append(server)
            stack.callback(server.end)
            return server

        yield start


@dataclass
class Console:
    """The page in a browser, and what went wrong in it."""

    page: Page
    errors: list[str] = field(default_factory=list)

    def until(self, expression: str, *, within_s: float = PATIENCE_S) -> None:
        """Wait until the expression holds. The page forbids eval, which Playwright's own wait needs."""
        end_s = time.monotonic() + within_s
        while time.monotonic() < end_s:
            if self.page.evaluate(expression):
                return
            self.page.wait_for_timeout(_POLL_MS)
        raise AssertionError(f"within {within_s} s the page never had: {expression}")

    def until_live(self, *views: str) -> None:
        """Wait until each of the views has shown a new frame from now on."""
        before = self.frames()
        for view in views:
            self.until(f"(foveacam.frames()['{view}'] ?? 0) > {before.get(view, 0)}")

    def frames(self) -> dict[str, int]:
        return dict(self.page.evaluate("window.foveacam ? foveacam.frames() : {}"))

    def place(self, x_px: float, y_px: float) -> tuple[float, float]:
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
        box = self.page.evaluate(
            "(() => { const box = document.querySelector('.pane-wide .picture').getBoundingClientRect();"
            " return [box.left, box.top, box.width]; })()"
        )
        return float(box[0]), float(box[1]), float(box[2])

    def click(self, x_px: float, y_px: float) -> Request:
        """Click on the wide pixel; return the order that the page sent."""
        with self.page.expect_request(is_fixation) as order:
            self.page.mouse.click(*self.place(x_px, y_px))
        return order.value

    def fixate(self, x_px: float, y_px: float) -> None:
        """Click on the wide pixel and wait for the outcome."""
        self.click(x_px, y_px)
        self.page.locator("#fixation .state.running").wait_for()
        self.page.locator("#fixation .numbers").wait_for()

    def until_steered(self, server: Server, ax_deg: float, ay_deg: float) -> None:
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
            self.page.wait_for_timeout(_POLL_MS)
        raise AssertionError(f"the eyes never looked at {ax_deg}, {ay_deg}: {mirrors}")

    def overflow_px(self) -> float:
        """Return by how much the page is wider than its window."""
        return float(self.page.evaluate("document.documentElement.scrollWidth - innerWidth"))


def is_fixation(request: Request) -> bool:
    return request.method == "POST" and request.url.endswith("/api/v1/fixations")


def posted(request: Request) -> dict[str, Any]:  # Any: a JSON document
    assert request.post_data is not None
    return dict(json.loads(request.post_data))


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    if not CHROMIUM.exists():
        pytest.fail(
            "Chromium is missing: run tests/system/install-chromium.sh, or leave these out: -m 'not browser'"
        )
    with sync_playwright() as found:
        yield found


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    found = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
    yield found
    found.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server on the simulated rig that the tests of one module share."""
    with servers(tmp_path_factory.mktemp("data")) as start:
        yield start()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[StartServer]:
    """Start servers of one's own, one after the other on the same data."""
    with servers(tmp_path / "data") as start:
        yield start


OpenConsole = Callable[..., Console]


@pytest.fixture
def open_console(browser: Browser) -> Iterator[OpenConsole]:
    """Open the page in a profile of its own; it must end without an error in the browser's console."""
    with ExitStack() as stack:
        opened: list[Console] = []

        def open_(
            url: str,
            *,
            settings: dict[str, Any] | None = None,  # Any: as the page keeps them
            options: dict[str, Any] | None = None,  # Any: Playwright's
        ) -> Console:
            context = stack.enter_context(
                contexts(browser, {"scene": False, **(settings or {})}, options or {})
            )
            console = watched(context.new_page())
            console.page.goto(url)
            opened.append(console)
            return console

        yield open_
        assert [error for console in opened for error in console.errors] == []


@contextmanager
def contexts(browser: Browser, settings: dict[str, Any], options: dict[str, Any]) -> Iterator[BrowserContext]:
    """Open a browser profile in which the page finds these settings."""
    context = browser.new_context(**{"viewport": DESKTOP, **options})
    kept = json.dumps(json.dumps(settings))
    context.add_init_script(
        f"localStorage.getItem('foveacam.settings') ?? localStorage.setItem('foveacam.settings', {kept})"
    )
    yield context
    context.close()


def watched(page: Page) -> Console:
    """Return the page with its errors collected; an answer of the server that says no is not one."""
    console = Console(page)

    def hear(message: ConsoleMessage) -> None:
        refused = message.text.startswith("Failed to load resource: the server responded with a status of 4")
        if message.type == "error" and not refused:
            console.errors.append(message.text)

    page.on("console", hear)
    page.on("pageerror", lambda error: console.errors.append(str(error)))
    return console
