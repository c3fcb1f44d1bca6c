"""Visibility, depth and identity of the renderer, against geometry worked out by hand."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import (
    Box,
    NoiseSurface,
    PlainSurface,
    Projection,
    Quad,
    Radiance,
    RayTable,
    Renderer,
    Scene,
    flat,
    ground,
    place,
    sphere,
)

WIDTH, HEIGHT, F_PX = 150, 100, 220.0
F64 = NDArray[np.float64]


def pinhole(
    *, C: tuple[float, float, float] = (0.0, 0.0, 0.0), rays: RayTable | None = None, R: F64 | None = None
) -> Projection:
    K = np.array([[F_PX, 0.0, (WIDTH - 1) / 2], [0.0, F_PX, (HEIGHT - 1) / 2], [0.0, 0.0, 1.0]])
    M = K if R is None else K @ R
    return Projection(M=M, C=np.array(C), width=WIDTH, height=HEIGHT, rays=rays)


def seen(scene: Scene, projection: Projection, *, channels: int = 1) -> Radiance:
    with Renderer(scene, threads=1) as renderer:
        return renderer.radiance(projection, channels=channels)


def grid() -> F64:
    y, x = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    return np.column_stack([x, y]).astype(np.float64)


def plane_depth(projection: Projection, pose: F64) -> F64:
    """Depth (h, w) of the plane z = 0 of an object, along every pixel's ray."""
    rays = projection.rays_at(grid())
    depth: F64 = (pose[:3, 2] @ (pose[:3, 3] - projection.C)) / (rays @ pose[:3, 2])
    return depth.reshape(HEIGHT, WIDTH)


def test_depth_of_an_oblique_wall_is_that_of_its_plane_to_float32() -> None:
    pose = place((0.3, -0.2, 6.0), yaw_rad=0.7, pitch_rad=0.3)
    scene = Scene()
    scene.add(Quad(width_m=30.0, height_m=30.0), NoiseSurface(), pose, "wall")
    projection = pinhole(C=(0.1, 0.05, -0.4))

    depth = seen(scene, projection).depth_m

    assert np.max(np.abs(depth / plane_depth(projection, pose) - 1.0)) < 2e-7


