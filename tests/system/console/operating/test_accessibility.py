"""No page has a serious finding of axe-core: light, dark, and on a phone."""

import pytest

from foveacam_bench.console.accessibility import serious_findings
from foveacam_bench.console.pages import (
    CONSOLE_PAGES,
    DOCUMENTS,
    LOOKS,
    LookName,
    apply_look,
    show_console_page,
    show_document,
)
from tests.support.pages.console_page import OpenConsole, OpenShared
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]


@pytest.mark.parametrize("look", LOOKS)
def test_no_page_of_the_console_has_a_serious_finding(
    page_server: Server, open_console: OpenConsole, look: LookName
) -> None:
    console = open_console(page_server.url)
    apply_look(console.page, look)
    if look == "light":
        console.fixate(720, 540)
    for address in CONSOLE_PAGES:
        show_console_page(console.page, address)
        assert serious_findings(console.page, colours_alone=look == "dark") == [], address


@pytest.mark.parametrize("look", LOOKS)
def test_no_document_beside_the_console_has_a_serious_finding(
    page_server: Server, open_shared: OpenShared, look: LookName
) -> None:
    page = open_shared(page_server.url).page
    apply_look(page, look)
    try:
        for path in DOCUMENTS:
            show_document(page, page_server.url + path)
            assert serious_findings(page, colours_alone=look == "dark") == [], path
    finally:
        page.goto(page_server.url)


def test_the_check_finds_what_is_wrong(page_server: Server, open_console: OpenConsole) -> None:
    page = open_console(page_server.url).page
    page.evaluate("""() => {
      const pale = Object.assign(document.createElement("p"), { textContent: "pale", style: "color:#ccc" });
      document.querySelector("main, #console").prepend(pale, document.createElement("button"));
    }""")
    (pale,) = serious_findings(page, colours_alone=True)
    assert pale.startswith("color-contrast")
    found = serious_findings(page)
    assert pale in found
    assert any(line.startswith("button-name") for line in found)
