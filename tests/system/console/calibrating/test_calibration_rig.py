"""The calibration page on the simulated rig: what the real server says is what the page can show."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.pages.console_page import Console, OpenConsole
from tests.support.servers.running_server import running
from tests.support.servers.server_process import Server, server_of

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PATIENCE_MS = 60_000
SELDOM_HZ = (0.2, 0.2)
"""Nothing here waits for a live picture."""


@pytest.fixture(scope="module")
def page_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running(tmp_path_factory.mktemp("data"), scene="calibration", live_hz=SELDOM_HZ) as found:
        yield server_of(found)


@pytest.fixture
def overview(open_console: OpenConsole, page_server: Server) -> Console:
    page_server.be_idle()
    console = open_console(f"{page_server.url}#/calibration")
    expect(console.page.locator(".records:not(.sessions) .current")).to_be_visible(timeout=PATIENCE_MS)
    return console


def test_exported_file_is_imported_again(overview: Console, tmp_path: Path) -> None:
    with overview.page.expect_download() as download:
        overview.page.get_by_role("link", name=re.compile("^Export")).first.click()
    file = tmp_path / "record.json"
    download.value.save_as(file)
    assert json.loads(file.read_text())["format"]
    overview.page.get_by_label("Import a calibration file").set_input_files(file)
    expect(overview.page.locator(".toast.good")).to_contain_text("Imported")


def test_views_of_the_board_are_taken_cancelled_and_gone_on_with_until_the_lens_is_known(
    overview: Console,
) -> None:
    page = overview.page
    page.get_by_role("button", name="New", exact=True).click()
    page.get_by_role("link", name="1 Wide camera").click()
    wide = page.locator("#step-wide")
    expect(wide.locator(".samples li")).to_have_count(0)
    views = wide.get_by_role("region", name="Views of the board")
    views.get_by_text("Board and options").click()
    views.get_by_label("Views wanted").fill("6")
    views.get_by_role("button", name="Take views").click()
    expect(page.locator(".job .far")).to_have_text(re.compile(r"^[1-5] of 6"), timeout=PATIENCE_MS)
    page.get_by_role("button", name="Cancel").click()
    bar = page.locator(".job.warn")
    expect(bar).to_contain_text("What was measured is kept", timeout=PATIENCE_MS)
    expect(wide.locator(".samples li").first).to_be_visible(timeout=PATIENCE_MS)
    bar.get_by_role("button", name="Go on").click()
    expect(wide.locator(".samples li")).to_have_count(6, timeout=PATIENCE_MS)  # the fit comes after it
    expect(page.locator(".job.good")).to_contain_text("Wide camera: done", timeout=PATIENCE_MS)
    expect(wide.locator(".compare .badge")).to_have_text("in use", timeout=PATIENCE_MS)
    expect(wide.locator(".coverage .held").nth(20)).to_be_attached()  # of 108 parts of the picture
