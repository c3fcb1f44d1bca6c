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
    assert np.linalg.norm(flat - CORNERS_PX, axis=1).max() > 0.35 * found.pitches_px(PLACES).min()
    off_px = np.linalg.norm(found.pixels(PLACES) - CORNERS_PX, axis=1)
    assert (off_px < 0.15 * found.pitches_px(PLACES)).all()


def test_confused_corners_are_not_explained_by_a_bend() -> None:
    swapped = CORNERS_PX.copy()
    swapped[[20, 21]] = swapped[[21, 20]]
    found = fit_board_map(PLACES, swapped)
    assert found is not None
    off_px = np.linalg.norm(found.pixels(PLACES) - swapped, axis=1)
    assert (off_px > 0.35 * found.pitches_px(PLACES)).any()


def test_squares_are_measured_where_they_are_seen() -> None:
    """A steep near view: the first square is seen at less than half of the last one's size."""
    pinhole = DivisionLens(focal_px=260.0, centre_px=(322.0, 241.0), bend=0.0, width=640, height=480)
    steep = Pose(place_m=(0.05, 0.03, 0.2), turn_rad=(-0.3, 0.7, 0.1))
    corners_px = pinhole.pixels(board_points_m(BOARD, BOARD.places_m(), steep))
    found = fit_board_map(PLACES, corners_px)
    assert found is not None
    step = 0.01  # squares: the area of a small parallelogram at each corner, by the map itself
    right, down = (found.pixels(PLACES + at) - found.pixels(PLACES) for at in ([step, 0.0], [0.0, step]))
    areas = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0]) / step**2
    np.testing.assert_allclose(found.pitches_px(PLACES), np.sqrt(areas), rtol=0.02)
    assert found.pitches_px(PLACES).max() > 2.0 * found.pitches_px(PLACES).min()


def test_few_corners_are_mapped_by_the_homography_alone() -> None:
    found = fit_board_map(PLACES[:18], CORNERS_PX[:18])
    assert found is not None
    assert not found.bend_px.any()
