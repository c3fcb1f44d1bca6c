"""Where viewers of the 3D scene are put: before a point, over everything, at the rig."""

import asyncio
import math
from typing import cast

import numpy as np
import pytest
import viser

from foveacam_web import scene_viewpoints
from foveacam_web.scene_values import Point, RigShape
from foveacam_web.scene_viewpoints import (
    START_FOV_RAD,
    Pose,
    Viewpoints,
    pose_at_rig,
    pose_before,
    pose_over,
)


def share_of_half_view(pose: Pose, point_rig_m: Point, *, aspect: float = 1.5) -> tuple[float, float]:
    """Return where a point appears, across and down, in halves of the view; y is down, the camera level."""
    ahead = pose.look_at_m - pose.position_m
    ahead /= np.linalg.norm(ahead)
    right = np.cross((0.0, 1.0, 0.0), ahead)
    right /= np.linalg.norm(right)
    seen = np.asarray(point_rig_m) - pose.position_m
    half = math.tan(pose.fov_rad / 2.0) * float(seen @ ahead)
    assert half > 0.0
    return float(seen @ right) / (aspect * half), float(seen @ np.cross(ahead, right)) / half


@pytest.mark.parametrize("distance_m", [0.5, 2.0, 35.0])
def test_a_fovea_fills_a_good_part_of_the_view_before_a_point_without_a_shape(distance_m: float) -> None:
    pose = pose_before((0.1 * distance_m, 0.0, distance_m))
    half_field_m = math.tan(math.radians(2.15 / 2.0)) * distance_m
    _, top = share_of_half_view(pose, (0.1 * distance_m, -half_field_m, distance_m))
    _, bottom = share_of_half_view(pose, (0.1 * distance_m, half_field_m, distance_m))
    assert 0.35 < (bottom - top) / 2.0 < 0.5


@pytest.mark.parametrize("height", [0.01, 0.03, 0.06])
def test_a_shape_fills_a_good_part_of_the_view_before_it_wherever_its_target_is(height: float) -> None:
    distance_m, middle = 4.0, np.array([0.5, 0.3, 4.0])
    size_m = np.array([0.1, height * distance_m, 0.2])
    shape = np.random.default_rng(3).uniform(middle - size_m / 2, middle + size_m / 2, (4000, 3))
    pose = pose_before((0.52, 0.3, 4.0), shape.astype(np.float32))
    places = np.array([share_of_half_view(pose, (x, y, z)) for x, y, z in shape])
    assert 0.35 < np.ptp(places[:, 1]) / 2.0 < 0.75
    assert np.abs(places.mean(axis=0)).max() < 0.05


@pytest.mark.parametrize(
    "points",
    [
        [(0.0, 0.0, 2.0)],
        [(-0.5, 0.2, 2.0), (0.9, -0.6, 8.0), (0.1, 0.0, 3.5)],
        [(0.0, 0.0, 1.0), (4.0, -2.0, 35.0)],
    ],
)
def test_everything_is_in_the_view_over_everything_and_fills_a_good_part_of_it(points: list[Point]) -> None:
    pose = pose_over(points)
    places = np.abs([share_of_half_view(pose, point) for point in points])
    assert places.max() <= 0.81
    if len(points) > 1:
        assert places.max() >= 0.3 or pose.fov_rad == pytest.approx(0.35)


def test_the_view_from_the_rig_has_the_wide_camera_s_field() -> None:
    shape = RigShape(baseline_m=0.2, wide_fov_rad=(0.447, 0.339), fovea_fov_rad=(0.05, 0.04))
    pose = pose_at_rig(shape)
    assert not pose.position_m.any() and pose.look_at_m[:2] == pytest.approx(0.0)
    assert 1.0 < pose.fov_rad / 0.339 < 1.2
    assert pose_at_rig(None).fov_rad == START_FOV_RAD


class _Camera:
    """A viewer's camera, as its page reports it."""

    def __init__(self) -> None:
        self.position = np.array([0.0, 0.0, -1.0])
        self.look_at = np.array([0.0, 0.0, 3.0])
        self.up_direction: object = None
        self.fov = START_FOV_RAD

    def on_update(self, callback: object) -> object:
        return callback


