"""The rig that turns on its pan-tilt: a world that stands still, and what is to be seen from the stations."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    PARKED,
    Frame,
    Image,
    PanTilt,
    PanTiltPose,
    Role,
    Station,
    StationTarget,
)
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth

POLL_NS = 20_000_000
EYES = (Role.LEFT, Role.RIGHT)
MARKERS = {Role.WIDE: 0, Role.LEFT: 1, Role.RIGHT: 2}


def grey(image: Image) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def motor(rig: Rig) -> PanTilt:
    assert rig.pan_tilt is not None
    return rig.pan_tilt


def truth(rig: Rig) -> Truth:
    assert rig.truth is not None
    return rig.truth


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=float(np.deg2rad(pan_deg)), tilt_rad=float(np.deg2rad(tilt_deg)))


def rest(rig: Rig) -> None:
    while motor(rig).state.moving:
        rig.clock.sleep_until_ns(rig.clock.now_ns() + POLL_NS)


def turn(rig: Rig, pose: PanTiltPose) -> None:
    if not motor(rig).state.homed:
        motor(rig).home()
        rest(rig)
    motor(rig).move_to(pose)
    rest(rig)


def found(image: Image) -> dict[int, NDArray[np.float64]]:
    """Return the corners (4, 2) of the markers in a picture, px."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    corners, ids, _ = detector.detectMarkers(grey(image))
    if len(corners) == 0:
        return {}
    return {int(k): np.asarray(c, float).reshape(4, 2) for k, c in zip(ids.ravel(), corners, strict=True)}


def station(rig: Rig, name: str) -> Station:
    return next(station for station in rig.stations if station.name == name)


@pytest.fixture(scope="module")
def room() -> Iterator[Rig]:
    rig = open_simulated("calibration", inline=True)
    yield rig
    rig.close()


@pytest.mark.parametrize("scene", ["bench", "street", "calibration"])
def test_every_scene_can_be_turned_in(scene: str) -> None:
    with open_simulated(scene, inline=True) as rig:
        turn(rig, bearing(5.0, -3.0))
        state = motor(rig).state

    assert state.fault is None
    assert rig.problems == ()


def test_a_rig_that_came_back_to_zero_sees_bit_for_bit_what_it_saw_before(room: Rig) -> None:
    turn(room, bearing(0.0, 0.0))
    world = truth(room).world
    t_ns = room.clock.now_ns()
    assert np.array_equal(truth(room).rig_from_world(t_ns), np.eye(4))
    plain = {
        role: world.animated_scene._renderer.radiance(world.projection(role, t_ns)).radiance for role in Role
    }
    turn(room, bearing(9.0, 4.0))
    turn(room, bearing(0.0, 0.0))
    later_s = world.scene_s(room.clock.now_ns())

    for role in Role:
        again = world.animated_scene.radiance(world.projection(role, t_ns), later_s, channels=1)
        assert np.array_equal(again, plain[role])


def test_a_turned_rig_at_rest_keeps_its_pictures(room: Rig) -> None:
    turn(room, bearing(7.0, 2.0))
    world = truth(room).world
    t_ns = room.clock.now_ns()
    wide = world.projection(Role.WIDE, t_ns)

    first = world.animated_scene.radiance(wide, world.scene_s(t_ns), channels=3)
    again = world.animated_scene.radiance(wide, world.scene_s(t_ns + 10_000_000), channels=3)

    assert np.shares_memory(first, again)


def test_the_picture_moves_as_far_as_the_rig_turns(room: Rig) -> None:
    turn(room, bearing(0.0, 0.0))
    before = found(room.head.wide(max_age_ms=0.0).image)[0].mean(axis=0)
    turn(room, bearing(3.0, -2.0))
    after = found(room.head.wide(max_age_ms=0.0).image)[0].mean(axis=0)

    # The lens has 3155 px a radian; the pivot's offset moves a marker at 5 m by a few pixels more.
    moved_deg = np.rad2deg((after - before) / 3155.0)
    assert moved_deg == pytest.approx([-3.0, 2.0], abs=0.15)


def test_truth_and_picture_agree_about_a_turned_rig(room: Rig) -> None:
    turn(room, bearing(-4.0, 3.0))
    frame = room.head.wide(max_age_ms=0.0)
    drawn = found(frame.image)[0].mean(axis=0)
    rig_from_world = truth(room).rig_from_world(frame.t_ns)
    centre_rig_m = rig_from_world[:3, :3] @ np.array([0.0, 0.0, 5.0]) + rig_from_world[:3, 3]

    x_px, y_px = told = truth(room).wide_pixels(centre_rig_m[None])[0]
    seen = truth(room).depth_at(float(x_px), float(y_px), frame.t_ns)

    assert drawn == pytest.approx(told, abs=0.3)
    assert seen is not None
    assert seen.name == "far centre"
    assert seen.point_rig_m == pytest.approx(centre_rig_m, abs=1e-3)


