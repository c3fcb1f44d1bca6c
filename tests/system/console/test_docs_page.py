"""The page about the REST interface in a real browser that reaches nothing but this machine."""

import pytest
from playwright.sync_api import Browser

from tests.system.conftest import Running

from .short_interface import describe_in_short

pytestmark = pytest.mark.browser

PATIENCE_MS = 60_000
DRAWN = ("/api/v1/stop", "/api/v1/fixations", "/api/v1/recordings/{recording_id}")
"""Paths that are drawn: without parameters, with a body of nested schemas, with a parameter."""


def test_the_interface_is_shown_without_internet(rig: Running, browser: Browser) -> None:
    own = str(rig.http.base_url)
    asked: list[str] = []
    complaints: list[str] = []
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.route("**/openapi.json", lambda route: describe_in_short(route, *DRAWN))
    page.goto(f"{own}/redoc")
    assert page.url == f"{own}/docs"

    page.locator(".opblock").first.wait_for(timeout=PATIENCE_MS)
    paths = rig.http.get("/openapi.json").json()["paths"]
    assert page.locator(".opblock").count() == sum(len(paths[path]) for path in DRAWN)
    page.locator("#operations-stop-engage_api_v1_stop_post button").first.click()
    page.get_by_text("Try it out").wait_for(timeout=PATIENCE_MS)
    page.get_by_role("button", name="Authorize").click()
    page.get_by_text("X-API-Token").first.wait_for(timeout=PATIENCE_MS)
    page.close()

    assert [url for url in asked if not url.startswith((own, "data:", "blob:"))] == []
    assert complaints == []
    policy = rig.http.get("/docs").headers["content-security-policy"]
    assert "http" not in policy
    assert "script-src 'self';" in policy
