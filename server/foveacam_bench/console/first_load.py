"""The console at first use: what the browser loads, entries of the navigation, a click on a phone."""

from typing import TYPE_CHECKING

from foveacam_bench.console.pages import open_sized_page
from foveacam_bench.figures import Figures
from foveacam_bench.pace.slow_line import slow_line_figures
from foveacam_bench.stream.console_page import open_context, page_position, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PHONE_WIDTH, PHONE_HEIGHT = 390, 844
"""Size of the window of a phone, CSS px."""
CLICK_PX = (812.0, 420.0)
"""A textured wide pixel of the scene `bench`."""
_ANSWERED = "Boolean(document.getElementById('fixation').dataset.fixation)"
_IN_VIEW = """() => {
  const strip = document.getElementById("result");
  if (!strip.checkVisibility()) return false;
  const { left, top, right, bottom } = strip.getBoundingClientRect();
  const there = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
  return scrollY === 0 && top >= 0 && left >= 0 && bottom <= innerHeight && right <= innerWidth
    && strip.contains(there) && /\\d/.test(strip.textContent);
}"""
"""Whether the strip with the result is whole in the window, with nothing above it, and has a number."""


def first_load_figures(browser: "Browser", url: str) -> Figures:
    """Load the console with an empty cache; return requests and bytes until the first picture."""
    found = slow_line_figures(browser, url)
    return {
        "requests_first_load": found["requests_before_first_picture"],
        "bytes_first_load": found["bytes_before_first_picture"],
    }


def result_figures(browser: "Browser", url: str) -> Figures:
    """Click on the wide view in the window of a phone; return whether the result is seen without scrolling.

    `navigation_entries`: of its navigation, which are those of any window; the menu of further pages is one.
    """
    with open_context(browser, scene=True) as context:
        page = open_sized_page(context, url, width=PHONE_WIDTH, height=PHONE_HEIGHT)
        entries = page.locator("#activities > *").count()
        page.mouse.click(*page_position(page, *CLICK_PX))
        wait_until(page, lambda: page.evaluate(_ANSWERED))
        return {"navigation_entries": entries, "result_visible_phone": bool(page.evaluate(_IN_VIEW))}
