"""What a scene file has for calibrating: boards, how they are shown, and the stations."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput, PanTiltPose, Station, StationTarget
from foveacam_hardware.sim.render.materials import CellSurface
from foveacam_hardware.sim.scenes.build import build_scene
from foveacam_hardware.sim.scenes.format import SceneFile
from foveacam_hardware.sim.scenes.loader import load_scene
from foveacam_hardware.sim.scenes.motion import pose

BOARD = """
format = "foveacam-scene"
version = 1
[materials]
charuco = { kind = "charuco", columns = 10, rows = 7, square_m = 0.03 }
[[objects]]
name = "board"
shape = "quad"
material = "charuco"
position_m = [1, 0, 2]
rotation_deg = [0, 90, 0]
size_m = [0.4, 0.3]
[objects.motion]
kind = "show"
hold_s = 0.5
move_s = 0.25
poses = [
    { at_m = [0, 0, 1] },
    { at_m = [0, 0, 2], turn_deg = [0, 30, 0] },
    { at_m = [0.4, 0, 2], turn_deg = [10, 0, -20] },
]
"""
STATION = '[[stations]]\nname = "far"\ntarget = "markers"\npan_deg = -45.0\ntilt_deg = 3\ndistance_m = 5\n'


def loaded(folder: Path, text: str) -> SceneFile:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def test_the_room_to_calibrate_in_has_boards_and_markers_at_two_distances() -> None:
    file = load_scene("calibration")
    stations = {table.name: table.station() for table in file.stations}

    assert set(stations) == {"board", "checkerboard", "fovea boards", "markers", "markers near"}
    assert [station.target for station in stations.values()].count(StationTarget.BOARD) == 3
    assert stations["markers"].distance_m == 5.0
    assert stations["markers near"].distance_m == 2.5
    assert build_scene(file, folder=Path()).names == tuple(thing.name for thing in file.objects)


def test_a_station_is_told_in_degrees_and_known_in_radians(tmp_path: Path) -> None:
    file = loaded(tmp_path, BOARD + STATION)

    assert file.stations[0].station() == Station(
        name="far",
        target=StationTarget.MARKERS,
        pose=PanTiltPose(pan_rad=float(np.deg2rad(-45.0)), tilt_rad=float(np.deg2rad(3.0))),
        distance_m=5.0,
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"markers"', '"marker"', ["'far'", "target", "'markers'", "marker"]),
        ("pan_deg = -45.0", "pan_rad = -0.7", ["'far'", "pan_rad"]),
        ("distance_m = 5", "distance_m = 0", ["'far'", "distance_m", "greater than 0"]),
        ("distance_m = 5", 'distance_m = 5\n[[stations]]\nname = "far"\ntarget = "board"\npan_deg = 0.0',
         ["'far'", "twice"]),
    ],
)  # fmt: skip
def test_a_wrong_station_is_refused_by_name_and_key(
    tmp_path: Path, old: str, new: str, words: list[str]
) -> None:
    with pytest.raises(InvalidInput) as caught:
        loaded(tmp_path, BOARD + STATION.replace(old, new))

    for word in ["mine.toml", *words]:
        assert word in str(caught.value)


def test_a_charuco_board_is_the_one_that_opencv_prints(tmp_path: Path) -> None:
    material = build_scene(loaded(tmp_path, BOARD), folder=tmp_path).material(0)
    assert isinstance(material, CellSurface)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    printed = cv2.aruco.CharucoBoard((10, 7), 0.03, 0.0225, dictionary).generateImage((800, 560))

    drawn = np.kron(material.cells, np.ones((10, 10))) * 255

    assert material.cell_m == pytest.approx(0.03 / 8)
    assert np.array_equal(drawn > 127, np.asarray(printed) > 127)


def test_a_charuco_board_with_more_markers_than_there_are_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"12 x 10 squares take more than the dictionary's 50 markers"):
        loaded(tmp_path, BOARD.replace("columns = 10, rows = 7", "columns = 12, rows = 10"))


def test_a_shown_board_is_exactly_still_while_it_is_held_and_comes_around(tmp_path: Path) -> None:
    board = loaded(tmp_path, BOARD).objects[0]

    assert np.array_equal(pose(board, 0.76), pose(board, 1.2))
    assert np.array_equal(pose(board, 0.0), pose(board, 3 * 0.75))
    assert not np.array_equal(pose(board, 0.51), pose(board, 0.5))


def test_a_shown_board_is_placed_as_seen_from_the_objects_place(tmp_path: Path) -> None:
    board = loaded(tmp_path, BOARD).objects[0]

    held = pose(board, 1.0)  # 2 m in front of somebody at (1, 0, 2) who looks to the right

    assert held[:3, 3] == pytest.approx([3.0, 0.0, 2.0])
    turned_rad = np.deg2rad(120.0)
    assert held[:3, :3] @ [0, 0, 1] == pytest.approx([np.sin(turned_rad), 0.0, np.cos(turned_rad)])


def test_a_shown_board_moves_without_a_jump(tmp_path: Path) -> None:
    board = loaded(tmp_path, BOARD).objects[0]
    places = np.array([pose(board, t_s)[:3] for t_s in np.arange(0.0, 2.5, 0.001)])

    steps_m = np.linalg.norm(np.diff(places[:, :, 3], axis=0), axis=1)
    turns = np.abs(np.diff(places[:, :, :3], axis=0)).max(axis=(1, 2))

    assert steps_m.max() < 1.1 / 0.25 * 1.5 * 0.001  # a metre in a quarter of a second, half as fast again
    assert turns.max() < np.deg2rad(30.0) / 0.25 * 1.5 * 0.001 * 1.5
