"""`foveacam bench live`: the live views of both eyes in a real browser, and steering by hand.

Each view is measured alone with the 3D pane shown, as its tab is: anaglyph, difference and depth. Needs
Chromium and the extra `dev`.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import (
    VIEWS,
    chromium,
    frames_shown,
    open_context,
    open_page,
    wait_until_live,
)
from foveacam_bench.stream.steering import steering_figures

if TYPE_CHECKING:
    from playwright.sync_api import Page

STEREO_VIEWS = ("anaglyph", "difference", "depth")
TARGET_PX = (812.0, 420.0)
"""A textured point of the scene `bench`, on which both eyes rest."""


def run(*, quick: bool = False) -> dict[str, float]:
    """Measure the page's frame rates, then steering; takes about two minutes, quick half of one."""
    seconds = 6.0 if quick else 20.0
    figures: dict[str, float] = {}
    with (
        chromium() as browser,
        TemporaryDirectory() as folder,
        ServerProcess(Path(folder), port=free_port()) as server,
        open_context(browser, scene=True) as context,
    ):
        page = open_page(context, server.url)
        server.fixate(*TARGET_PX)
        for view in STEREO_VIEWS:
            rates = _rates(page, view, seconds=seconds)
            figures[f"live_{view}_fps"] = rates[view]
            figures[f"left_fps_beside_{view}"] = rates["left"]
    return figures | steering_figures(seconds=seconds)


def _rates(page: "Page", view: str, *, seconds: float) -> dict[str, float]:
    """Open the tab of a view and return how many frames a second the page shows of it and of the cameras."""
    page.locator(f"#tab-{view}").click()
    shown = (*VIEWS, view)
    wait_until_live(page, shown)
    before, began_s = frames_shown(page), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    after, took_s = frames_shown(page), time.monotonic() - began_s
    return {one: round((after[one] - before[one]) / took_s, 2) for one in shown}