class _Viewer:
    client_id = 7

    def __init__(self) -> None:
        self.camera = _Camera()

    def atomic(self) -> "_Viewer":
        return self

    def __enter__(self) -> None:
        return

    def __exit__(self, *_: object) -> None:
        return


@pytest.fixture
def viewer() -> viser.ClientHandle:
    return cast(viser.ClientHandle, _Viewer())


TARGET, OTHER = pose_before((0.0, 0.0, 2.0)), pose_before((0.5, 0.0, 5.0))


def _led(viewpoints: Viewpoints, viewer: viser.ClientHandle, pose: Pose) -> bool:
    asyncio.run(viewpoints.lead(viewer, pose))
    return bool(np.allclose(viewer.camera.position, pose.position_m))


def test_a_viewer_is_led_until_its_person_moves_the_camera_and_again_once_that_person_asks(
    viewer: viser.ClientHandle,
) -> None:
    viewpoints = Viewpoints()
    viewpoints.join(viewer)
    assert _led(viewpoints, viewer, TARGET)
    assert _led(viewpoints, viewer, OTHER)
    viewer.camera.position = np.array([0.0, -0.5, 1.0])  # dragged
    assert viewpoints.has_moved(viewer)
    assert not _led(viewpoints, viewer, TARGET)
    asyncio.run(viewpoints.place(viewer, OTHER))  # the person asked for it
    assert _led(viewpoints, viewer, TARGET)


def test_a_late_report_of_a_pose_on_the_way_is_no_move_of_the_person(
    viewer: viser.ClientHandle,
) -> None:
    viewpoints = Viewpoints()
    viewpoints.join(viewer)
    begun = Pose(position_m=np.array(viewer.camera.position), look_at_m=np.array(viewer.camera.look_at))
    asyncio.run(viewpoints.lead(viewer, TARGET))
    midway = begun.towards(TARGET, 0.648)  # eased: the third of five poses
    viewer.camera.position, viewer.camera.look_at = midway.position_m, midway.look_at_m
    assert not viewpoints.has_moved(viewer)


class _Server:
    """A server whose new viewers begin before `TARGET`."""

    def __init__(self) -> None:
        self.initial_camera = _Camera()
        self.initial_camera.position, self.initial_camera.look_at = TARGET.position_m, TARGET.look_at_m
        self.on_client_connect = self.on_client_disconnect = lambda callback: callback


def test_a_page_that_places_its_camera_late_is_still_led(viewer: viser.ClientHandle) -> None:
    viewpoints = Viewpoints()
    viewpoints.open(cast(viser.ViserServer, _Server()))
    viewpoints.join(viewer)
    viewer.camera.position, viewer.camera.look_at = TARGET.position_m, TARGET.look_at_m  # a slow page
    assert not viewpoints.has_moved(viewer)
    assert _led(viewpoints, viewer, OTHER)


@pytest.mark.parametrize(
    ("look_at", "stays", "placed"),
    [((0.0, 0.0, 0.0), True, True), ((0.0, 0.0, 3.0), True, False), ((0.0, 0.0, 0.0), False, False)],
    ids=["missed", "placed by its page", "gone meanwhile"],
)
def test_a_viewer_whose_page_missed_its_first_place_is_put_there(
    viewer: viser.ClientHandle, monkeypatch: pytest.MonkeyPatch, look_at: Point, stays: bool, placed: bool
) -> None:
    monkeypatch.setattr(scene_viewpoints, "PLACED_S", 0.0)
    viewpoints = Viewpoints()
    viewpoints.open(cast(viser.ViserServer, _Server()))
    viewer.camera.look_at = np.array(look_at)
    if stays:
        viewpoints.join(viewer)
    asyncio.run(viewpoints.place_if_missed(viewer))
    assert bool(np.allclose(viewer.camera.look_at, TARGET.look_at_m)) is placed


def test_a_viewer_that_left_is_forgotten(viewer: viser.ClientHandle) -> None:
    viewpoints = Viewpoints()
    viewpoints.join(viewer)
    viewpoints.leave(viewer)
    assert viewpoints.has_moved(viewer)  # nothing is known of it
