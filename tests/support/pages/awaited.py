"""The state of a page, waited for: a page draws when it can, and what is read once may be read too early.

Playwright's own `expect` comes first; these are for what it has no word for: the value of a script, a place
on the page, a text that is compared later.
"""

import re
import time
from collections.abc import Callable
from typing import TypeVar

from playwright.sync_api import FloatRect, Locator, Page, expect

from tests.support.servers.server_process import PATIENCE_S

POLL_MS = 30
Value = TypeVar("Value")


def wait_for(page: Page, condition: Callable[[], bool], what: str = "it never came true") -> None:
    """Wait until a condition holds, while the browser's events arrive."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, f"within {PATIENCE_S} s: {what}"
        page.wait_for_timeout(POLL_MS)


def expect_value(page: Page, read: Callable[[], object], wanted: object) -> None:
    """Wait until a reading equals what is wanted, also a `pytest.approx`."""
    end_s = time.monotonic() + PATIENCE_S
    while (found := read()) != wanted:
        assert time.monotonic() < end_s, f"within {PATIENCE_S} s: {found!r} never became {wanted!r}"
        page.wait_for_timeout(POLL_MS)


def settled(page: Page, read: Callable[[], Value | None]) -> Value:
    """Return what two readings in a row agree on; None is no reading."""
    end_s = time.monotonic() + PATIENCE_S
    before = read()
    while True:
        page.wait_for_timeout(POLL_MS)
        found = read()
        if found is not None and found == before:
            return found
        assert time.monotonic() < end_s, f"within {PATIENCE_S} s: {before!r} was followed by {found!r}"
        before = found


def box_of(element: Locator) -> FloatRect:
    """Return where an element stays on the page, CSS px."""
    return settled(element.page, element.bounding_box)


def match_of(element: Locator, pattern: str) -> re.Match[str]:
    """Wait until the whole text of an element is of a pattern, and return the match."""
    expect(element).to_have_text(re.compile(f"^{pattern}$"))
    found = re.fullmatch(pattern, settled(element.page, element.inner_text))
    assert found is not None
    return found


def expect_to_fit(page: Page) -> None:
    """Wait until the page is no wider than its window; a phone lets `innerWidth` grow with the page."""
    root = "document.documentElement"
    wait_for(
        page,
        lambda: page.evaluate(f"{root}.scrollWidth <= {root}.clientWidth") is True,
        "the page is wider than its window",
    )


def let_run(page: Page, ms: float) -> None:
    """Let the page's own clock run: a shorter timer that was set before has gone off by then."""
    page.evaluate("ms => new Promise(done => setTimeout(done, ms))", ms)
