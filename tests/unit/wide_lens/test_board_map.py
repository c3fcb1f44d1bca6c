"""The map from a board to its image, through a lens that bends by half a square."""

import cv2
import numpy as np
import pytest
from tests.support.scenes.board_scenes import DivisionLens, Pose, board_picture, board_points_m

from foveacam_pipeline.calibrate.wide.board_detector import detect_board
from foveacam_pipeline.calibrate.wide.board_map import fit_board_map
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard

SHORT = DivisionLens(focal_px=260.0, centre_px=(322.0, 241.0), bend=-0.6, width=640, height=480)
NEAR = Pose(place_m=(0.0, 0.0, 0.12), turn_rad=(0.1, 0.1, 0.0))
BOARDS: list[Board] = [Checkerboard(square_m=0.025), Charuco(square_m=0.025, marker_m=0.019)]
BOARD = BOARDS[0]
PLACES = BOARD.places_m() / BOARD.square_m
CORNERS_PX = SHORT.pixels(board_points_m(BOARD, BOARD.places_m(), NEAR))


@pytest.mark.parametrize("board", BOARDS)
def test_a_view_that_the_lens_bends_by_half_a_square_is_used_whole(board: Board) -> None:
    view = detect_board(board_picture(board, NEAR, lens=SHORT), board)
    assert view is not None
    assert len(view.ids) == board.corners
    assert np.abs(view.corners_px - CORNERS_PX).max() < 0.1


def test_a_bent_lattice_is_mapped_where_a_homography_is_half_a_square_off() -> None:
    found = fit_board_map(PLACES, CORNERS_PX)
    assert found is not None
    flat = cv2.perspectiveTransform(PLACES[:, None, :], found.plane)[:, 0, :]
    assert np.linalg.norm(flat - CORNERS_PX, axis=1).max() > 0.35 * found.pitch_px
    assert np.linalg.norm(found.pixels(PLACES) - CORNERS_PX, axis=1).max() < 0.15 * found.pitch_px


def test_confused_corners_are_not_explained_by_a_bend() -> None:
    swapped = CORNERS_PX.copy()
    swapped[[20, 21]] = swapped[[21, 20]]
    found = fit_board_map(PLACES, swapped)
    assert found is not None
    assert np.linalg.norm(found.pixels(PLACES) - swapped, axis=1).max() > 0.35 * found.pitch_px


def test_few_corners_are_mapped_by_the_homography_alone() -> None:
    found = fit_board_map(PLACES[:18], CORNERS_PX[:18])
    assert found is not None
    assert not found.bend_px.any()
