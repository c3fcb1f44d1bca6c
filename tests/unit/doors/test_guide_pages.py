"""The guide: every page is served, its links lead somewhere, and the console's help lists all pages."""

import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from starlette.types import Scope
from tests.support.servers.local_server import serving

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.console import guide_pages, pages
from foveacam_server.console.static_files import STATIC
from foveacam_server.doors import error_handlers

ROOT = Path(__file__).parents[3]
SERVED = {"/", "/docs", "/display"}
"""Other pages of the server that the guide links to."""


@pytest.fixture(scope="module")
def app() -> FastAPI:
    app = FastAPI()
    pages.install(app)
    guide_pages.install(app)
    error_handlers.install(app)
    return app


@pytest.fixture(scope="module")
def browser(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        yield client


def test_every_file_of_the_guide_is_a_page() -> None:
    assert {path.stem for path in guide_pages.FOLDER.glob("*.md")} == set(guide_pages.NAMES)


@pytest.mark.parametrize("name", guide_pages.NAMES)
def test_a_page_is_served_with_its_navigation(browser: httpx.Client, name: str) -> None:
    answer = browser.get(f"/guide/{name}")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["cache-control"] == "no-cache"
    title = (guide_pages.FOLDER / f"{name}.md").read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
    assert f"<title>FoveaCam Duo: {title}</title>" in answer.text
    assert f'<h1 id="{name}">{title}</h1>' in answer.text
    listed = re.findall(r'<a href="/guide/([a-z]+)"[^>]*>[A-Z]', answer.text)
    assert listed[: len(guide_pages.NAMES)] == list(guide_pages.NAMES)
    assert answer.text.count("aria-current") == 1
    assert '<a href="/">' in answer.text
    assert "<!--" not in answer.text
    assert " style=" not in answer.text


@pytest.mark.parametrize("name", guide_pages.NAMES)
def test_every_link_of_a_page_leads_somewhere(browser: httpx.Client, name: str) -> None:
    text = browser.get(f"/guide/{name}").text
    for target in re.findall(r'<a href="([^"]+)"', text):
        if target.startswith("https://"):
            continue
        path, _, section = target.partition("#")
        if path.startswith("/guide/"):
            linked = browser.get(path)
            assert linked.status_code == 200, target
            assert not section or f'id="{section}"' in linked.text, target
        elif path == "/" and section:
            assert "/".join(f"#{section}".split("/")[:2]) in addresses(), target
        elif path:
            assert path in SERVED, target
            assert browser.get(path).status_code == 200
        else:
            assert f'id="{section}"' in text, target


def addresses() -> set[str]:
    """Return the addresses of the console's pages."""
    text = (STATIC / "js" / "addresses.js").read_text(encoding="utf-8")
    return set(re.findall(r'["`](#/[a-z/]*)["`]', text))


@pytest.mark.parametrize("name", ["nothing", "looking.md", "LOOKING"])
def test_a_page_that_is_not_there_is_a_problem(browser: httpx.Client, name: str) -> None:
    answer = browser.get(f"/guide/{name}")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "/problems/not-found"


def test_the_guide_leads_to_its_first_page(browser: httpx.Client) -> None:
    answer = browser.get("/guide")
    assert (answer.status_code, answer.headers["location"]) == (307, "/guide/looking")


def test_whoever_sees_the_console_may_read_the_guide(app: FastAPI) -> None:
    table = RouteTable(app.routes)
    for path in ("/", "/guide", "/guide/looking"):
        scope: Scope = {"type": "http", "method": "GET", "path": path, "root_path": "", "headers": []}
        access = table.access(scope)
        assert access is not None
        assert access.right is Right.VIEW


def test_the_help_of_the_console_lists_every_page() -> None:
    text = (STATIC / "js" / "panels" / "dialogs.js").read_text(encoding="utf-8")
    listed = re.search(r"const GUIDE = \[\n(.*?)\n\];", text, re.DOTALL)
    assert listed is not None
    assert tuple(re.findall(r'^  \["([a-z]+)", ', listed[1], re.MULTILINE)) == guide_pages.NAMES


def test_the_readme_leads_to_every_page() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in guide_pages.NAMES:
        assert f"](server/foveacam_server/console/guide/{name}.md)" in readme
