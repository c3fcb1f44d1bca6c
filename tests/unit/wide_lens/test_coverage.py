"""Coverage of the image and of tilts."""

import math

import pytest
from tests.support.scenes.board_scenes import Pose, board_view

from foveacam_pipeline.calibrate.wide.board_pose import pose_of_view
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.coverage import CoverageTracker, coverage_of

BOARD = Charuco()


@pytest.mark.parametrize(
    ("turn_rad", "tilt"),
    [
        ((0.0, 0.0, 0.3), "frontal"),
        ((0.5, 0.0, 0.0), "top nearer"),
        ((-0.5, 0.0, 0.0), "bottom nearer"),
        ((0.0, 0.5, 0.0), "right side nearer"),
        ((0.0, -0.5, 0.0), "left side nearer"),
    ],
)
def test_a_tilt_is_named_by_the_side_that_is_nearer(turn_rad: tuple[float, float, float], tilt: str) -> None:
    pose = Pose(place_m=(0.0, 0.0, 1.2), turn_rad=turn_rad)
    depth_of_first_corner = (pose.rotation @ [-1.0, -1.0, 0.0])[2]  # the first corner is left and above
    if tilt != "frontal":
        assert (depth_of_first_corner < 0.0) == (tilt in ("top nearer", "left side nearer"))
    found = pose_of_view(board_view(BOARD, pose))
    assert found.tilt == tilt
    assert found.tilt_rad == pytest.approx(math.hypot(*turn_rad[:2]), abs=0.02)


def test_a_board_in_one_corner_covers_only_that() -> None:
    cover = coverage_of([board_view(BOARD, Pose(place_m=(-0.25, -0.2, 2.0)))])
    assert cover.cells[:5, :6].sum() == cover.cells.sum()
    assert 0.05 < cover.fraction < 0.3
    assert cover.tilts_covered == 1
    assert "not shown yet: left side nearer" in str(cover)


def test_the_same_view_again_adds_nothing_but_a_tilted_one_does() -> None:
    covering = CoverageTracker([board_view(BOARD, Pose(place_m=(0.0, 0.0, 1.0)))])
    assert not covering.is_new(board_view(BOARD, Pose(place_m=(0.002, 0.0, 1.0)), noise_px=0.05))
    assert covering.is_new(board_view(BOARD, Pose(place_m=(0.0, 0.0, 1.05), turn_rad=(0.3, 0.0, 0.0))))
    assert covering.is_new(board_view(BOARD, Pose(place_m=(0.2, 0.0, 1.4))))
