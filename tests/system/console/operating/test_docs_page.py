"""The page about the REST interface in a real browser that reaches nothing but this machine."""

import pytest
from playwright.sync_api import Browser, expect

from tests.support.pages.console_page import PATIENCE_MS
from tests.support.servers.running_server import Running

pytestmark = pytest.mark.browser


def test_the_interface_is_shown_without_internet(page_rig: Running, browser: Browser) -> None:
    own = str(page_rig.http.base_url)
    asked: list[str] = []
    complaints: list[str] = []
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.set_default_timeout(PATIENCE_MS)
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(f"{own}/redoc")
    expect(page).to_have_url(f"{own}/docs")

    paths = page_rig.http.get("/openapi.json").json()["paths"]
    tags = [operation["tags"][0] for methods in paths.values() for operation in methods.values()]
    expect(page.locator(".opblock-tag")).to_have_count(len(set(tags)))
    page.locator("#operations-tag-stop").click()
    expect(page.locator(".opblock")).to_have_count(tags.count("stop"))
    page.locator("#operations-stop-engage_api_v1_stop_post button").first.click()
    page.get_by_text("Try it out").wait_for()
    page.get_by_role("button", name="Authorize").click()
    page.get_by_text("X-API-Token").first.wait_for()
    page.close()

    assert [url for url in asked if not url.startswith((own, "data:", "blob:"))] == []
    assert complaints == []
    policy = page_rig.http.get("/docs").headers["content-security-policy"]
    assert "http" not in policy
    assert "script-src 'self';" in policy
