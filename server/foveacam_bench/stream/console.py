"""`foveacam bench console`: the page in a real browser beside a real server on the simulated rig.

Frames shown while the 3D pane shows a cloud, where a scripted click lands, how soon the stop answers with
twelve viewers open, how soon the page is back after the server was. Needs Chromium and the extra `dev`.
"""

import json
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from foveacam_bench.servers import ServerProcess, free_port
from foveacam_hardware.contract import NotConnected, Timeout, install_command

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, FrameLocator, Page

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
VIEWERS = 12
TARGET_PX = (812.0, 420.0)
"""A textured place of the scene `bench`."""
WIDE_WIDTH_PX = 1440
_PATIENCE_S = 60.0
_POLL_MS = 20
_STOPS = 5
_WHEEL_STEPS = (0, 3, 5, 9)


def run(*, quick: bool = False) -> dict[str, float]:
    """Measure and return the figures; about two minutes, quick about one."""
    with _browser() as browser, TemporaryDirectory() as folder:
        port = free_port()
        with ServerProcess(Path(folder), port=port) as server:
            with _context(browser, scene=True) as context:
                figures = _shown_rates(_open(context, server.url), server, seconds=8.0 if quick else 25.0)
            with _context(browser, scene=False) as context:
                figures["click_error_px"] = _click_error_px(
                    _open(context, server.url), clicks=8 if quick else 40
                )
            server.send("DELETE", "/stop")
            with _context(browser, scene=False) as context:
                figures["stop_ms_12_viewers"] = _stop_ms(context, server)
        with _context(browser, scene=False) as context:
            figures["recovery_s"] = _recovery_s(context, Path(folder), port)
    return figures


