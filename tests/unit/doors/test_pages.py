"""What browsers may keep of the page: all that stands below the version of its files, and nothing else."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.local_server import serving

from foveacam_server.console import pages, static_files


@pytest.fixture(scope="module")
def browser() -> Iterator[httpx.Client]:
    app = FastAPI()
    pages.install(app)
    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        yield client


@pytest.mark.parametrize("page", ["/", "/view", "/display", "/windows", "/replay"])
def test_a_page_is_asked_for_each_time_and_what_it_loads_once(browser: httpx.Client, page: str) -> None:
    answer = browser.get(page)
    assert answer.headers["Cache-Control"] == "no-cache"
    loaded = re.findall(r'(?:src|href)="(/static/[^"]+)"', answer.text)
    assert len(loaded) >= 4
    current = static_files.version()
    for address in loaded:
        assert address.startswith(f"/static/{current}/")
        file = browser.get(address)
        assert file.status_code == 200
        assert "immutable" in file.headers["Cache-Control"]


@pytest.mark.parametrize("prefix", ["/static", "/static/v-000000000000"])
def test_without_the_version_or_by_another_one_a_file_is_asked_for_again(
    browser: httpx.Client, prefix: str
) -> None:
    file = browser.get(f"{prefix}/js/main.js")
    assert (file.status_code, file.headers["Cache-Control"]) == (200, "no-cache")


def test_no_version_leads_out_of_the_folder(browser: httpx.Client) -> None:
    assert browser.get(f"/static/{static_files.version()}/%2e%2e/%2e%2e/__init__.py").status_code == 404
    assert browser.get(f"/static/{static_files.version()}/js/nothing.js").status_code == 404


def test_the_version_changes_with_any_file(tmp_path: Path) -> None:
    file = tmp_path / "js" / "one.js"
    file.parent.mkdir()
    file.write_text("1")
    before = static_files.version(tmp_path)
    assert static_files.version(tmp_path) == before
    os.utime(file, ns=(1, 1))
    changed = static_files.version(tmp_path)
    assert changed != before
    (tmp_path / "two.css").write_text("")
    assert static_files.version(tmp_path) not in (before, changed)
