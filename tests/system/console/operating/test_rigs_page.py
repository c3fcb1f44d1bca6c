"""The page of all rigs: cards with state, picture, driver and a link; one that does not answer; only one."""

import pytest
from playwright.sync_api import expect

from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.console_page import PHONE, OpenConsole
from tests.support.pages.stub_server import StubServer
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

OTHERS = [
    {
        "id": "this",
        "name": "Bench",
        "address": "/",
        "source": "this",
        "rig_id": "sim-rig120",
        "simulated": True,
        "scene": "bench",
        "state": "ready",
        "driver": "ada",
        "problems": [],
        "problem": None,
        "remedy": None,
        "picture_url": "/api/v1/views/wide/snapshot.jpg?scale=2",
    },
    {
        "id": "a1",
        "name": "Roof, beside the chimney of the old building with a long name",
        "address": "https://roof.example/",
        "source": "file",
        "rig_id": None,
        "simulated": None,
        "scene": None,
        "state": None,
        "driver": None,
        "problems": [],
        "problem": "Roof does not answer at https://roof.example/: no route to host",
        "remedy": "see whether its server runs and is reached from this machine",
        "picture_url": "/api/v1/rigs/a1/picture.jpg",
    },
]


def test_a_server_alone_shows_its_rig_and_how_others_are_added(
    open_console: OpenConsole, page_server: Server
) -> None:
    console = open_console(f"{page_server.url}#/rigs")
    page = console.page
    card = page.locator(".rig-card")
    expect(card).to_have_count(1)
    expect(card.locator("h3")).to_contain_text("Ready")
    expect(card).to_contain_text("Control is free.")
    console.wait_until("document.querySelector('.rig-card img')?.naturalWidth > 0")
    expect(page.locator("#rigs-page > .note")).to_contain_text("foveacam serve --rigs FILE")
    card.get_by_role("link", name="Open its console").click()
    expect(page.locator("#rigs-page")).to_be_hidden()


def test_a_rig_that_does_not_answer_says_why_beside_the_others(
    open_console: OpenConsole, stub: StubServer
) -> None:
    stub.answers["/rigs"] = OTHERS
    page = open_console(f"{stub.url}#/rigs").page
    silent = page.locator(".rig-card[data-rig=a1]")
    expect(silent.locator("h3")).to_contain_text("No answer")
    expect(silent.locator(".state.bad")).to_contain_text("See whether its server runs")
    expect(silent.locator("img")).to_have_count(0)
    expect(silent.get_by_role("link")).to_have_attribute("href", "https://roof.example/")
    expect(page.locator(".rig-card[data-rig=this]")).to_contain_text("ada drives it.")
    page.set_viewport_size(PHONE)
    expect_to_fit(page)
