"""The page of the engine's load: a sentence for everybody, figures for engineers, a file to keep."""

import json
import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages import engine_documents as documents
from tests.support.pages.awaited import expect_to_fit, let_run, settled
from tests.support.pages.console_page import PHONE, OpenShared
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]


def reads(stub: StubServer) -> int:
    return sum((method, path) == ("GET", "/engine") for method, path, _ in stub.requests)


def table(page: Page, name: str) -> Locator:
    return page.get_by_role("table", name=name, exact=True)


def test_engine_is_told_in_a_sentence_and_in_figures_saved_and_reads_only_while_shown(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/rig").page
    page.get_by_role("link", name="Engine").click()
    told = page.locator(".engine-told")
    expect(told).to_have_text("Everything keeps up.")
    expect(table(page, "Threads")).to_contain_text("31 %")
    expect(page.get_by_text("At rest: foveacam-jobs.")).to_be_visible()
    expect(table(page, "Cameras")).to_contain_text("62 ms")
    expect(table(page, "Cameras")).not_to_contain_text("61.5")
    expect(table(page, "Start")).to_contain_text("pan-tilt")
    expect(page.get_by_role("region", name="Controller", exact=True).last).to_contain_text("Drifts")

    engine = stub.answers["/engine"]
    engine["hardware"] |= {"busy_share": 0.94, "flagged": True}
    engine["cameras"][1] = documents.camera("left", lost=12)
    expect(told).to_contain_text("The hardware thread is busy 94 % of the time: live views get slower.")
    expect(told).to_contain_text("The left camera lost 12 frames in the last minute.")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save as a file").click()
    kept = json.loads(download.value.path().read_text(encoding="utf-8"))
    assert (kept["format"], kept["version"], kept["engine"]) == ("foveacam-engine", 1, engine)
    assert kept["mirrors"]["link"] is not None

    page.set_viewport_size(PHONE)
    expect_to_fit(page)
    page.get_by_role("link", name="Back to the console").click()
    expect(page.locator("#engine-page")).to_be_hidden()
    before = reads(stub)
    let_run(page, 1500)
    assert reads(stub) <= before + 1  # one may be under way


def test_who_feeds_whom_is_drawn_reached_by_keyboard_and_kept_up_to_date(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/engine").page
    graph = page.get_by_role("region", name="Who feeds whom").locator("svg")
    expect(graph.get_by_role("button")).to_have_count(10)
    expect(graph.locator("path.line")).to_have_count(10)
    expect(graph.locator("path.line.idle")).to_have_count(1)
    hardware = graph.get_by_role("button", name="Hardware thread, 41 % busy, 2 waiting")
    expect(hardware).to_have_accessible_name(
        "Hardware thread, 41 % busy, 2 waiting, fed by Camera left and Camera wide and Jobs, "
        "feeds Mirrors and View left and View wide"
    )
    details = page.locator(".flow-part")
    expect(details).to_have_text("Choose a part to see what it takes and gives.")
    page.get_by_role("group", name="Who feeds whom, graph").focus()
    page.keyboard.press("Tab")
    focused = graph.locator("[data-part]:focus")
    first = settled(page, lambda: focused.get_attribute("data-part"))
    expect(details.locator("h4")).not_to_be_empty()
    hardware.focus()
    expect(details).to_contain_text("12.0 frames/s, 1\u202f200 in all")
    page.keyboard.press("Tab")
    expect(focused).not_to_have_attribute(
        "data-part", re.compile(f"^({re.escape(first)}|foveacam-hardware)$")
    )
    hardware.focus()

    stub.answers["/engine"]["edges"][0] |= {"rate_hz": 11.0, "dropped_hz": 0.5, "dropped": 5, "flagged": True}
    expect(graph.locator("path.line.flagged")).to_have_count(1)
    expect(graph.locator(".rate .lost.flagged")).to_have_text(" −0.5/s")
    expect(details).to_contain_text("5 dropped (0.50/s)")
    expect(focused).to_have_attribute("data-part", "foveacam-hardware")
