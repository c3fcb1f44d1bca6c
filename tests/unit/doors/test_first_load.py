"""What a browser fetches before the console's first picture: few requests, few bytes, none found late."""

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.local_server import serving

from foveacam_server.console import module_graph, pages
from foveacam_server.console.static_files import STATIC
from foveacam_server.doors.compression import CompressedAnswers

MOST_REQUESTS, MOST_BYTES = 70, 150_000
"""Of the page, its style sheet, script and icon, and the modules; the socket and its worker come beside."""
HEADER_BYTES = 900
"""Allowed for the headers of each answer: those of security make two thirds of them."""
IMPORT = re.compile(r'\bfrom "(\.[^"]+)"')


@pytest.fixture(scope="module")
def browser() -> Iterator[httpx.Client]:
    app = FastAPI()
    pages.install(app)
    app.add_middleware(CompressedAnswers)
    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        yield client


def addresses_of(page: str) -> list[str]:
    at_once = re.sub(r"<template.*?</template>", "", page, flags=re.DOTALL)
    return re.findall(r'(?:src|href)="(/static/[^"]+)"', at_once)


def imported_by(address: str, text: str) -> set[str]:
    """Return the addresses of the modules that a module imports at once, its types aside."""
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    joined = (PurePosixPath(address).parent / found for found in IMPORT.findall(code))
    return {str(PurePosixPath(*normalised(path.parts))) for path in joined}


def normalised(parts: tuple[str, ...]) -> list[str]:
    kept: list[str] = []
    for part in parts:
        if part == "..":
            kept.pop()
        else:
            kept.append(part)
    return kept


def test_the_first_picture_waits_for_few_requests_and_few_bytes(browser: httpx.Client) -> None:
    page = browser.get("/")
    addresses = list(dict.fromkeys(addresses_of(page.text)))
    answers = [page, *(browser.get(address) for address in addresses)]
    assert {answer.status_code for answer in answers} == {200}
    assert len(answers) <= MOST_REQUESTS
    assert sum(answer.num_bytes_downloaded + HEADER_BYTES for answer in answers) <= MOST_BYTES


@pytest.mark.parametrize("page", ["/", "/view", "/windows", "/replay", "/display"])
def test_a_page_names_every_module_that_its_script_imports(browser: httpx.Client, page: str) -> None:
    named = set(addresses_of(browser.get(page).text))
    modules = {address for address in named if address.endswith(".js")}
    imported: set[str] = set()
    for address in modules:
        imported |= imported_by(address, browser.get(address).text)
    assert imported
    assert imported <= modules
    entry = re.findall(r'<script type="module" src="([^"]+)"', browser.get(page).text)
    assert modules - imported - set(entry) <= {address for address in named if address.endswith("theme.js")}


def test_style_sheets_come_as_one_and_those_of_the_panels_as_a_later_one(browser: httpx.Client) -> None:
    text = (STATIC / "index.html").read_text(encoding="utf-8")
    first, later = re.split(r"<template", text)
    served_first, served_later = re.split(r"<template", browser.get("/").text)
    for source, served in ((first, served_first), (later, served_later)):
        (address,) = re.findall(r'<link rel="stylesheet" href="([^"]+)">', served)
        sheet = browser.get(address)
        assert sheet.headers["content-type"].startswith("text/css")
        assert "immutable" in sheet.headers["Cache-Control"]
        named = re.findall(r'href="/static/(css/[^"]+)"', source)
        assert len(named) > 5
        joined = "\n".join((STATIC / name).read_text(encoding="utf-8") for name in named)
        assert sheet.text == re.sub(r"/\*[^*]*\*/", "", joined)
        assert "/*" in joined
        assert "/*" not in sheet.text


@pytest.mark.parametrize("address", ["0/nothing.html", "2/index.html", "00/index.html", "index.html"])
def test_an_address_that_joins_no_style_sheets_is_not_found(browser: httpx.Client, address: str) -> None:
    assert browser.get("/static/joined/0/index.html.css").status_code == 200
    assert browser.get(f"/static/joined/{address}.css").status_code == 404


def test_a_module_that_is_loaded_later_is_not_among_those_of_the_start() -> None:
    modules = {path.name for path in module_graph.start_modules(STATIC / "js" / "main.js")}
    assert {"main.js", "views.js", "stop_button.js", "lit-html.js"} <= modules
    assert "console.js" not in modules
