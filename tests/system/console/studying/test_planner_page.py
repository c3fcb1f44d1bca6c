"""The planner in a browser: sliders, maps, targets by hand and by key, files, refusals; without a rig."""

import json
import math
import re
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from fastapi import FastAPI
from playwright.sync_api import Locator, Page, Route, expect

from foveacam_server.doors import error_handlers
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.resources.studying.planner import routes
from tests.support.pages.awaited import box_of, expect_to_fit, expect_value, settled, wait_for
from tests.support.pages.console_page import NO_STORAGE, TOUCH, Console, OpenConsole, console_of
from tests.support.pages.stop import expect_stop_in_reach
from tests.support.pages.stub_server import StubServer, application
from tests.support.servers.local_server import serving

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The planner on a console whose rig is a stub: nothing of it could answer for the planner."""
    stub = StubServer()
    stub.reset()
    app = FastAPI()
    error_handlers.install(app)
    app.include_router(routes.router, prefix="/api/v1")
    app.mount("/", application(stub))
    with closing(ComputeQueue()) as computing, serving(app) as port:
        app.state.provided = ServiceRegistry({ComputeQueue: computing})
        yield f"http://127.0.0.1:{port}/#/planner"


def figure(page: Page, name: str) -> Locator:
    return page.locator(f".planner dt:text-is('{name}') + dd")


def entry(page: Page, name: str) -> Locator:
    return page.get_by_role("spinbutton", name=name, exact=True)


def refusal(page: Page, about: str) -> Locator:
    return page.locator(f".planner [data-about='{about}']")


def until_drawn(page: Page) -> Locator:
    """Wait until the regions of what is asked now are drawn."""
    view = page.locator(".plan-surface")
    expect(view).to_have_attribute("aria-busy", "false")
    return view


def at(view: Locator, x_share: float, y_share: float) -> tuple[float, float]:
    box = box_of(view)
    return box["x"] + x_share * box["width"], box["y"] + y_share * box["height"]


def middle_of(element: Locator) -> tuple[float, float]:
    return at(element, 0.5, 0.5)


def beside(discs: Locator, places_m: list[list[float]], *, far_m: float) -> tuple[float, float]:
    """Return the place on the page that is so far from both targets."""
    (ax, ay), (bx, by) = (middle_of(discs.nth(index)) for index in (0, 1))
    apart_m, apart_px = math.dist(*places_m), math.dist((ax, ay), (bx, by))
    across = math.sqrt(far_m**2 - (apart_m / 2.0) ** 2) / apart_m
    assert apart_px > 20.0
    return (ax + bx) / 2.0 + across * (by - ay), (ay + by) / 2.0 - across * (bx - ax)


def targets_of(page: Page) -> list[list[float]]:
    values: list[float] = settled(
        page,
        lambda: page.locator(".plan-targets input").evaluate_all(
            "inputs => inputs.map(({value}) => Number(value))"
        ),
    )
    return [values[index : index + 2] for index in range(0, len(values), 2)]


def choose_map(page: Page, name: str) -> None:
    page.locator(".planner .segments label", has_text=name).click()


def test_sliders_redraw_ring_chances_and_regions_and_the_address_keeps_them(
    address: str, open_console: OpenConsole
) -> None:
    console = open_console(f"{address}?seed=3")
    page = console.page
    expect(figure(page, "D_max")).to_have_text("14.38 m")
    until_drawn(page)
    expect(page.locator(".plan-drawing .region").nth(4)).to_be_attached()  # one more in the legend
    body = {"ring": {"px_per_deg": 502.0, "pixels": 40.0, "d_min_m": 8.0, "near_error_m": 0.2}}
    body["ring"]["feature_mm"] = 20.0
    asked = page.request.post(
        f"{address.partition('#')[0]}api/v1/planner/standoff",
        data=body | {"clutter": {"occupancy": 0.02, "radius_m": 0.5}, "domain_m2": 10_000.0},
    ).json()
    expect(figure(page, "P_succ over the domain")).to_have_text(f"{asked['success']:.3f}")

    entry(page, "Noticed nearer than D_min").fill("12")
    expect(figure(page, "nearest")).to_have_text("12.2 m")
    slider = page.get_by_role("slider", name="Depth error ΔZ near, slider")
    slider.focus()
    slider.press("Home")
    expect(figure(page, "nearest")).to_have_text("12 m")
    page.get_by_role("button", name="wide 55").click()
    expect(page.locator(".planner .nowhere")).to_contain_text(
        "is at or beyond D_max (1.576 m): no place is left"
    )
    expect(figure(page, "of the map")).to_have_text("0.0 %")

    console.wait_until("location.hash.includes('px_per_deg=55') && location.hash.includes('d_min_m=12')")
    page.reload()
    expect(figure(page, "D_max")).to_have_text("1.576 m")
    expect(entry(page, "Seed")).to_have_value("3")


def test_of_what_is_asked_in_haste_only_the_newest_counts(address: str, open_console: OpenConsole) -> None:
    page = open_console(f"{address}?map=open").page
    expect(figure(page, "D_max")).to_have_text("14.38 m")
    asked: list[float] = []

    def slowly(route: Route) -> None:
        asked.append(json.loads(route.request.post_data or "{}")["ring"]["feature_mm"])
        time.sleep(0.3)
        route.continue_()

    page.route("**/planner/standoff", slowly)
    field = entry(page, "Feature size S")
    field.evaluate(
        "input => { for (let size = 21; size <= 40; size += 1) {"
        " input.value = String(size); input.dispatchEvent(new Event('input')); } }"
    )
    expect(figure(page, "D_max")).to_have_text("28.76 m")
    assert asked == [21, 40]


def test_targets_are_placed_dragged_and_removed_and_counted_in_sight(
    address: str, open_console: OpenConsole
) -> None:
    page = open_console(f"{address}?map=open").page
    view = until_drawn(page)
    expect_value(page, lambda: targets_of(page), [[30.0, 30.0]])
    page.mouse.click(*at(view, 0.7, 0.3))
    expect(page.locator(".plan-targets li")).to_have_count(2)
    placed = targets_of(page)[1]
    assert placed[0] > 35.0
    assert placed[1] > 35.0  # up is north

    discs = page.locator(".plan-drawing > .target")
    page.mouse.move(*middle_of(discs.nth(1)))
    page.mouse.down()
    page.mouse.move(*at(view, 0.6, 0.4), steps=4)
    page.mouse.up()
    until_drawn(page)
    wait_for(page, lambda: targets_of(page)[1] != placed, "the target was not moved")
    expect(page.locator(".plan-targets li")).to_have_count(2)
    moved = targets_of(page)[1]

    page.mouse.move(*beside(discs, targets_of(page), far_m=11.0))
    readout = page.locator(".plan-readout")
    expect(readout).to_contain_text("2 of 2 in sight (targets 0, 1)")
    expect(page.locator(".plan-drawing .sight")).to_have_count(2)
    page.get_by_role("button", name="Remove target 0").click()
    expect(page.locator(".plan-targets li")).to_have_count(1)
    expect_value(page, lambda: targets_of(page), [moved])
    page.get_by_role("button", name="The map’s own").click()
    expect(page.locator(".plan-targets input").first).to_have_value("30")


def test_targets_are_placed_and_removed_by_keys(address: str, open_console: OpenConsole) -> None:
    page = open_console(f"{address}?map=open").page
    view = until_drawn(page)
    view.focus()
    for _ in range(3):
        view.press("Shift+ArrowRight")
    expect(page.locator(".plan-readout")).to_contain_text("in sight (target 0)")
    view.press("Enter")
    expect(page.locator(".plan-targets li")).to_have_count(2)
    first, second = targets_of(page)
    assert second[0] > first[0]
    view.press("Delete")
    expect(page.locator(".plan-targets li")).to_have_count(1)
    entry(page, "x of target 0, m").fill("20")
    expect(page.locator(".plan-drawing > .target")).to_have_count(1)
    until_drawn(page)
    expect_value(page, lambda: targets_of(page), [[20.0, 30.0]])


def test_own_maps_are_taken_with_a_scale_and_refused_in_words(
    address: str, open_console: OpenConsole, tmp_path: Path
) -> None:
    console = open_console(address)
    page = console.page
    choose_map(page, "GeoJSON")
    expect(refusal(page, "map")).to_contain_text("No map of your own is in this browser")
    crossed = [[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]
    choose_geojson(page, tmp_path, crossed)
    expect(page.locator(".planner .refused", has_text="without crossing itself")).to_be_visible()
    choose_geojson(page, tmp_path, [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]])
    expect(page.get_by_text("In use: map.geojson")).to_be_visible()
    expect_value(page, lambda: targets_of(page), [[20.0, 2.0]])

    image = np.full((300, 400), 255, np.uint8)
    image[200:260, 40:160] = 0
    cv2.imwrite(str(tmp_path / "yard.png"), image)
    choose_map(page, "Picture")
    expect(refusal(page, "map")).to_contain_text("No picture of your own")  # the map in use is none
    page.get_by_label("Load a picture").set_input_files(tmp_path / "yard.png")
    sheet = page.get_by_role("dialog", name="How large is it?")
    sheet.get_by_role("button", name="Use this picture").click()
    expect(sheet.get_by_role("alert")).to_contain_text("The picture has no scale: press both ends")
    expect_stop_in_reach(page)
    drawing = sheet.locator(".scale-drawing")
    for x_share in (0.2, 0.7):
        page.mouse.click(*at(drawing, x_share, 0.5))
    box = box_of(drawing)
    long_px = 0.5 * box["width"] / min(box["width"] / 400.0, box["height"] / 300.0)
    sheet.get_by_label("Its length").fill("20")
    scale = sheet.get_by_label("Metres a pixel")
    expect(scale).to_have_value(re.compile(r"^0\.0"))
    wanted = pytest.approx(20.0 / long_px, rel=0.01)  # the mouse goes to whole pixels
    expect_value(page, lambda: float(scale.input_value()), wanted)
    sheet.get_by_label("Metres a pixel").fill("0.1")
    sheet.get_by_role("button", name="Use this picture").click()
    expect(page.get_by_text("In use: yard.png")).to_be_visible()

    view = page.locator(".plan-surface")
    page.mouse.click(*at(view, 0.5, 0.3))
    until_drawn(page)
    expect(figure(page, "the target is in sight")).not_to_have_text("0.0 m²")
    page.mouse.click(*at(view, 0.25, 0.63))  # in the block
    expect(refusal(page, "targets")).to_contain_text("Target 1 at")
    expect(refusal(page, "targets")).to_contain_text("is inside obstacle 0")
    console.wait_until("location.hash.includes(';')")  # the address tells both
    page.reload()  # an own map is kept in this browser
    expect(page.get_by_text("In use: yard.png")).to_be_visible()
    expect(page.locator(".plan-targets li")).to_have_count(2)


def choose_geojson(page: Page, folder: Path, outline: list[list[int]]) -> None:
    features = [
        {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}
        for properties, kind, coordinates in (
            ({}, "Polygon", [outline]),
            ({"kind": "target"}, "Point", [20, 2]),
        )
    ]
    file = folder / "map.geojson"
    file.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    page.get_by_label("Load GeoJSON").set_input_files(file)


def saved(page: Page, form: str) -> bytes:
    with page.expect_download() as download:
        page.get_by_role("button", name=f"Save the plan as {form}").click()
    return Path(download.value.path()).read_bytes()


def test_the_plan_is_saved_as_picture_drawing_and_geojson(address: str, open_console: OpenConsole) -> None:
    page = open_console(f"{address}?seed=5").page
    until_drawn(page)
    drawing = ElementTree.fromstring(saved(page, "SVG"))  # noqa: S314 - our own page's
    texts = [str(text.text) for text in drawing.iter(f"{SVG}text")]
    assert [text for text in texts if re.fullmatch(r"\d+ m", text)], texts  # the scale bar
    assert {"target", "obstacle", "union of the regions", "D_max, 14.38 m"} <= set(texts)
    painted = [path for path in drawing.iter(f"{SVG}path") if (path.get("fill") or "").startswith("rgb")]
    assert len(painted) >= 45  # 5 regions and 40 obstacles, dressed without the page's styles
    assert not [each for each in drawing.iter() if each.get("class")]

    picture = cv2.imdecode(np.frombuffer(saved(page, "PNG"), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape[1] == 1600
    assert picture.std() > 10.0

    document: dict[str, Any] = json.loads(saved(page, "GeoJSON"))  # Any: JSON
    kinds = [feature["properties"]["kind"] for feature in document["features"]]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "bounds": 1, "obstacle": 40, "target": 5, "region": 5, "ring": 5, "union": 1,
    }  # fmt: skip


def test_browser_that_keeps_nothing_plans_all_the_same(address: str, open_console: OpenConsole) -> None:
    tab = open_console(address).page.context.new_page()
    errors = console_of(tab).errors
    tab.add_init_script(NO_STORAGE)
    tab.goto(address)
    until_drawn(tab)
    assert errors == []


def test_bad_input_is_a_sentence_beside_its_field(address: str, open_console: OpenConsole) -> None:
    page = open_console(f"{address}?map=open").page
    expect(figure(page, "D_max")).to_have_text("14.38 m")
    for field, name, bad, words in (
        ("Obstacle density p", "occupancy", "2", "2 was given; needed is a value of at most 1"),
        ("Noticed nearer than D_min", "d_min_m", "-3", "-3 was given; needed is a value of at least 0"),
        ("Feature size S", "feature_mm", "", "Feature size S is empty: type in a number."),
        ("Domain", "domain_m2", "10", "give more, or let it follow the ring"),
    ):
        good = settled(page, entry(page, field).input_value)
        entry(page, field).fill(bad)
        expect(refusal(page, name)).to_contain_text(words)
        entry(page, field).fill(good)
        expect(refusal(page, name)).to_be_empty()


def test_it_fits_a_phone_and_leads_back(address: str, open_console: OpenConsole) -> None:
    console: Console = open_console(address, options=TOUCH, settings={"theme": "dark"})
    page = console.page
    view = until_drawn(page)
    expect_to_fit(page)
    page.touchscreen.tap(*at(view, 0.15, 0.2))
    expect(page.locator(".plan-targets li")).to_have_count(6)
    page.get_by_role("link", name="Back to the console").click()
    expect(page.get_by_role("heading", name="Where to stand")).to_be_hidden()
    page.get_by_role("button", name="More").click()
    page.get_by_role("link", name="Planner").click()
    expect(page.locator(".plan-targets li")).to_have_count(6)
