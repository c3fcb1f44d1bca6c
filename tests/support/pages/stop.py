"""STOP while a dialog is open: one click and Space reach it, and nothing else of the page does."""

from playwright.sync_api import Page, Request, Route, expect

from tests.support.pages.awaited import expect_value

PATH = "**/api/v1/stop"
ENGAGED = {"engaged": True, "by": "operator", "since_utc": "2026-01-01T00:00:00Z", "parked": True}
COVERED = """() => {
  const a = document.getElementById("stop").getBoundingClientRect();
  const covers = (b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  return [...document.querySelectorAll("dialog:modal :is(button, a, input, select):not(#stop)")]
    .filter((each) => each.checkVisibility() && covers(each.getBoundingClientRect()))
    .map((each) => each.ariaLabel ?? each.textContent);
}"""
"""The controls of the open dialog that STOP covers."""


def expect_stop_in_reach(page: Page) -> None:
    """Stop by one click, and by Space, beside the open dialog, which stays; the server is not told."""
    dialog = page.locator("dialog:modal")
    expect(dialog).to_have_count(1)
    stop = page.locator("#stop")
    expect(stop).to_be_in_viewport(ratio=1.0)
    expect_value(page, lambda: page.evaluate(COVERED), [])
    page.route(PATH, _pretend)
    with page.expect_request(_is_stop):
        stop.click()
    with page.expect_request(_is_stop):
        page.keyboard.press("Space")
    expect(page.locator("#stopped")).to_contain_text("Stopped by operator")
    expect(dialog).to_be_visible()
    page.unroute(PATH)


def _pretend(route: Route) -> None:
    if route.request.method == "POST":
        route.fulfill(json=ENGAGED)
    else:
        route.fallback()


def _is_stop(request: Request) -> bool:
    return request.method == "POST" and request.url.endswith("/api/v1/stop")
