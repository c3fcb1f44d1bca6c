"""The report in a real browser: asks for nothing, fits a phone, follows the colours, prints light."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.report.page import report_html
from tests.support.pages.awaited import expect_to_fit, expect_value

pytestmark = pytest.mark.browser

CERTIFICATE = SHIPPED / "sim-rig120.json"


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_html(load_calibration(CERTIFICATE)), encoding="utf-8")
    return path


@pytest.mark.parametrize("width", [360, 1280])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_and_follows_the_colours(browser: Browser, page_file: Path, width: int, scheme: str) -> None:
    dark = scheme == "dark"
    context = browser.new_context(
        viewport={"width": width, "height": 800}, color_scheme="dark" if dark else "light"
    )
    with context:
        page = context.new_page()
        asked: list[str] = []
        said: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda message: said.append(message.text))
        page.goto(page_file.as_uri())
        expect_to_fit(page)
        expect_value(page, lambda: page.evaluate("innerWidth"), width)
        red = r"([0-5]?\d|6[0-3])" if dark else r"(19[3-9]|2\d\d)"
        expect(page.locator("body")).to_have_css("background-color", re.compile(rf"^rgb\({red},"))
        assert asked == [page_file.as_uri()]
        assert said == []


def test_paper_is_white_also_for_those_who_read_in_the_dark(browser: Browser, page_file: Path) -> None:
    with browser.new_context(color_scheme="dark") as context:
        page = context.new_page()
        page.goto(page_file.as_uri())
        page.emulate_media(media="print")
        expect(page.locator("body")).to_have_css("background-color", "rgb(255, 255, 255)")
        expect(page.locator("nav").first).to_have_css("display", "none")