@contextmanager
def _browser() -> "Iterator[Browser]":
    try:
        from playwright.sync_api import sync_playwright  # of the extra `dev`: a server does without it
    except ImportError as error:
        raise NotConnected(
            "the bench 'console' drives a browser by Playwright, which is not installed here; "
            f"install the extra: {install_command('dev')}",
            asked="playwright",
            found="nothing",
            remedy=install_command("dev"),
        ) from error
    if not CHROMIUM.exists():
        raise NotConnected(
            f"the bench 'console' needs Chromium at {CHROMIUM}; run tests/system/install-chromium.sh",
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
def _context(browser: "Browser", *, scene: bool) -> "Iterator[BrowserContext]":
    """Open a browser profile whose pages have the 3D pane or not."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    settings = json.dumps(json.dumps({"scene": scene}))
    context.add_init_script(f"localStorage.setItem('foveacam.settings', {settings})")
    try:
        yield context
    finally:
        context.close()


def _open(context: "BrowserContext", url: str) -> "Page":
    page = context.new_page()
    page.goto(url)
    _until_live(page)
    return page


def _until_live(page: "Page", views: tuple[str, ...] = VIEWS) -> None:
    """Wait until each view has shown a frame from now on."""
    before = _frames(page)
    _until(page, lambda: all(_frames(page).get(view, 0) > before.get(view, 0) for view in views))


def _frames(page: "Page") -> dict[str, int]:
    return dict(page.evaluate("window.foveacam ? foveacam.frames() : {}"))


def _until_other_server(page: "Page", boot_id: str) -> None:
    _until(page, lambda: page.evaluate("foveacam.bootId()") != boot_id)


def _until(page: "Page", holds: Callable[[], object]) -> None:
    end_s = time.monotonic() + _PATIENCE_S
    while not holds():
        if time.monotonic() > end_s:
            raise Timeout(
                f"the page did not get so far within {_PATIENCE_S:.0f} s; is the machine overloaded?"
            )
        page.wait_for_timeout(_POLL_MS)


def _shown_rates(page: "Page", server: ServerProcess, *, seconds: float) -> dict[str, float]:
    """Return the frames shown a second while the 3D pane shows the cloud of a fixation."""
    server.fixate(*TARGET_PX)
    scene = page.frame_locator("#scene iframe")
    scene.locator("canvas[data-engine]").wait_for(timeout=1000 * _PATIENCE_S)
    _until(page, lambda: server.clouds())
    _show_clouds(scene)
    _until_live(page)
    before, began_s = _frames(page), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    after, took_s = _frames(page), time.monotonic() - began_s
    figures = {f"shown_fps_{view}": round((after[view] - before[view]) / took_s, 2) for view in VIEWS}
    return {**figures, "cloud_points": max(int(cloud["points"]) for cloud in server.clouds())}


def _show_clouds(scene: "FrameLocator") -> None:
    """Tick "Point clouds" in the 3D pane, which shows surfaces at first; its panel is folded away again."""
    # By events, not keys: the console takes the focus back from a frame that nobody pointed at
    press_enter = "(box) => box.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}))"
    scene.locator("[data-dock-minimize][aria-expanded=false]").evaluate(press_enter)
    clouds = scene.locator("input[type=checkbox]").nth(1)
    clouds.wait_for(state="attached")
    clouds.evaluate("(box) => box.checked || box.click()")
    scene.locator("[data-dock-minimize][aria-expanded=true]").evaluate(press_enter)


def _click_error_px(page: "Page", *, clicks: int) -> float:
    """Return the largest distance between the pixel meant and the one asked for, at several zooms."""
    page.keyboard.press("Space")  # stopped: the orders are sent and refused, nothing moves
    page.locator("#stopped").wait_for()
    error_px = 0.0
    for index in range(clicks):
        if index % (clicks // len(_WHEEL_STEPS)) == 0:
            page.keyboard.press("0")
            page.mouse.move(*_place(page, 700.0, 500.0))
            for _ in range(_WHEEL_STEPS[min(len(_WHEEL_STEPS) - 1, index * len(_WHEEL_STEPS) // clicks)]):
                page.mouse.wheel(0, -120)
        side = index % 2  # far enough from the click before not to be its double
        x_px, y_px = 680.0 + 40.0 * side + 0.371 * index, 485.0 + 30.0 * side + 0.137 * index
        with page.expect_request("**/api/v1/fixations") as order:
            page.mouse.click(*_place(page, x_px, y_px))
        asked = json.loads(order.value.post_data or "{}")["pixel"]
        error_px = max(error_px, abs(asked["x_px"] - x_px), abs(asked["y_px"] - y_px))
    return error_px


def _place(page: "Page", x_px: float, y_px: float) -> tuple[float, float]:
    """Return where a wide pixel is on the page, CSS px, from the drawn canvas' box alone."""
    left, top, width = page.evaluate(
        "(() => { const box = document.querySelector('.pane-wide .picture').getBoundingClientRect();"
        " return [box.left, box.top, box.width]; })()"
    )
    scale = width / WIDE_WIDTH_PX
    return left + (x_px + 0.5) * scale, top + (y_px + 0.5) * scale


def _stop_ms(context: "BrowserContext", server: ServerProcess) -> float:
    """Return the slowest answer to the Space key, ms, while all viewers show live views."""
    pages = [context.new_page() for _ in range(VIEWERS)]
    for page in pages:
        page.goto(server.url)
    for page in pages:
        _until_live(page, ("wide",))
    slowest_ms = 0.0
    for page in pages[:_STOPS]:
        began_s = time.monotonic()
        with page.expect_response(
            lambda answer: answer.url.endswith("/stop") and answer.request.method == "POST"
        ):
            page.keyboard.press("Space")
        slowest_ms = max(slowest_ms, 1e3 * (time.monotonic() - began_s))
        server.send("DELETE", "/stop")
    return round(slowest_ms, 1)


def _recovery_s(context: "BrowserContext", folder: Path, port: int) -> float:
    """Return the median time from the new server's first answer to new frames on the old page."""
    taken_s = []
    with ServerProcess(folder, port=port) as server:
        page = _open(context, server.url)
    for _ in range(2):
        boot = page.evaluate("foveacam.bootId()")
        page.locator("#offline").wait_for()
        with ServerProcess(folder, port=port):
            began_s = time.monotonic()
            _until_other_server(page, boot)
            _until_live(page)
            taken_s.append(time.monotonic() - began_s)
    return round(statistics.median(taken_s), 2)
