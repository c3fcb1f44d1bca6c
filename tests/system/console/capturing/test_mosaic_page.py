"""The mosaic of a small dataset on a real server: made, walked about in, read out, put into 3D, refused."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.support.pages.awaited import expect_to_fit, match_of, settled, wait_for
from tests.support.pages.console_page import TOUCH, OpenConsole
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.mosaic_scenes import Z_M, scan
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]


@pytest.fixture(scope="module", autouse=True)
def _plane(page_server: Server) -> None:
    scan(page_server.data / "captures" / "plane", wide=True)


def address(server: Server, capture_id: str = "test") -> str:
    return f"{server.url}#/gallery/datasets/{capture_id}/mosaic"


def depth_read_m(page: Page) -> float:
    """Return the depth that the page tells, once it tells one."""
    return float(match_of(page.locator(".mosaic-readout dd").first, r"(\d+\.\d+) m")[1])


def test_a_mosaic_is_made_walked_about_in_and_shown_in_3d(
    page_server: Server, open_console: OpenConsole
) -> None:
    page = open_console(address(page_server)).page
    expect(page.get_by_text("4 foveae")).to_be_visible()
    page.get_by_role("button", name="Make the mosaic").click()
    view = page.get_by_role("application", name=re.compile("^Mosaic"))
    expect(view).to_be_visible(timeout=120_000)
    expect(view).to_have_attribute("aria-busy", "false")
    wait_for(page, lambda: view.locator("canvas").evaluate(LIGHT) > 40.0)

    page.get_by_role("button", name="Depth", exact=True).click()
    expect(view).to_have_attribute("aria-busy", "false")
    view.press("0")  # whoever uses keys reads the middle
    assert depth_read_m(page) == pytest.approx(Z_M, rel=0.01)
    where, zoom = page.locator(".mosaic-readout dd").last, page.locator(".mosaic-zoom output")
    before, whole = settled(page, where.inner_text), settled(page, zoom.inner_text)
    view.press("+")
    expect(zoom).not_to_have_text(whole)
    view.press("ArrowRight")
    expect(where).not_to_have_text(before)
    view.press("0")
    expect(where).to_have_text(before)

    page.get_by_role("button", name="Show in 3D").click()
    expect(page.get_by_role("button", name="Take out of 3D")).to_be_visible()
    assert page_server.get("/captures/test/mosaic")["in_scene"]
    page.get_by_role("button", name="Take out of 3D").click()
    expect(page.get_by_role("button", name="Show in 3D")).to_be_visible()


def test_on_a_phone_it_fits_and_is_removed(page_server: Server, open_console: OpenConsole) -> None:
    if page_server.get("/captures/test/mosaic")["made"] is None:
        page_server.send("POST", "/captures/test/mosaic")
    console = open_console(address(page_server), options=TOUCH)
    expect(console.page.get_by_role("application", name=re.compile("^Mosaic"))).to_be_visible(timeout=120_000)
    expect_to_fit(console.page)
    mosaic = console.page.get_by_role("application")
    expect(mosaic).to_have_attribute("aria-busy", "false")
    expect(mosaic).to_have_css("touch-action", "pan-y")  # nothing to move: a finger scrolls the page
    mosaic.press("+")
    expect(mosaic).to_have_css("touch-action", "none")
    console.page.get_by_role("button", name="Remove").click()
    expect(console.page.get_by_role("button", name="Make the mosaic")).to_be_visible()


def test_what_no_mosaic_can_be_made_of_is_said(
    page_server: Server, open_console: OpenConsole, tmp_path: Path
) -> None:
    captures = page_server.data / "captures"
    (captures / "plane").rename(tmp_path / "plane")  # both have the same id
    written(captures / "noise", 4)
    page = open_console(address(page_server)).page
    expect(page.get_by_text("has no calibration")).to_be_visible()
    expect(page.get_by_role("button", name="Make the mosaic")).to_have_count(0)


def test_views_without_overlap_are_told_at_the_dataset_and_lead_to_a_plan_that_overlaps(
    page_server: Server, open_console: OpenConsole
) -> None:
    scan(page_server.data / "captures" / "apart", capture_id="apart", step_deg=4.0)
    page = open_console(f"{page_server.url}#/gallery/datasets/apart").page
    page.get_by_role("link", name="Mosaic: not possible").click()
    expect(page.get_by_text("No two of the 4 views of dataset apart overlap")).to_be_visible()
    page.get_by_role("button", name="Plan a capture whose views overlap").click()
    plan = page.get_by_role("region", name="Plan", exact=True)
    expect(plan.get_by_label("Field", exact=True)).to_have_value("overlap")
    expect(plan.get_by_label("Overlap across")).to_have_value("20")


LIGHT = """canvas => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0;
  for (let at = 0; at < data.length; at += 4) sum += data[at];
  return 4 * sum / data.length;
}"""
"""How bright a canvas is in the mean, 0 to 255."""