def test_a_floor_that_runs_under_and_behind_the_camera_ends_at_the_horizon() -> None:
    scene = Scene()
    scene.add(ground(width_m=2000.0, length_m=2000.0), NoiseSurface(), flat((0.0, 1.0, 0.0)), "floor")

    frame = seen(scene, pinhole())

    below = np.arange(HEIGHT) > HEIGHT / 2 + 1
    assert (frame.ids[below] == 0).all()
    assert (frame.ids[: HEIGHT // 2 - 1] == -1).all()
    truth = F_PX / (np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    assert np.allclose(frame.depth_m[below], truth[below, None], rtol=1e-6)


def test_what_is_behind_or_nearer_than_the_near_plane_is_not_drawn() -> None:
    scene = Scene()
    scene.add(Quad(width_m=5.0, height_m=5.0), PlainSurface(), place((0.0, 0.0, -2.0)), "behind")
    scene.add(Quad(width_m=5.0, height_m=5.0), PlainSurface(), place((0.0, 0.0, 0.01)), "too near")

    frame = seen(scene, pinhole())

    assert (frame.ids == -1).all()
    assert np.isinf(frame.depth_m).all()


@pytest.mark.parametrize("near_first", [True, False])
def test_the_nearer_object_hides_the_farther_whatever_the_order(near_first: bool) -> None:
    scene = Scene()
    things = [(Quad(width_m=1.0, height_m=1.0), 3.0, "near"), (Quad(width_m=9.0, height_m=9.0), 5.0, "far")]
    for shape, z_m, name in things if near_first else things[::-1]:
        scene.add(shape, PlainSurface(), place((0.0, 0.0, z_m)), name)

    frame = seen(scene, pinhole())

    assert scene.names[frame.ids[HEIGHT // 2, WIDTH // 2]] == "near"
    assert scene.names[frame.ids[5, 5]] == "far"
    assert frame.depth_m[HEIGHT // 2, WIDTH // 2] == pytest.approx(3.0, rel=1e-6)


def test_intersecting_walls_meet_where_their_depths_are_equal() -> None:
    left, right = place((0.0, 0.0, 5.0), yaw_rad=0.5), place((0.0, 0.0, 5.0), yaw_rad=-0.5)
    scene = Scene()
    scene.add(Quad(width_m=20.0, height_m=20.0), PlainSurface(), left, "left")
    scene.add(Quad(width_m=20.0, height_m=20.0), PlainSurface(), right, "right")
    projection = pinhole()

    frame = seen(scene, projection)

    a, b = plane_depth(projection, left), plane_depth(projection, right)
    assert np.allclose(frame.depth_m, np.minimum(a, b), rtol=1e-6)
    assert ((frame.ids == 0) == (a < b)).all()


def test_depth_of_a_sphere_lies_between_its_surface_and_its_facets() -> None:
    radius_m = 0.5
    scene = Scene()
    scene.add(sphere(radius_m=radius_m, rings=64), NoiseSurface(), place((0.1, 0.1, 3.0)), "ball")
    projection = pinhole()

    frame = seen(scene, projection)

    hit = frame.ids.ravel() == 0
    points = projection.points(grid()[hit], frame.depth_m.ravel()[hit])
    distance_m = np.linalg.norm(points - [0.1, 0.1, 3.0], axis=1)
    sagitta_m = radius_m * (1 - np.cos(np.pi / 64) * np.cos(np.pi / 128))
    assert distance_m.max() < radius_m + 1e-6
    assert distance_m.min() > radius_m - 2 * sagitta_m
    area_px = np.pi * (F_PX * radius_m / 3.0) ** 2
    assert hit.sum() == pytest.approx(area_px, rel=0.06)


def test_range_is_the_distance_along_the_ray() -> None:
    projection = pinhole(C=(1.0, 2.0, 3.0))
    pixels, depth_m = np.array([[0.0, 0.0], [100.0, 60.0]]), np.array([4.0, 7.0])

    points = projection.points(pixels, depth_m)

    expected = np.linalg.norm(points - projection.C, axis=1)
    assert np.allclose(projection.range_m(pixels, depth_m), expected, rtol=1e-12)
    assert np.allclose(projection.project(points), pixels, atol=1e-9)
    assert np.allclose(points[:, 2] - projection.C[2], depth_m)


def mixed_scene() -> Scene:
    scene = Scene()
    scene.add(ground(width_m=30.0, length_m=30.0), NoiseSurface(seed=1), flat((0.0, 1.0, 10.0)), "floor")
    scene.add(
        Box(width_m=1.0, height_m=1.0, depth_m=1.0),
        NoiseSurface(seed=2),
        place((-0.6, 0.4, 4.0), yaw_rad=0.5),
        "box",
    )
    scene.add(sphere(radius_m=0.5), NoiseSurface(seed=3), place((0.6, 0.2, 3.5)), "ball")
    return scene


def test_a_camera_seen_in_a_mirror_sees_the_flipped_image() -> None:
    flip = np.array([[-1.0, 0.0, WIDTH - 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    straight = pinhole()
    mirrored = Projection(M=flip @ straight.M, C=straight.C, width=WIDTH, height=HEIGHT)
    assert np.linalg.det(mirrored.M) < 0 < np.linalg.det(straight.M)

    a, b = seen(mixed_scene(), straight), seen(mixed_scene(), mirrored)

    assert (a.ids == b.ids[:, ::-1]).mean() > 0.9995
    same = a.ids == b.ids[:, ::-1]
    assert np.allclose(a.depth_m[same], b.depth_m[:, ::-1][same], rtol=1e-5)
    difference = np.abs(a.radiance - b.radiance[:, ::-1])
    assert np.sqrt((difference**2).mean()) < 0.004
    assert (difference > 0.05).mean() < 0.001


def test_a_folded_camera_sees_a_point_where_the_law_of_reflection_puts_it() -> None:
    mirror_m, normal = (
        np.array([0.1, 0.0, 0.04]),
        np.array([1.0, 0.05, -1.0]) / np.linalg.norm([1.0, 0.05, -1.0]),
    )
    reflect = np.eye(3) - 2 * np.outer(normal, normal)
    camera_m = np.array([0.06, 0.0, 0.04])
    R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # looks along +x, into the mirror
    folded = pinhole(C=tuple(mirror_m + reflect @ (camera_m - mirror_m)), R=R @ reflect)
    ball_m = np.array([0.2, -0.1, 3.0])
    scene = Scene()
    scene.add(sphere(radius_m=0.05, rings=16), PlainSurface(), place(ball_m), "ball")

    frame = seen(scene, folded)

    # By hand: the mirror image of the ball, seen by the real camera.
    image_m = mirror_m + reflect @ (ball_m - mirror_m)
    direct = pinhole(C=tuple(camera_m), R=R).project(image_m)[0]
    rows, columns = np.nonzero(frame.ids == 0)
    assert len(rows) > 20
    assert [columns.mean(), rows.mean()] == pytest.approx(list(direct), abs=0.3)


def distorted(k1: float) -> RayTable:
    xy = grid().reshape(HEIGHT, WIDTH, 2)
    centre = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    d = (xy - centre) / F_PX
    return RayTable(centre + F_PX * d * (1 + k1 * (d**2).sum(axis=2, keepdims=True)))


def test_with_a_ray_table_every_pixel_looks_along_its_own_ray() -> None:
    pose = place((0.0, 0.0, 5.0), yaw_rad=0.4, pitch_rad=-0.2)
    scene = Scene()
    scene.add(Quad(width_m=30.0, height_m=30.0), NoiseSurface(), pose, "wall")
    projection = pinhole(rays=distorted(0.3))

    depth = seen(scene, projection).depth_m

    assert np.max(np.abs(depth / plane_depth(projection, pose) - 1.0)) < 5e-7
    assert np.max(np.abs(depth / plane_depth(pinhole(), pose) - 1.0)) > 1e-3


def test_edges_bend_with_the_lens() -> None:
    scene = Scene()
    scene.add(Quad(width_m=1.2, height_m=0.8), PlainSurface(), place((0.0, 0.0, 2.5)), "sheet")
    projection = pinhole(rays=distorted(0.4))

    ids = seen(scene, projection).ids.ravel()

    x, y = (projection.undistort(grid()) - [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]).T / F_PX * 2.5
    truth = np.where((np.abs(x) <= 0.6) & (np.abs(y) <= 0.4), 0, -1)
    assert (ids == truth).all()


def test_edges_are_smoothed_by_the_part_of_the_pixel_that_they_cover() -> None:
    scene = Scene()
    scene.add(
        Quad(width_m=1.0, height_m=0.7),
        PlainSurface(color=(1.0, 1.0, 1.0)),
        place((0.0, 0.0, 2.5), roll_rad=0.2),
        "sheet",
    )
    sky = PlainSurface(color=(0.0, 0.0, 0.0))
    scene.add(Quad(width_m=50.0, height_m=50.0), sky, place((0.0, 0.0, 9.0)), "sky")

    frame = seen(scene, pinhole())

    light = frame.radiance.max()
    area_px = frame.radiance.sum() / light
    assert area_px == pytest.approx(0.7 * (F_PX / 2.5) ** 2, rel=1e-3)
    partial = (frame.radiance > 0.02 * light) & (frame.radiance < 0.98 * light)
    assert 150 < partial.sum() < 600


def test_disparity_of_a_wall_is_focal_length_times_baseline_over_depth() -> None:
    scene = Scene()
    scene.add(Quad(width_m=20.0, height_m=20.0), NoiseSurface(), place((0.0, 0.0, 4.0)), "wall")
    scene.add(Quad(width_m=0.5, height_m=0.5), NoiseSurface(), place((0.0, 0.0, 2.0)), "near")
    left, right = pinhole(C=(-0.1, 0.0, 0.0)), pinhole(C=(0.1, 0.0, 0.0))

    with Renderer(scene, threads=1) as renderer:
        disparity, visible = renderer.disparity(left, right)
        ids = renderer.radiance(left).ids

    assert np.allclose(disparity[ids == 0], F_PX * 0.2 / 4.0, atol=1e-4)
    assert np.allclose(disparity[ids == 1], F_PX * 0.2 / 2.0, atol=1e-4)
    near = np.flatnonzero((ids == 1)[HEIGHT // 2])
    # Left of the near sheet the right eye misses as much wall as the two disparities differ: 11 px.
    hidden = ~visible[HEIGHT // 2]
    assert hidden[near[0] - 10 : near[0] - 1].all()
    assert visible[HEIGHT // 2, near].all()
    assert visible[HEIGHT // 2, near[-1] + 2 : near[-1] + 12].all()


def test_disparity_is_undefined_where_nothing_is_hit() -> None:
    scene = Scene()
    scene.add(Quad(width_m=0.5, height_m=0.5), PlainSurface(), place((0.0, 0.0, 2.0)), "sheet")

    with Renderer(scene, threads=1) as renderer:
        disparity, visible = renderer.disparity(pinhole(), pinhole(C=(0.1, 0.0, 0.0)))

    assert np.isnan(disparity[0, 0])
    assert not visible[0, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"M": np.eye(4)}, "shape"),
        ({"M": np.full((3, 3), np.nan)}, "not finite"),
        ({"M": np.zeros((3, 3))}, "condition"),
        ({"C": np.zeros(2)}, "shape"),
        ({"width": 0}, "at least 1"),
        ({"axis": np.array([0.0, 0.0, 2.0])}, "unit vector"),
        ({"rays": RayTable(np.zeros((7, 9, 2)))}, "9x7"),
    ],
)
def test_a_projection_that_cannot_be_used_is_refused_by_name(
    change: dict[str, F64 | int], message: str
) -> None:
    arguments = {"M": np.eye(3), "C": np.zeros(3), "width": 8, "height": 7} | change

    with pytest.raises(InvalidInput, match=message):
        Projection(**arguments)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize("table", [np.zeros((5, 2)), np.full((5, 5, 2), np.inf), np.zeros((1, 5, 2))])
def test_a_ray_table_that_cannot_be_used_is_refused(table: F64) -> None:
    with pytest.raises(InvalidInput, match="ray table"):
        RayTable(table)


def test_disparity_refuses_a_distorted_right_image() -> None:
    with Renderer(mixed_scene(), threads=1) as renderer, pytest.raises(InvalidInput, match="ray table"):
        renderer.disparity(pinhole(), pinhole(rays=distorted(0.1)))
