"""The page that shows the calibration pattern: its true size, its scale, and what it cannot show."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.calibrate.wide.board_detector import detect_board
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard
from tests.support.pages.awaited import box_of, expect_value, settled
from tests.support.pages.console_page import Console, OpenConsole
from tests.support.pages.printed_pages import printed_pages
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

CHARUCO = {"kind": "charuco", "columns": 7, "rows": 5, "square_mm": 17.3, "marker_mm": 13.0}
CHECKERBOARD = {"kind": "checkerboard", "columns": 7, "rows": 5, "square_mm": 17.3}
MARKERS = {"kind": "markers", "side_mm": 40.0, "spacing_mm": 70.0}
BLANK = {"kind": "blank"}
CARD_MM = 85.6
TABLET = {"viewport": {"width": 1000, "height": 700}, "device_scale_factor": 2}
PHONE = {
    "viewport": {"width": 390, "height": 740},
    "device_scale_factor": 3,
    "has_touch": True,
    "is_mobile": True,
}


def show(server: Server, pattern: object) -> None:
    server.send("PUT", "/displays/pattern", pattern).raise_for_status()


def open_display(
    open_console: OpenConsole, server: Server, options: dict[str, object], *, px_per_mm: float | None
) -> Console:
    """Open the page on a screen whose scale is known, or not."""
    console = open_console(f"{server.url}display", options=options)
    if px_per_mm is not None:
        console.page.evaluate(
            "(scale) => { const sides = [screen.width, screen.height].sort((a, b) => b - a);"
            " localStorage.setItem('foveacam.display.scales', JSON.stringify({[sides.join('x')]: scale})); }",
            px_per_mm,
        )
        console.page.reload()
    expect(console.page.locator("#bar")).not_to_contain_text("Waiting")
    return console


def picture(page: Page) -> NDArray[np.uint8]:
    """Return the page as its screen shows it, (h, w) grey, device pixels."""
    encoded = np.frombuffer(page.screenshot(), dtype=np.uint8)
    return np.asarray(cv2.imdecode(encoded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


@pytest.mark.parametrize(("options", "px_per_mm"), [(TABLET, 7.37), (TABLET, 9.0), (PHONE, 6.9)])
@pytest.mark.parametrize(
    ("pattern", "board"),
    [
        (CHARUCO, Charuco(columns=7, rows=5, square_m=0.0173, marker_m=0.013)),
        (CHECKERBOARD, Checkerboard(columns=7, rows=5, square_m=0.0173)),
    ],
)
def test_a_square_has_as_many_pixels_as_its_millimetres_and_the_detector_finds_it(
    open_console: OpenConsole,
    page_server: Server,
    options: dict[str, object],
    px_per_mm: float,
    pattern: dict[str, object],
    board: Board,
) -> None:
    show(page_server, pattern)
    page = open_display(open_console, page_server, options, px_per_mm=px_per_mm).page
    drawing = page.locator("#pattern svg")
    expect(drawing).to_be_visible()
    ratio: float = settled(page, lambda: page.evaluate("devicePixelRatio"))
    box = box_of(drawing)
    # nine squares with the edge; the page keeps a sixty-fourth of a pixel
    assert box["width"] * ratio == pytest.approx(9 * 17.3 * px_per_mm, abs=ratio / 32)
    found = detect_board(picture(page), board)
    assert found is not None
    assert len(found.corners_px) == board.corners
    steps_px = np.diff(found.corners_px.reshape(board.rows, board.columns, 2)[:, [0, -1]], axis=1)
    square_px = np.linalg.norm(steps_px, axis=2) / (board.columns - 1)
    # edges lie between pixels and are grey: a corner is found to a tenth of one, over six squares
    np.testing.assert_allclose(square_px, 17.3 * px_per_mm, atol=0.05)


def test_the_mirrors_markers_stand_where_the_sweep_expects_them(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, MARKERS)
    page = open_display(open_console, page_server, TABLET, px_per_mm=8.0).page
    expect(page.locator("#pattern svg")).to_be_visible()
    found = find_markers(picture(page), side_m=0.040)
    assert set(found) == {0, 1, 2}
    for marker_id, side in ((1, -1.0), (2, 1.0)):
        apart_px = middle_px(found[marker_id]) - middle_px(found[0])
        np.testing.assert_allclose(apart_px, [side * 70.0 * 8.0, 0.0], atol=0.1)


def test_the_scale_is_set_by_a_card_and_kept_and_until_then_the_size_is_not_true(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, CHECKERBOARD)
    page = open_display(open_console, page_server, TABLET, px_per_mm=None).page
    expect(page.locator("#warning")).to_contain_text("The size is not true yet")
    page.get_by_role("button", name="Set the size").click()
    outline = page.locator(".outline")
    handle = page.get_by_role("slider", name="Length of the outline")
    box = box_of(handle)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60.0, y, steps=4)
    page.mouse.up()
    page.get_by_role("button", name="Ten pixels longer").click()
    handle.press("ArrowLeft")
    fitted = box_of(outline)
    px_per_mm = fitted["width"] * 2.0 / CARD_MM
    assert fitted["height"] / fitted["width"] == pytest.approx(53.98 / CARD_MM, rel=1e-3)
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#warning")).to_be_hidden()
    page.reload()
    expect(page.locator("#bar")).to_contain_text(f"{px_per_mm:.3f} px/mm")
    scales = [display["px_per_mm"] for display in page_server.send("GET", "/displays").json()]
    assert pytest.approx(px_per_mm, abs=1e-3) in scales


def test_what_does_not_fit_is_said_with_both_sizes_and_never_scaled(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, CHECKERBOARD)
    page = open_display(open_console, page_server, PHONE, px_per_mm=15.0).page
    warning = page.locator("#warning")
    expect(warning).to_contain_text("155.7 × 121.1 mm are requested, the page has 78.0 × 148.0 mm")
    expect(page.locator("#pattern svg")).to_be_hidden()
    show(page_server, {**CHECKERBOARD, "square_mm": 8.0})
    expect(page.locator("#pattern svg")).to_be_visible()
    expect(warning).to_be_hidden()


def test_the_full_screen_leaves_the_pattern_alone_and_in_its_place(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, CHECKERBOARD)
    page = open_display(open_console, page_server, TABLET, px_per_mm=7.0).page
    before = box_of(page.locator("#pattern svg"))
    page.get_by_role("button", name="Full screen").click()
    expect(page.locator("#bar")).to_be_hidden()
    expect_value(page, page.locator("#pattern svg").bounding_box, before)
    page.locator("#pattern").click()
    expect(page.locator("#bar")).to_be_visible()


def test_a_display_without_its_server_shows_what_it_showed_and_catches_up(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, CHECKERBOARD)
    console = open_display(open_console, page_server, TABLET, px_per_mm=7.0)
    page = console.page
    path = page.locator("#pattern path")
    before = settled(page, lambda: path.get_attribute("d"))
    page.context.set_offline(True)
    expect(page.locator("#bar")).to_contain_text("No connection to the server")
    show(page_server, MARKERS)
    expect(path).to_have_attribute("d", before)
    page.context.set_offline(False)
    expect(page.locator("#bar")).not_to_contain_text("No connection")
    expect(path).not_to_have_attribute("d", before)
    console.errors.clear()  # the requests that found no server


def test_the_calibration_page_chooses_the_pattern_and_lists_the_displays(
    open_console: OpenConsole, page_server: Server
) -> None:
    show(page_server, BLANK)
    display = open_display(open_console, page_server, TABLET, px_per_mm=8.0).page
    console = open_console(f"{page_server.url}#/calibration").page
    panel = console.get_by_role("region", name="Displays")
    expect(panel).to_contain_text("Displays are blank")
    expect(panel.locator("a").first).to_have_attribute("href", "/display")
    panel.get_by_label("Pattern").select_option("checkerboard")
    expect(panel.get_by_label("Marker")).to_be_hidden()
    panel.get_by_label("Square").fill("20")
    panel.get_by_role("button", name="Show").click()
    expect(panel).to_contain_text("checkerboard of 9 x 6 inner corners, squares of 20 mm")
    expect(panel.get_by_role("listitem")).to_contain_text(["250.0 × 175.0 mm"])
    expect(display.locator("#pattern svg")).to_be_visible()
    panel.get_by_label("Square").fill("30")
    panel.get_by_role("button", name="Show").click()
    expect(panel.get_by_role("listitem").filter(has_text="does not fit on 250.0 × 175.0 mm")).to_have_count(1)
    panel.get_by_label("Paper").select_option("A3")
    with console.expect_download() as download:
        panel.get_by_role("button", name="Print (PDF)").click()
    assert download.value.suggested_filename == "checkerboard.pdf"
    (printed,) = printed_pages(download.value.path().read_bytes())
    assert printed.width_mm == pytest.approx(420.0, abs=1e-3)
    panel.get_by_role("button", name="Blank").click()
    expect(display.locator("#pattern svg")).to_have_count(0)
