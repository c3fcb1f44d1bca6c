"""STOP while a dialog is open: one click and Space reach it, and nothing else of the page does."""

from playwright.sync_api import FloatRect, Page, Request, Route, expect

from tests.support.pages.awaited import box_of

PATH = "**/api/v1/stop"
ENGAGED = {"engaged": True, "by": "operator", "since_utc": "2026-01-01T00:00:00Z", "parked": True}


def expect_stop_in_reach(page: Page) -> None:
    """Stop by one click, and by Space, beside the open dialog, which stays; the server is not told."""
    dialog = page.locator("dialog:modal")
    expect(dialog).to_have_count(1)
    stop = page.locator("#stop")
    expect(stop).to_be_in_viewport(ratio=1.0)
    if (close := dialog.get_by_role("button", name="Close", exact=True)).count():
        _expect_apart(box_of(stop), box_of(close))
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


def _expect_apart(one: FloatRect, other: FloatRect) -> None:
    beside = one["x"] >= other["x"] + other["width"] or other["x"] >= one["x"] + one["width"]
    above = one["y"] >= other["y"] + other["height"] or other["y"] >= one["y"] + one["height"]
    assert beside or above, f"STOP at {one} covers a button at {other}"