def test_another_seed_stands_on_another_pedestal() -> None:
    first, second = (open_simulated("calibration", inline=True, seed=seed) for seed in (0, 1))
    turned = [truth(rig).world.pedestal.rig_from_world(20.0, 10.0) for rig in (first, second)]
    first.close()
    second.close()

    apart_m = np.linalg.norm(turned[0][:3, 3] - turned[1][:3, 3])
    assert 1e-4 < apart_m < 5e-3
    for matrix in turned:
        assert matrix[:3, :3] @ matrix[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(("name", "side_px"), [("markers", 345.0), ("markers near", 690.0)])
def test_from_a_marker_station_each_camera_sees_its_own_marker_sharp(
    room: Rig, name: str, side_px: float
) -> None:
    there = station(room, name)
    turn(room, there.pose)
    sighting = room.head.look(PARKED)

    assert set(found(sighting.wide.image)) == {0, 1, 2}
    for frame in (sighting.left, sighting.right):
        corners = found(frame.image)[MARKERS[frame.role]]
        sides_px = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        assert sides_px == pytest.approx(side_px, rel=0.02)
        assert (
            edge_width_px(frame, corners) < 4.5
        )  # the diffraction's sigma is 1.4 px: 3.6 px from 10 to 90 %


def edge_width_px(frame: Frame, corners: NDArray[np.float64]) -> float:
    """Return the width of a marker's left edge from 10 to 90 %, px."""
    y = round(float(corners[:, 1].mean()))
    x = round(float(corners[:, 0].min()))
    rows = grey(frame.image)[y - 10 : y + 10, x - 20 : x + 20].astype(float)
    profile = np.sort(rows.mean(axis=0))[::-1]
    share = (profile - profile.min()) / (profile.max() - profile.min())
    return float(np.interp(-0.1, -share, np.arange(40)) - np.interp(-0.9, -share, np.arange(40)))


def test_at_the_board_stations_a_whole_board_is_shown_all_over_the_view(room: Rig) -> None:
    boards = [there for there in room.stations if there.target is StationTarget.BOARD]
    assert [there.name for there in boards] == ["board", "checkerboard", "fovea boards"]
    turn(room, boards[0].pose)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    detector = cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard((10, 7), 0.036, 0.027, dictionary))
    seen = []
    full_size = room.wide.settings
    room.wide.configure(replace(full_size, binning=2))
    for _ in range(40):
        room.clock.sleep_until_ns(room.clock.now_ns() + 2_000_000_000)
        corners = detector.detectBoard(grey(room.head.wide(max_age_ms=40.0).image))[0]
        if corners is not None and len(corners) == 54:
            seen.append(np.asarray(corners).reshape(-1, 2))
    room.wide.configure(full_size)

    assert len(seen) >= 35
    tiles = np.unique(np.floor(np.concatenate(seen) / 60.0), axis=0)
    assert len(tiles) >= 0.9 * 12 * 9


def test_the_checkerboard_stands_still_while_it_is_held(room: Rig) -> None:
    turn(room, station(room, "checkerboard").pose)
    world = truth(room).world
    period_s = 2.0
    next_s = np.ceil(world.scene_s(room.clock.now_ns()) / period_s) * period_s
    looks = []
    for part_s in (0.1, 0.5):
        room.clock.sleep_until_ns(world.t0_ns + round((next_s + part_s) * 1e9))
        ok, corners = cv2.findChessboardCornersSB(grey(room.head.wide(max_age_ms=0.0).image), (9, 6))
        assert ok
        looks.append(np.asarray(corners).reshape(-1, 2))

    assert np.abs(looks[0] - looks[1]).max() < 0.3


def test_a_picture_taken_while_the_rig_turns_is_blurred(room: Rig) -> None:
    turn(room, bearing(-1.0, 0.0))
    sharp = sharpness(room.head.wide(max_age_ms=0.0).image)
    motor(room).move_to(bearing(11.0, 0.0))
    room.clock.sleep_until_ns(room.clock.now_ns() + 240_000_000)

    blurred = sharpness(room.head.wide(max_age_ms=0.0).image)
    rest(room)

    assert blurred < 0.6 * sharp


def sharpness(image: Image) -> float:
    return float(np.abs(cv2.Sobel(grey(image), cv2.CV_64F, 1, 0)).mean())


def test_a_knock_turns_one_eye_about_all_three_axes(room: Rig) -> None:
    world = truth(room).world
    t_ns = room.clock.now_ns()
    points = np.array([[-0.1, 0.0, 5.0], [-0.05, 0.0, 5.0]])
    before = {role: world.projection(role, t_ns).project(points) for role in EYES}
    world.faults.drift_step_rad = {Role.LEFT: (1e-4, -2e-4, 3e-3)}
    after = {role: world.projection(role, t_ns).project(points) for role in EYES}
    world.faults.drift_step_rad = {}

    assert np.array_equal(after[Role.RIGHT], before[Role.RIGHT])
    shift = (after[Role.LEFT] - before[Role.LEFT]) / 28_760.0
    across = (before[Role.LEFT][1] - before[Role.LEFT][0]) / 28_760.0
    turned_rad = (shift[1] - shift[0])[1] / across[0]
    assert shift[0] == pytest.approx([2e-4, 1e-4], abs=3e-5)
    assert turned_rad == pytest.approx(-3e-3, rel=0.05)
