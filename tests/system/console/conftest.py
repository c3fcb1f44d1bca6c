"""A browser on the console: one browser, one server and one stub for all files here."""

from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from playwright.sync_api import Browser, Error, Page, Playwright, sync_playwright

from foveacam_bench.stream.console_page import CHROMIUM_ARGUMENTS
from tests.support.pages import calibration_documents
from tests.support.pages.console_page import (
    BROWSER,
    DESKTOP,
    EMPTY,
    PLAIN,
    Console,
    OpenConsole,
    OpenShared,
    OpenWizard,
    SharedPages,
    Tabs,
)
from tests.support.pages.stub_server import StubServer, serving_stub
from tests.support.servers.running_server import Running, running
from tests.support.servers.server_process import Server, server_of

SNAPSHOT_MS = 5000.0
_BROWSER = pytest.StashKey[Browser]()
NO_INTERNET = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"


@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    if not BROWSER.exists():
        pytest.fail(
            f"{BROWSER} is missing: run tests/system/install-chromium.sh, "
            "or leave these out: -m 'not browser'"
        )
    with sync_playwright() as found:
        yield found


@pytest.fixture(scope="package")
def browser(playwright: Playwright, request: pytest.FixtureRequest) -> Iterator[Browser]:
    found = playwright.chromium.launch(executable_path=BROWSER, args=[*CHROMIUM_ARGUMENTS, NO_INTERNET])
    request.session.stash[_BROWSER] = found
    yield found
    found.close()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add what each page shows to the report of a failed test, before the tabs are cleared."""
    report = yield
    browser = item.session.stash.get(_BROWSER, None)
    if report.when == "call" and report.failed and browser is not None:
        pages = [page for context in browser.contexts for page in context.pages]
        report.sections += [
            (f"what {page.url} shows", _shown(page)) for page in pages if EMPTY not in page.url
        ]
    return report


def _shown(page: Page) -> str:
    try:
        return page.locator("body").aria_snapshot(timeout=SNAPSHOT_MS)
    except Error as error:
        return f"no answer: {error}"


@pytest.fixture(scope="package")
def shared_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data"), viewer=True) as found:
        yield found


@pytest.fixture(scope="module")
def page_rig(shared_rig: Running) -> Running:
    """A server in this process, whose inside a test may see, in the state in which it starts."""
    shared_rig.reset()
    return shared_rig


@pytest.fixture(scope="module")
def page_server(page_rig: Running) -> Server:
    """The same server as its clients see it."""
    return server_of(page_rig)


@pytest.fixture(scope="package")
def stub_server() -> Iterator[StubServer]:
    with serving_stub() as found:
        yield found


@pytest.fixture
def stub(stub_server: StubServer) -> StubServer:
    """A server that says what a test has put into it: a calibrated rig that has measured nothing yet."""
    stub_server.reset()
    return stub_server


@pytest.fixture
def measured(stub: StubServer) -> None:
    """Let a calibration have been measured, fitted and checked."""
    stub.session = calibration_documents.full_session()


@pytest.fixture
def open_stub(stub: StubServer, shared_pages: SharedPages, open_shared: OpenShared) -> OpenShared:
    """Open the page that the tests of a file share at a part of it, once it has read what the stub says."""

    def open_(part: str) -> Console:
        known = stub.url in shared_pages.opened
        console = open_shared(stub.url)
        page = console.page
        if known:
            with page.expect_response("**/api/v1/faults"):  # the last of all that it reads
                stub.leave_pages()
        page.evaluate("part => { location.hash = part }", part)
        return console

    return open_


@pytest.fixture
def open_wizard(stub: StubServer, open_stub: OpenShared, open_console: OpenConsole) -> OpenWizard:
    """Open the calibration at a step, once it knows the rig and hears of events.

    `fresh`: in a page that remembers nothing of the tests before.
    """

    def open_(step: str, *, fresh: bool = False) -> Console:
        part = f"#/calibration/{step}"
        console = open_console(stub.url + part) if fresh else open_stub(part)
        console.page.locator("#wizard-title").wait_for()
        console.page.locator(".wizard-side .inside p").first.wait_for()
        stub.wait_for_listener()
        return console

    return open_


@pytest.fixture(scope="package")
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
        prepare: Callable[[Page], None] | None = None,  # before anything is loaded
    ) -> Console:
        name, console = tabs.open_tab(
            url,
            {**PLAIN, **(settings or {})},
            {"viewport": DESKTOP, **(options or {})},
        )
        opened.append((name, console))
        if prepare is not None:
            prepare(console.page)
        console.load(url)
        return console

    yield open_
    errors = [error for _, console in opened for error in console.errors]
    for name, console in opened:
        tabs.release_tab(name, console)
    assert errors == []


@pytest.fixture(scope="module")
def shared_pages(tabs: Tabs) -> Iterator[SharedPages]:
    found = SharedPages(tabs)
    yield found
    found.release()


@pytest.fixture
def open_shared(shared_pages: SharedPages) -> Iterator[OpenShared]:
    """Open a page that the tests of a file share; each must end without an error in the browser's console."""
    yield shared_pages.open
    assert shared_pages.take_errors() == []
