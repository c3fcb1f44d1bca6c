"""Calibration boards as values, and as they are drawn."""

import numpy as np
import pytest
from tests.support.scenes.board_scenes import draw_board

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard, board_from


@pytest.mark.parametrize("board", [Checkerboard(columns=9, rows=6), Charuco(columns=9, rows=6)])
def test_a_board_of_9_by_6_corners_has_10_by_7_squares(board: Board) -> None:
    sheet = draw_board(board, square_px=24, margin_px=0)
    assert sheet.shape == (7 * 24, 10 * 24)
    assert sheet[2, 2] == 0, "the first square is black"
    assert sheet[2, 24 + 2] == 255


def test_corners_are_counted_row_by_row_in_metres() -> None:
    places = Checkerboard(columns=4, rows=3, square_m=0.02).places_m()
    assert places.shape == (12, 2)
    np.testing.assert_allclose(places[[0, 3, 4]], [[0.0, 0.0], [0.06, 0.0], [0.0, 0.02]])


def test_a_board_is_named_by_plain_values() -> None:
    assert board_from("checkerboard", columns=9, rows=6, square_m=0.03) == Checkerboard(square_m=0.03)
    assert board_from("charuco", columns=9, rows=6, square_m=0.04) == Charuco(square_m=0.04, marker_m=0.03)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"kind": "chess"}, "'checkerboard' or 'charuco'"),
        ({"columns": 2}, "2 x 6 were given"),
        ({"square_m": 0.0}, "above 0 mm"),
        ({"marker_m": 0.04}, "between 0 and the square's 36 mm"),
        ({"columns": 12, "rows": 9}, "needs 65 markers, dictionary 4X4_50 has 50"),
    ],
)
def test_an_impossible_board_is_refused_by_name(values: dict[str, float], complaint: str) -> None:
    given = {"kind": "charuco", "columns": 9, "rows": 6, "square_m": 0.036, "marker_m": None, **values}
    with pytest.raises(InvalidInput, match=complaint):
        board_from(**given)  # type: ignore[arg-type]  # a mapping of mixed values


def test_an_unknown_dictionary_is_refused_with_those_known() -> None:
    with pytest.raises(InvalidInput, match="4X4_50, 4X4_100"):
        Charuco(dictionary="3X3_9")
