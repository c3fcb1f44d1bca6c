"""The console's first load on a slow line: requests before the first picture, and the total time.

The line is emulated by Chromium: 1.5 Mbit/s each way and 100 ms before each answer.
"""

import time
from typing import TYPE_CHECKING

from foveacam_bench.figures import Figures
from foveacam_bench.stream.console_page import PATIENCE_S, open_context, wait_until, wait_until_live

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Request

LINE_BITS_PER_S = 1.5e6
DELAY_MS = 100.0
_PICTURE = ".pane canvas.picture:not([hidden])"
_SHELL = "#wide .pane .spinner"
_NOTE_PICTURE = f"""new MutationObserver(() => {{
  if (!document.querySelector("{_PICTURE}")) return;
  window.benchPicture_ms ??= performance.timeOrigin + performance.now();
}}).observe(document, {{ attributes: true, childList: true, subtree: true }})"""
"""Records the time of the first picture, ms of the wall clock, because this program learns of it later."""


def slow_line_figures(browser: "Browser", url: str) -> Figures:
    """Load the console of the server at `url` with an empty cache; return requests, bytes and times.

    `requests_before_first_picture`: begun by then. `bytes_before_first_picture`: of those ended by then.
    """
    with open_context(browser, scene=True) as context:
        page = context.new_page()
        _slow_down(page)
        page.add_init_script(_NOTE_PICTURE)
        finished: list[Request] = []
        context.on("requestfinished", lambda request: finished.append(request))  # a function, which it marks
        began_s = time.monotonic()
        page.goto(url, wait_until="commit", timeout=1e3 * PATIENCE_S)
        page.wait_for_selector(_SHELL, state="attached", timeout=1e3 * PATIENCE_S)
        shell_s = time.monotonic() - began_s
        page.wait_for_selector(_PICTURE, timeout=1e3 * PATIENCE_S)
        first_s = time.monotonic() - began_s
        wait_until(page, lambda: page.evaluate("Boolean(window.foveacam)"))
        complete_s = time.monotonic() - began_s
        wait_until_live(page)
        picture_ms = float(page.evaluate("window.benchPicture_ms"))
        begun = [request for request in finished if request.timing["startTime"] <= picture_ms]
        return {
            "head_shown_s_slow_line": round(shell_s, 2),
            "first_picture_s_slow_line": round(first_s, 2),
            "requests_before_first_picture": len(begun),
            "bytes_before_first_picture": sum(
                _bytes(request) for request in begun if _end_ms(request) <= picture_ms
            ),
            "console_complete_s_slow_line": round(complete_s, 2),
        }


def _slow_down(page: "Page") -> None:
    line = page.context.new_cdp_session(page)
    line.send("Network.enable")
    bytes_per_s = LINE_BITS_PER_S / 8.0
    conditions = {"downloadThroughput": bytes_per_s, "uploadThroughput": bytes_per_s, "latency": DELAY_MS}
    line.send("Network.emulateNetworkConditions", {"offline": False, **conditions})


def _end_ms(request: "Request") -> float:
    """Return the end of an answer, ms of the wall clock."""
    return request.timing["startTime"] + request.timing["responseEnd"]


def _bytes(request: "Request") -> int:
    """Return the bytes of an answer as they came, compressed, with its headers."""
    sizes = request.sizes()
    return sizes["responseHeadersSize"] + sizes["responseBodySize"]
