"""How fast the page answers beside a real server on the simulated rig.

Frame rates while the 3D pane shows a cloud, the time from a click to its distance, the error of a click's
pixel, the time of a stop with twelve viewers open, and the recovery of the page after a restart.
"""

import json
import statistics
import time
from pathlib import Path
from typing import TYPE_CHECKING

from foveacam_bench.console.scene_panel import open_scene, set_shown
from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess
from foveacam_bench.stream.click_latency import click_latency_figures, textured_pixels
from foveacam_bench.stream.console_page import (
    VIEWS,
    frames_shown,
    open_context,
    open_page,
    page_position,
    wait_until,
    wait_until_live,
)

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

VIEWERS = 12
TARGET_PX = (812.0, 420.0)
"""A textured point of the scene `bench`."""
RATE_S, QUICK_RATE_S = 25.0, 2.0
CLICKS, QUICK_CLICKS = 16, 1
ERROR_CLICKS, QUICK_ERROR_CLICKS = 40, 4
RESTARTS, QUICK_RESTARTS = 2, 1
_STOPS = 5
_WHEEL_STEPS = (0, 3, 5, 9)


def live_figures(browser: "Browser", server: ServerProcess, *, quick: bool) -> Figures:
    """Return the frame rates beside a cloud, and the times of clicks."""
    with open_context(browser, scene=True) as context:
        page = open_page(context, server.url)
        rates = _shown_rates(page, server, seconds=QUICK_RATE_S if quick else RATE_S)
    with open_context(browser, scene=True) as context:
        page = open_page(context, server.url)
        pixels = textured_pixels(QUICK_CLICKS if quick else CLICKS)
        return {**rates, **click_latency_figures(page, server, pixels)}


def stopped_figures(browser: "Browser", server: ServerProcess, *, quick: bool) -> Figures:
    """Return the error of clicks while stopped, and the time of a stop with twelve viewers."""
    with open_context(browser, scene=False) as context:
        page = open_page(context, server.url)
        error_px = _click_error_px(page, clicks=QUICK_ERROR_CLICKS if quick else ERROR_CLICKS)
    server.send("DELETE", "/stop")
    with open_context(browser, scene=False) as context:
        return {"click_error_px": error_px, "stop_ms_12_viewers": _stop_ms(context, server)}


def recovery_figures(page: "Page", folder: Path, *, port: int, quick: bool) -> Figures:
    """Return the median time from a restarted server's first answer to new frames on a page of the old one.

    `folder`, `port`: of the server, which has ended.
    """
    taken_s = [_recovery_s(page, folder, port=port) for _ in range(QUICK_RESTARTS if quick else RESTARTS)]
    return {"recovery_s": round(statistics.median(taken_s), 2)}


def _shown_rates(page: "Page", server: ServerProcess, *, seconds: float) -> dict[str, float]:
    """Return the frame rates of the views while the 3D pane shows the cloud of a fixation."""
    server.fixate(*TARGET_PX)
    scene = open_scene(page)
    wait_until(page, lambda: server.clouds())
    set_shown(scene, "Point clouds", shown=True)
    wait_until_live(page)
    before, began_s = frames_shown(page), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    after, took_s = frames_shown(page), time.monotonic() - began_s
    figures = {f"shown_fps_{view}": round((after[view] - before[view]) / took_s, 2) for view in VIEWS}
    return {**figures, "cloud_points": max(int(cloud["points"]) for cloud in server.clouds())}


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


def _recovery_s(page: "Page", folder: Path, *, port: int) -> float:
    boot = page.evaluate("foveacam.bootId()")
    page.locator("#offline").wait_for()
    with ServerProcess(folder, port=port):
        began_s = time.monotonic()
        _wait_for_other_server(page, boot)
        wait_until_live(page)
        return time.monotonic() - began_s
