"""`foveacam bench console`: the page in a real browser beside a real server on the simulated rig.

Measures the frame rates while the 3D pane shows a cloud, the time from a click to its distance, the error of
a click's pixel, the time of a stop with twelve viewers open, and the recovery of the page after a restart of
the server. Needs Chromium and the extra `dev`.
"""

import json
import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.click_latency import click_latency_figures, textured_pixels
from foveacam_bench.stream.console_page import (
    PATIENCE_S,
    VIEWS,
    chromium,
    frames_shown,
    open_context,
    open_page,
    page_position,
    wait_until,
    wait_until_live,
)

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, FrameLocator, Page

VIEWERS = 12
TARGET_PX = (812.0, 420.0)
"""A textured point of the scene `bench`."""
_STOPS = 5
_WHEEL_STEPS = (0, 3, 5, 9)


def run(*, quick: bool = False) -> Figures:
    """Measure and return the figures; takes about three minutes."""
    with chromium() as browser, TemporaryDirectory() as folder:
        port = free_port()
        with ServerProcess(Path(folder), port=port) as server:
            with open_context(browser, scene=True) as context:
                page = open_page(context, server.url)
                figures: Figures = dict(_shown_rates(page, server, seconds=4.0 if quick else 25.0))
            with open_context(browser, scene=True) as context:
                page = open_page(context, server.url)
                figures |= click_latency_figures(page, server, textured_pixels(3 if quick else 16))
            with open_context(browser, scene=False) as context:
                figures["click_error_px"] = _click_error_px(
                    open_page(context, server.url), clicks=4 if quick else 40
                )
            server.send("DELETE", "/stop")
            with open_context(browser, scene=False) as context:
                figures["stop_ms_12_viewers"] = _stop_ms(context, server)
        with open_context(browser, scene=False) as context:
            figures["recovery_s"] = _recovery_s(context, Path(folder), port)
    return figures


def _shown_rates(page: "Page", server: ServerProcess, *, seconds: float) -> dict[str, float]:
    """Return the frame rates of the views while the 3D pane shows the cloud of a fixation."""
    server.fixate(*TARGET_PX)
    scene = page.frame_locator("#scene iframe")
    scene.locator("canvas[data-engine]").wait_for(timeout=1000 * PATIENCE_S)
    wait_until(page, lambda: server.clouds())
    _show_clouds(scene)
    wait_until_live(page)
    before, began_s = frames_shown(page), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    after, took_s = frames_shown(page), time.monotonic() - began_s
    figures = {f"shown_fps_{view}": round((after[view] - before[view]) / took_s, 2) for view in VIEWS}
    return {**figures, "cloud_points": max(int(cloud["points"]) for cloud in server.clouds())}


def _show_clouds(scene: "FrameLocator") -> None:
    """Switch the 3D pane from surfaces to point clouds, and minimise its panel again."""
    # events in place of keys, since the console takes the focus back from a frame without the pointer
    press_enter = "(box) => box.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}))"
    scene.locator("[data-dock-minimize][aria-expanded=false]").evaluate(press_enter)
    clouds = scene.locator("input[type=checkbox]").nth(1)
    clouds.wait_for(state="attached")
    clouds.evaluate("(box) => box.checked || box.click()")
    scene.locator("[data-dock-minimize][aria-expanded=true]").evaluate(press_enter)


def _click_error_px(page: "Page", *, clicks: int) -> float:
    """Return the largest difference between the clicked and the requested pixel, at several zooms."""
    page.keyboard.press("Space")  # while stopped, requests are sent and refused
    page.locator("#stopped").wait_for()
    error_px = 0.0
    for index in range(clicks):
        if index % (clicks // len(_WHEEL_STEPS)) == 0:
            page.keyboard.press("0")
            page.mouse.move(*page_position(page, 700.0, 500.0))
            for _ in range(_WHEEL_STEPS[min(len(_WHEEL_STEPS) - 1, index * len(_WHEEL_STEPS) // clicks)]):
                page.mouse.wheel(0, -120)
        side = index % 2  # too far from the last click for a double click
        x_px, y_px = 680.0 + 40.0 * side + 0.371 * index, 485.0 + 30.0 * side + 0.137 * index
        with page.expect_request("**/api/v1/fixations") as order:
            page.mouse.click(*page_position(page, x_px, y_px))
        asked = json.loads(order.value.post_data or "{}")["pixel"]
        error_px = max(error_px, abs(asked["x_px"] - x_px), abs(asked["y_px"] - y_px))
    return error_px


def _stop_ms(context: "BrowserContext", server: ServerProcess) -> float:
    """Return the longest time from the Space key to the answer, ms, while all viewers show live views."""
    pages = [context.new_page() for _ in range(VIEWERS)]
    for page in pages:
        page.goto(server.url)
    for page in pages:
        wait_until_live(page, ("wide",))
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


def _wait_for_other_server(page: "Page", boot_id: str) -> None:
    wait_until(page, lambda: page.evaluate("foveacam.bootId()") != boot_id)


def _recovery_s(context: "BrowserContext", folder: Path, port: int) -> float:
    """Return the median time from the new server's first answer to new frames on the old page."""
    taken_s = []
    with ServerProcess(folder, port=port) as server:
        page = open_page(context, server.url)
    for _ in range(2):
        boot = page.evaluate("foveacam.bootId()")
        page.locator("#offline").wait_for()
        with ServerProcess(folder, port=port):
            began_s = time.monotonic()
            _wait_for_other_server(page, boot)
            wait_until_live(page)
            taken_s.append(time.monotonic() - began_s)
    return round(statistics.median(taken_s), 2)
