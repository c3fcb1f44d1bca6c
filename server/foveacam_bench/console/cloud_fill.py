"""How much of the 3D pane's height the newest shape takes once the camera rests, after clicks of a person.

The coarse surface of the surroundings, point clouds, gaze rays and labels are switched off. After each click
the pane is pictured with surfaces and without: what differs is the shape. Its target is then deleted.
"""

from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.console.scene_panel import open_scene, set_shown
from foveacam_bench.console.shape_height import shape_height_px
from foveacam_bench.figures import Figures, Report
from foveacam_bench.servers import ServerProcess
from foveacam_bench.stream.click_latency import delete_targets, wait_for_shape
from foveacam_bench.stream.console_page import open_context, open_page, page_position, wait_until
from foveacam_client.document import JsonObject

if TYPE_CHECKING:
    from playwright.sync_api import Browser, FrameLocator, Page

CLICKS_PX = (
    (960.0, 230.0),
    (1180.0, 680.0),
    (340.0, 620.0),
    (590.0, 510.0),
    (1230.0, 500.0),
    (1000.0, 745.0),
    (180.0, 700.0),
    (560.0, 930.0),
    (1080.0, 960.0),
    (800.0, 260.0),
)
"""Wide pixels of the scene `bench`, near and far, by both foveae and by one."""
QUICK_CLICKS = 1
PANE = ".area-scene .scene"
SURFACES, HIDDEN = "Surfaces", ("Point clouds", "Surroundings", "Gaze rays", "Labels")
"""Labels of checkboxes in the 3D scene's panel."""
SAME_MS, MOST_PICTURES = 700, 20
"""The camera rests when two pictures this far apart are alike."""
_SHOWN = "document.getElementById('fixation').dataset.fixation || null"


def cloud_fill_figures(browser: "Browser", server: ServerProcess, *, quick: bool, report: Report) -> Figures:
    """Click and measure; return the least and the median share, and how many clicks were counted.

    An answer without a cloud has a flat picture as its shape. Not counted are limits of a distance, and
    failures. Shares are null where none counts.
    """
    clicks = CLICKS_PX[: QUICK_CLICKS if quick else None]
    fills: list[tuple[float, bool]] = []
    with open_context(browser, scene=True) as context:
        page = open_page(context, server.url)
        scene = open_scene(page)
        for label in HIDDEN:
            set_shown(scene, label, shown=False)
        for number, pixel in enumerate(clicks, start=1):
            report(f"the 3D pane, click {number} of {len(clicks)}")
            fill = _fill_after_click(page, server, scene, pixel)
            fills += [] if fill is None else [fill]
    return fill_figures(fills, clicks=len(clicks))


def fill_figures(fills: Sequence[tuple[float, bool]], *, clicks: int) -> Figures:
    """Return the figures of so many clicks: the share that a shape filled, and whether it is a cloud."""
    shares = [share for share, _ in fills]
    return {
        "cloud_fills": round(min(shares), 3) if shares else None,
        "cloud_fills_median": round(median(shares), 3) if shares else None,
        "cloud_fills_clicks": len(fills),
        "cloud_fills_flat": sum(not cloud for _, cloud in fills),
        "cloud_fills_without_distance": clicks - len(fills),
    }


def _fill_after_click(
    page: "Page", server: ServerProcess, scene: "FrameLocator", pixel: tuple[float, float]
) -> tuple[float, bool] | None:
    """Click on a wide pixel; return the share of the pane's height that its shape takes, None without.

    With it whether the shape is a cloud.
    """
    before = page.evaluate(_SHOWN)
    page.mouse.click(*page_position(page, *pixel))
    wait_until(page, lambda: page.evaluate(_SHOWN) not in (None, before))
    fixation: JsonObject = server.send("GET", f"/fixations/{page.evaluate(_SHOWN)}").json()
    try:
        cloud = wait_for_shape(page, server, str(fixation["id"]))
        if fixation["distance_m"] is None:
            return None
        shown = _picture_at_rest(page)
        set_shown(scene, SURFACES, shown=False)
        hidden = _picture_at_rest(page)
        set_shown(scene, SURFACES, shown=True)
    finally:
        delete_targets(server)
    return shape_height_px(shown, hidden) / len(shown), cloud


def _picture_at_rest(page: "Page") -> NDArray[np.uint8]:
    """Return a picture of the pane, (h, w, 3) uint8 BGR, that the next one equals."""
    before = _picture(page)
    for _ in range(MOST_PICTURES):
        page.wait_for_timeout(SAME_MS)
        now = _picture(page)
        if np.array_equal(before, now):
            break
        before = now
    return before


def _picture(page: "Page") -> NDArray[np.uint8]:
    encoded = np.frombuffer(page.locator(PANE).screenshot(), np.uint8)
    return np.asarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR), dtype=np.uint8)
