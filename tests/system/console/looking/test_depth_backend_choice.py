"""The choice of what computes the depth of looks, beside the depth view, and the comparison of two."""

import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import expect

from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder
from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.console_page import Console, OpenShared
from tests.support.scenes.network_graphs import constant, matcher, write_card
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
LIST = "What computes the depth of a look"


@pytest.fixture
def console(open_shared: OpenShared, page_server: Server) -> Console:
    page_server.be_idle()
    found = open_shared(page_server.url)
    found.wait_for_frames("wide")
    return found


@pytest.fixture
def networks(page_server: Server, tmp_path: Path) -> Iterator[NetworkFolder]:
    folder = NetworkFolder(page_server.data / "networks")
    graph = matcher(tmp_path / "a.onnx", first_px=-16, last_px=16)
    folder.add(write_card(graph, research_only=True, licence="CC BY-NC 4.0"))
    folder.add(write_card(constant(tmp_path / "nan.onnx", float("nan")), name="broken"))
    yield folder
    httpx.put(f"{page_server.url}api/v1/depth/backend", json={"name": "sgbm"}).raise_for_status()
    for name in folder.every():
        folder.remove(name)


def in_use(server: Server) -> str:
    return str(httpx.get(f"{server.url}api/v1/depth/backends").json()["in_use"])


def look(server: Server) -> None:
    """Fixate the middle of the wide view and wait for the depth of that look."""
    answer = httpx.post(
        f"{server.url}api/v1/fixations",
        json={"pixel": {"x_px": 720, "y_px": 540}},
        headers={"Prefer": "wait=30"},
        timeout=60,
    )
    assert answer.status_code == 200


def test_the_network_that_ships_is_chosen_and_computes_the_depth_of_a_look(
    console: Console, page_server: Server
) -> None:
    console.page.locator("#tab-depth").click()
    expect(console.page.get_by_role("link", name="Compare two")).to_be_visible()
    with console.page.expect_response(lambda answer: answer.url.endswith("/depth/backend")):
        console.page.get_by_label(LIST).select_option("foveal")
    assert in_use(page_server) == "foveal"
    httpx.put(f"{page_server.url}api/v1/depth/backend", json={"name": "sgbm"}).raise_for_status()


def test_a_network_for_research_is_chosen_after_a_confirmation_and_one_that_fails_says_why(
    console: Console, page_server: Server, networks: NetworkFolder
) -> None:
    page = console.page
    page.reload()
    page.locator("#tab-depth").click()
    choice = page.get_by_label(LIST)
    expect(choice.locator("option")).to_have_text(
        [
            "Semi-global matching",
            "The same, faster and coarser",
            "foveal (MIT)",
            "broken (Apache-2.0)",
            "shifts (research only, CC BY-NC 4.0)",
        ]
    )
    choice.select_option("shifts")
    with page.expect_response(lambda answer: answer.url.endswith("/depth/backend")):
        page.get_by_role("button", name="Use shifts for research").click()
    assert in_use(page_server) == "shifts"
    with page.expect_response(lambda answer: answer.url.endswith("/depth/backend")):
        choice.select_option("broken")
    look(page_server)
    console.wait_until(
        "fetch('/api/v1/depth/backends').then(answer => answer.json()).then(found => found.fallback !== null)"
    )
    choice.focus()
    expect(choice).to_have_attribute("title", re.compile("instead of broken: .*no finite number"))


def test_two_backends_are_compared_on_a_look_by_a_slider_a_difference_and_a_histogram(
    console: Console, page_server: Server, networks: NetworkFolder
) -> None:
    look(page_server)
    page = console.page
    page.locator("#tab-depth").click()
    page.get_by_role("link", name="Compare two").click()
    expect(page.get_by_role("heading", name="Compare depth")).to_be_focused()
    page.get_by_label("Left of the slider").select_option("sgbm")
    page.get_by_label("Right of it").select_option("sgbm")
    start = page.get_by_role("button", name="Compare on the newest look")
    expect(start).to_be_disabled()
    page.get_by_label("Right of it").select_option("shifts")
    expect(start).to_be_disabled()
    page.get_by_label("This is research").check()
    start.click()
    result = page.locator(".compare-result")
    expect(result.get_by_role("img", name="Histogram of the differences")).to_be_visible()
    expect(result.locator("dt", has_text="Known to both")).to_be_visible()
    meet = page.get_by_label("Where the two pictures meet")
    meet.fill("20")
    expect(page.locator("img.over")).to_have_css("clip-path", re.compile(r"80% 0px 0px\)$"))
    page.set_viewport_size({"width": 390, "height": 844})
    expect_to_fit(page)
