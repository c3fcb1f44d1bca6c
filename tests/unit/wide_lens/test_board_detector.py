"""Boards in pictures that the test draws itself, through a lens that bends."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.board_scenes import SMALL, DivisionLens, Pose, board_picture, board_points_m

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.board_detector import detect_board, explain_absence
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard

pytestmark = pytest.mark.slow

TILTED = Pose(place_m=(0.03, -0.02, 1.1), turn_rad=(0.35, -0.3, 0.1))
CHECKERBOARD, CHARUCO = Checkerboard(), Charuco()


@pytest.fixture(scope="module", params=[CHECKERBOARD, CHARUCO], ids=["checkerboard", "charuco"])
def shown(request: pytest.FixtureRequest) -> tuple[Board, NDArray[np.uint8]]:
    board: Board = request.param
    return board, board_picture(board, TILTED)


def _errors(board: Board, picture: NDArray[np.uint8], effort: str) -> NDArray[np.float64]:
    view = detect_board(picture, board, effort="live" if effort == "live" else "exact")
    assert view is not None
    truth = DivisionLens().pixels(board_points_m(board, view.places_m, TILTED))
    return np.asarray(view.corners_px - truth)


def test_corners_are_found_to_a_hundredth_of_a_pixel(shown: tuple[Board, NDArray[np.uint8]]) -> None:
    errors = _errors(*shown, "exact")
    assert len(errors) >= 48
    assert np.sqrt(np.mean(errors**2)) < 0.01  # 2 grey levels of noise on 150 of contrast over some 300 px


def test_the_quick_search_is_good_enough_to_see_that_a_board_is_still(
    shown: tuple[Board, NDArray[np.uint8]],
) -> None:
    assert np.abs(_errors(*shown, "live")).max() < 0.2


@pytest.mark.parametrize("size", [(8, 6), (10, 6), (5, 4)])
def test_a_checkerboard_of_another_size_is_not_taken_for_it_and_named(size: tuple[int, int]) -> None:
    picture = board_picture(CHECKERBOARD, TILTED)
    other = Checkerboard(columns=size[0], rows=size[1])
    assert detect_board(picture, other, effort="thorough") is None
    assert "9 x 6 inner corners was found" in explain_absence(picture, other)


def test_a_charuco_board_of_another_width_is_not_taken_for_it_and_named() -> None:
    picture = board_picture(CHARUCO, TILTED, lens=SMALL)
    other = dataclasses.replace(CHARUCO, columns=8)
    assert detect_board(picture, other) is None
    assert "not placed as on a ChArUco board of 8 x 6" in explain_absence(picture, other)


def test_a_charuco_board_is_not_taken_for_a_plain_one_and_named() -> None:
    assert detect_board(board_picture(CHARUCO, TILTED), CHECKERBOARD) is None
    words = explain_absence(board_picture(CHARUCO, TILTED, lens=SMALL), CHECKERBOARD)
    assert "markers of the dictionary 4X4_50 were found: describe a ChArUco board" in words


def test_a_plain_board_is_not_taken_for_a_charuco_board_and_named() -> None:
    picture = board_picture(CHECKERBOARD, TILTED, lens=SMALL)
    assert detect_board(picture, CHARUCO) is None
    assert "without its markers" in explain_absence(picture, CHARUCO)


def test_a_charuco_board_half_out_of_the_image_still_counts_where_it_is_seen() -> None:
    pose = Pose(place_m=(0.24, 0.0, 1.1), turn_rad=(0.1, 0.2, 0.0))
    view = detect_board(board_picture(CHARUCO, pose), CHARUCO)
    assert view is not None
    assert len(view.ids) < CHARUCO.corners
    truth = DivisionLens().pixels(board_points_m(CHARUCO, view.places_m, pose))
    assert np.abs(view.corners_px - truth).max() < 0.06


def test_an_empty_wall_shows_no_board() -> None:
    rng = np.random.default_rng(5)
    wall = np.asarray(rng.integers(90, 130, (540, 720)), dtype=np.uint8)
    for board in (CHECKERBOARD, CHARUCO):
        assert detect_board(wall, board) is None
        assert "nothing like a board" in explain_absence(wall, board)


def test_a_colour_image_is_refused() -> None:
    with pytest.raises(InvalidInput, match="grey image"):
        detect_board(np.zeros((10, 10, 3), dtype=np.uint8), CHARUCO)


NAMED = [
    (
        Charuco(dictionary="6X6_250"),
        CHARUCO,
        "dictionary 6X6_50 were found, placed as on a ChArUco board of 9 x 6",
    ),
    (Charuco(rows=7, legacy_pattern=True), Charuco(rows=7), r"9 x 7 inner corners (4X4_50, legacy pattern)"),
    (Charuco(columns=6, rows=9), CHARUCO, "placed as on a ChArUco board of 6 x 9"),
]


@pytest.mark.parametrize(("printed", "described", "words"), NAMED)
def test_a_charuco_board_of_another_kind_is_found_when_described_and_named_otherwise(
    printed: Charuco, described: Charuco, words: str
) -> None:
    picture = board_picture(printed, TILTED, lens=SMALL)
    assert detect_board(picture, printed) is not None
    assert detect_board(picture, described) is None
    assert words in explain_absence(picture, described)
