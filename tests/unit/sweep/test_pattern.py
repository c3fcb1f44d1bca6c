"""Calibration patterns in true millimetres: as they are drawn for print, and as the detectors find them."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.board_scenes import draw_board

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.pattern import (
    Pattern,
    board_pattern,
    marker_pattern,
    pattern_svg,
    target_pattern,
)
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.calibrate.wide.board_detector import detect_board
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard

PX_PER_M = 4000.0
"""Every cell of the patterns here is a whole number of pixels."""
ALL_BOARDS = [
    Checkerboard(columns=9, rows=6, square_m=0.020),
    Charuco(columns=9, rows=6, square_m=0.020, marker_m=0.015),
    Charuco(columns=5, rows=7, square_m=0.012, marker_m=0.009),
]


def raster(pattern: Pattern) -> NDArray[np.uint8]:
    """Return a pattern as an image, (h, w)."""
    size = round(pattern.height_m * PX_PER_M), round(pattern.width_m * PX_PER_M)
    image = np.full(size, 255, dtype=np.uint8)
    for left, top, right, bottom in np.rint(pattern.black_m * PX_PER_M).astype(int).tolist():
        image[top:bottom, left:right] = 0
    return image


@pytest.mark.parametrize("board", ALL_BOARDS, ids=str)
def test_a_board_is_the_one_that_is_printed(board: Board) -> None:
    square_px = round(board.square_m * PX_PER_M)
    printed = draw_board(board, square_px=square_px, margin_px=square_px // 2)
    np.testing.assert_array_equal(raster(board_pattern(board)), printed)


@pytest.mark.parametrize("board", ALL_BOARDS, ids=str)
def test_the_detector_finds_every_corner_a_square_apart(board: Board) -> None:
    found = detect_board(raster(board_pattern(board)), board)
    assert found is not None
    assert len(found.corners_px) == board.corners
    rows = found.corners_px.reshape(board.rows, board.columns, 2)
    step_px = np.linalg.norm(np.diff(rows, axis=1), axis=2)
    np.testing.assert_allclose(step_px, board.square_m * PX_PER_M, atol=0.1)


def test_the_target_has_each_camera_s_marker_in_its_place() -> None:
    layout = MarkerLayout(side_m=0.030, spacing_m=0.070)
    found = find_markers(raster(target_pattern(layout)), side_m=layout.side_m)
    assert set(found) == {0, 1, 2}
    wide_px = middle_px(found[0])
    for role in Role:
        apart_m = (middle_px(found[layout.id_of(role)]) - wide_px) / PX_PER_M
        np.testing.assert_allclose(apart_m, layout.middle_m(role), atol=0.1 / PX_PER_M)


def test_one_marker_is_as_large_as_asked_with_a_white_edge() -> None:
    pattern = marker_pattern(7, side_m=0.060)
    assert (pattern.width_m, pattern.height_m) == pytest.approx((0.080, 0.080))
    assert pattern.black_m.min() == pytest.approx(0.010)
    assert pattern.black_m.max() == pytest.approx(0.070)
    assert set(find_markers(raster(pattern))) == {7}


def test_a_marker_that_the_dictionary_lacks_is_refused() -> None:
    with pytest.raises(InvalidInput, match="0 to 49"):
        marker_pattern(50, side_m=0.06)


def test_the_svg_states_its_size_in_millimetres_and_holds_the_rectangles() -> None:
    board = Charuco(columns=4, rows=3, square_m=0.0203, marker_m=0.015)
    pattern = board_pattern(board)
    image = pattern_svg(pattern, title="a board")
    assert 'width="121.8mm" height="101.5mm" viewBox="0 0 121.8 101.5"' in image
    drawn = re.findall(r"M([\d.]+) ([\d.]+)H([\d.]+)V([\d.]+)H[\d.]+z", image)
    black_mm = np.array(drawn, dtype=np.float64)
    np.testing.assert_allclose(black_mm, 1e3 * pattern.black_m, atol=1e-4)
