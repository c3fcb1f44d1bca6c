"""Patterns printed as PDF: true millimetres, several sheets with crop marks, and what has no room."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.pages.printed_pages import PX_PER_MM, PrintedPage, printed_pages

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.pattern import Pattern, board_pattern, marker_pattern, target_pattern
from foveacam_pipeline.calibrate.sheets import lay_out, pattern_pdf, sheets_words
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.calibrate.wide.board_detector import detect_board
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard

TRUE_MM = 0.1
"""Half a pixel of the printer is 0.04 mm at either end; the rest is the detector's."""
BOARDS: list[Board] = [
    Charuco(columns=6, rows=4, square_m=0.030, marker_m=0.022),
    Charuco(columns=6, rows=4, square_m=0.030, marker_m=0.022, dictionary="5X5_50"),
    Checkerboard(columns=9, rows=6, square_m=0.025),
]


def printed(pattern: Pattern, *, paper: str = "A4", margin_m: float = 0.008) -> list[PrintedPage]:
    sheets = lay_out(pattern, paper=paper, margin_m=margin_m, words="a pattern")
    return printed_pages(pattern_pdf(sheets, title="a pattern"))


def joined(pages: list[PrintedPage], *, columns: int) -> NDArray[np.uint8]:
    """Return the pages cut along their crop marks and laid side by side, before white paper."""
    parts = []
    for page in pages:
        marks_mm = page.lines_mm[:8]
        upright = marks_mm[marks_mm[:, 0] == marks_mm[:, 2], 0]
        level = marks_mm[marks_mm[:, 1] == marks_mm[:, 3], 1]
        box_mm = np.array([upright.min(), upright.max(), level.min(), level.max()])
        left, right, top, bottom = np.rint(box_mm * PX_PER_MM).astype(int).tolist()
        parts.append(page.image()[top:bottom, left:right])
    rows = [np.hstack(parts[first : first + columns]) for first in range(0, len(parts), columns)]
    return np.pad(np.vstack(rows), 200, constant_values=255)


def assert_true(image: NDArray[np.uint8], board: Board) -> None:
    """Check that every corner is as far from every other one as on the board."""
    found = detect_board(image, board)
    assert found is not None
    assert len(found.corners_px) == board.corners
    corners_mm, places_mm = found.corners_px / PX_PER_MM, 1e3 * board.places_m()
    for first in range(board.corners):
        apart_mm = np.linalg.norm(corners_mm - corners_mm[first], axis=1)
        true_mm = np.linalg.norm(places_mm - places_mm[first], axis=1)
        np.testing.assert_allclose(apart_mm, true_mm, atol=TRUE_MM)


@pytest.mark.parametrize("board", BOARDS, ids=str)
def test_a_board_is_printed_at_its_true_size(board: Board) -> None:
    pattern = board_pattern(board)
    (page,) = printed(pattern)
    assert (page.width_mm, page.height_mm) == pytest.approx((297.0, 210.0), abs=1e-3)
    moved_mm = page.black_mm - 1e3 * pattern.black_m
    np.testing.assert_allclose(moved_mm, moved_mm[0, [0, 1, 0, 1]] + np.zeros_like(moved_mm), atol=1e-3)


def test_the_detector_finds_the_corners_of_a_print_where_they_are() -> None:
    board = BOARDS[0]
    (page,) = printed(board_pattern(board))
    assert_true(page.image(), board)


@pytest.mark.parametrize(
    ("paper", "size_mm"), [("A4", (210.0, 297.0)), ("A3", (297.0, 420.0)), ("Letter", (215.9, 279.4))]
)
def test_a_page_is_turned_as_the_pattern_is(paper: str, size_mm: tuple[float, float]) -> None:
    (upright,) = printed(board_pattern(Checkerboard(columns=4, rows=6, square_m=0.025)), paper=paper)
    (turned,) = printed(board_pattern(Checkerboard(columns=6, rows=4, square_m=0.025)), paper=paper)
    assert (upright.width_mm, upright.height_mm) == pytest.approx(size_mm, abs=1e-3)
    assert (turned.height_mm, turned.width_mm) == pytest.approx(size_mm, abs=1e-3)


