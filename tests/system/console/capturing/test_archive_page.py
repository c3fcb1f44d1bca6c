"""The archive in the gallery, and retention on the settings page, on a real server with both."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.support.pages.console_page import OpenShared
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.recordings import record
from tests.support.servers.running_server import Running, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
FETCH = "Fetch"


@pytest.fixture(scope="module")
def archived(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server with an archive and rules of retention, whose live views hardly render."""
    folder = tmp_path_factory.mktemp("archived")
    data = folder / "data"
    written(data / "captures" / "small", 2)
    (data / "recordings").mkdir()
    record(data / "recordings" / "looks.fcap", ticks=8)
    written(data / "stills" / "desk", 1)
    (data / "retention.toml").write_text("[retention.recordings]\nkeep_days = 30\n")
    with running(data, live_hz=(0.1, 0.1), archive=f"file://{folder}/archive") as found:
        yield found


def address(server: Running, part: str) -> str:
    return f"http://127.0.0.1:{server.port}/#/{part}"


def send_and_fetch(page: Page) -> None:
    """Archive what is shown, keep what is small of it, and fetch it."""
    page.get_by_role("button", name="Archive", exact=True).click()
    page.get_by_role("button", name="Keep the small ones here").click()
    expect(page.get_by_text("Only what is small is here; the rest is read from there.")).to_be_visible()
    expect(page.locator(".dataset-head").get_by_text("archived")).to_be_visible()
    page.get_by_role("button", name=FETCH).click()
    expect(page.get_by_text("All of it is here as well.")).to_be_visible()


def test_a_dataset_is_archived_and_fetched(archived: Running, open_shared: OpenShared) -> None:
    console = open_shared(address(archived, "gallery/datasets/test"))
    send_and_fetch(console.page)
    assert len(list((archived.captures / "small" / "images").iterdir())) == 6


def test_a_recording_is_archived_and_fetched(archived: Running, open_shared: OpenShared) -> None:
    (recording,) = archived.get("/recordings").json()
    console = open_shared(address(archived, f"gallery/recordings/{recording['id']}"))
    send_and_fetch(console.page)
    assert Path(archived.services.settings.data, "recordings", "looks.fcap").is_file()


def test_a_still_is_archived_and_fetched(archived: Running, open_shared: OpenShared) -> None:
    console = open_shared(address(archived, "gallery/stills/test"))
    send_and_fetch(console.page)
    assert len(list((archived.captures.parent / "stills" / "desk" / "images").iterdir())) == 3


def test_what_the_rules_name_goes_to_the_trash(archived: Running, open_shared: OpenShared) -> None:
    archived.services.recordings.opened.close()
    console = open_shared(address(archived, "settings"))
    retention = console.page.get_by_role("region", name="Retention", exact=True)
    expect(retention.get_by_text("Recordings: kept for 30 days")).to_be_visible()
    expect(retention.get_by_text("older than 30 days")).to_be_visible()
    retention.get_by_role("button", name="Move to the trash").click()
    expect(console.page.get_by_text("1 moved to the trash")).to_be_visible()
    expect(retention.get_by_text("Nothing would be removed now.")).to_be_visible()
    (recording,) = archived.get("/recordings", removed="true").json()
    assert recording["name"] == "looks"
