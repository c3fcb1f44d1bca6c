"""A browser on the console of a real server."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Playwright, sync_playwright

from foveacam_bench.stream.console_page import CHROMIUM, CHROMIUM_ARGUMENTS

from .console_page import DESKTOP, Console, OpenConsole, Tabs
from .server_process import Server, StartServer, servers


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    if not CHROMIUM.exists():
        pytest.fail(
            "Chromium is missing: run tests/system/install-chromium.sh, or leave these out: -m 'not browser'"
        )
    with sync_playwright() as found:
        yield found


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    found = playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_ARGUMENTS)
    yield found
    found.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server on the simulated rig that the tests of one module share."""
    with servers(tmp_path_factory.mktemp("data")) as start:
        yield start()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[StartServer]:
    """Start servers of one's own, one after the other on the same data."""
    with servers(tmp_path / "data") as start:
        yield start


@pytest.fixture(scope="module")
def tabs(browser: Browser) -> Iterator[Tabs]:
    with ExitStack() as stack:
        yield Tabs(browser, stack)


@pytest.fixture
def open_console(tabs: Tabs) -> Iterator[OpenConsole]:
    """Open the page with nothing stored; it must end without an error in the browser's console."""
    opened: list[tuple[str, Console]] = []

    def open_(
        url: str,
        *,
        settings: dict[str, Any] | None = None,  # Any: as the page keeps them
        options: dict[str, Any] | None = None,  # Any: Playwright's
    ) -> Console:
        name, console = tabs.open_tab(
            {"scene": False, "hints": False, **(settings or {})}, {"viewport": DESKTOP, **(options or {})}
        )
        opened.append((name, console))
        console.page.goto(url)
        return console

    yield open_
    errors = [error for _, console in opened for error in console.errors]
    for name, console in opened:
        tabs.release_tab(name, console)
    assert errors == []