@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_the_three_markers_fit_on_one_sheet_at_the_spacing_of_the_mirrors(paper: str) -> None:
    layout = MarkerLayout()
    (page,) = printed(target_pattern(layout), paper=paper)
    found = find_markers(page.image(), side_m=layout.side_m)
    assert set(found) == {0, 1, 2}
    for role in Role:
        apart_mm = (middle_px(found[layout.id_of(role)]) - middle_px(found[0])) / PX_PER_MM
        np.testing.assert_allclose(apart_mm, 1e3 * layout.middle_m(role), atol=TRUE_MM)


def test_every_sheet_has_a_ruler_of_100_mm_and_says_what_it_is() -> None:
    board = Checkerboard(columns=9, rows=6, square_m=0.036)
    pages = printed(board_pattern(board))
    for number, page in enumerate(pages, start=1):
        base_mm, *ticks_mm = page.lines_mm[8:]
        assert base_mm[2] - base_mm[0] == pytest.approx(100.0, abs=1e-3)
        np.testing.assert_allclose(np.diff([tick[0] for tick in ticks_mm]), 10.0, atol=1e-3)
        assert page.words[1].startswith(f"a pattern; sheet {number} of 4, row ")
        assert page.black_mm[:, 3].max() < page.lines_mm[8:, 1::2].min()


def test_a_board_of_several_sheets_is_whole_when_they_are_cut_and_joined() -> None:
    board = Charuco(columns=9, rows=6, square_m=0.036, marker_m=0.027)
    pages = printed(board_pattern(board))
    assert len(pages) == 4
    assert_true(joined(pages, columns=2), board)


def test_a_cut_leaves_markers_whole_where_it_can() -> None:
    pages = printed(target_pattern(MarkerLayout(spacing_m=0.150)), paper="Letter")
    assert [set(find_markers(page.image())) for page in pages] == [{1}, {0}, {2}]


def test_a_marker_larger_than_the_paper_is_cut_where_the_paper_ends() -> None:
    pages = printed(marker_pattern(7, side_m=0.300))
    assert len(pages) == 4
    assert set(find_markers(joined(pages, columns=2))) == {7}


@pytest.mark.parametrize(
    ("paper", "square_m", "remedy"),
    [
        ("A4", 0.070, "choose A3, or smaller"),
        ("A4", 0.120, "choose smaller"),
        ("A3", 0.120, "choose smaller"),
    ],
)
def test_a_pattern_of_more_than_nine_sheets_is_refused_with_the_remedy(
    paper: str, square_m: float, remedy: str
) -> None:
    pattern = board_pattern(Checkerboard(columns=9, rows=9, square_m=square_m))
    with pytest.raises(InvalidInput, match=rf"00 mm needs \d+ sheets of {paper}, .*{remedy}"):
        printed(pattern, paper=paper)


def test_a_paper_that_is_not_known_is_refused() -> None:
    with pytest.raises(InvalidInput, match="A4, A3, Letter"):
        printed(marker_pattern(0, side_m=0.060), paper="B5")


def test_the_sheets_are_counted_in_words() -> None:
    one = lay_out(marker_pattern(0, side_m=0.06), paper="A4", margin_m=0.01, words="a marker")
    four = lay_out(marker_pattern(0, side_m=0.30), paper="A4", margin_m=0.01, words="a marker")
    assert sheets_words(one, paper="A4") == "1 sheet of A4, portrait"
    assert sheets_words(four, paper="A4") == "4 sheets of A4, portrait"


def test_a_reader_finds_every_object_of_the_file_and_prints_it_unscaled() -> None:
    sheets = lay_out(marker_pattern(0, side_m=0.06), paper="A4", margin_m=0.01, words="50 % (half)")
    content = pattern_pdf(sheets, title="50 % (half)")
    assert content.startswith(b"%PDF-1.7\n")
    assert content.endswith(b"%%EOF\n")
    assert b"/PrintScaling /None" in content
    assert rb"(50 % \(half\))" in content
    start = int(re.findall(rb"startxref\n(\d+)\n", content)[0])
    assert content[start:].startswith(b"xref\n")
    offsets = re.findall(rb"(\d{10}) 00000 n \n", content)
    for number, offset in enumerate(offsets, start=1):
        assert content[int(offset) :].startswith(f"{number} 0 obj\n".encode())
    for length, stream in re.findall(rb"/Length (\d+) >>\nstream\n(.*?)\nendstream", content, re.DOTALL):
        assert len(stream) == int(length)
