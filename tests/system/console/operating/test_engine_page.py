"""The page of the engine's load: a sentence for everybody, figures for engineers, a file to keep."""

import json
import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages import engine_documents as documents
from tests.support.pages.awaited import expect_to_fit, let_run
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
    expect(told).to_contain_text("Everything keeps up.")
    expect(told).to_contain_text("Live pictures a second: wide 20 of 20, left 20 of 20, right 20 of 20.")
    expect(table(page, "Threads")).to_contain_text("31 %")
    expect(page.get_by_text("At rest: foveacam-jobs.")).to_be_visible()
    expect(table(page, "Cameras")).to_contain_text("62 ms")
    expect(table(page, "Cameras")).not_to_contain_text("61.5")
    expect(table(page, "Start")).to_contain_text("pan-tilt")
    expect(page.get_by_role("region", name="Controller", exact=True).last).to_contain_text("Drifts")

    engine = stub.answers["/engine"]
    engine["hardware"] |= {"busy_share": 0.94, "flagged": True}
    engine["cameras"][1] = documents.camera("left", lost=12)
    engine["views"][0] |= {"rate_hz": 0.6, "slow_reason": "the scene is drawn no faster"}
    expect(told).to_contain_text("The hardware thread is busy 94 % of the time: live views get slower.")
    expect(told).to_contain_text("The left camera lost 12 frames in the last minute.")
    expect(told).to_contain_text("The wide view shows 0.6 of 20 pictures a second: the scene is drawn no")
    expect(told).not_to_contain_text("Everything keeps up.")
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


def test_who_feeds_whom_is_a_table_that_is_reached_by_keyboard_and_kept_up_to_date(
    stub: StubServer, open_stub: OpenShared
) -> None:
    page = open_stub("#/engine").page
    flow = table(page, "Data flow")
    rows = flow.locator("tbody tr")
    expect(rows).to_have_count(10)
    expect(flow.locator("tr.idle")).to_have_count(1)
    expect(rows.first).to_have_text(
        re.compile(r"Camera left\s*Hardware thread, 41 % busy, 2 waiting\s*12\.0 frames/s\s*1\u202f200")
    )
    scrolled = page.get_by_role("group", name="Data flow, table")
    scrolled.focus()
    expect(scrolled).to_be_focused()

    stub.answers["/engine"]["edges"][0] |= {"rate_hz": 11.0, "dropped_hz": 0.5, "dropped": 5, "flagged": True}
    expect(flow.locator("tr.flagged")).to_have_count(1)
    expect(flow.locator("tr.flagged")).to_contain_text("0.50/s, 5 in all")
    expect(scrolled).to_be_focused()
