"""What a moving object hides during a whole exposure is not drawn, and that changes nothing."""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.sim import scene_layers
from foveacam_hardware.sim.render import (
    Box,
    NoiseSurface,
    Projection,
    Quad,
    Renderer,
    Scene,
    place,
    sphere,
)
from foveacam_hardware.sim.render.hiding import nearest_depths
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W
from foveacam_hardware.sim.scene_layers import SceneLayers

COLUMNS, ROWS = 5, 7
WIDTH, HEIGHT = COLUMNS * TILE_W - 10, ROWS * TILE_H - 10
PROJECTION = Projection(
    M=np.array([[1000.0, 0.0, WIDTH / 2], [0.0, 1000.0, HEIGHT / 2], [0.0, 0.0, 1.0]]),
    C=np.zeros(3),
    width=WIDTH,
    height=HEIGHT,
)
TILES = COLUMNS * ROWS
WALL_M, POST_M = 6.0, 3.0
Shifts = Mapping[int, tuple[float, float]]
STILL: Shifts = {2: (0.0, 0.0)}


def room(door_m: float) -> Scene:
    """Return a wall (0), a post (1) in the middle of the picture, a door (2) that fills it."""
    scene = Scene()
    scene.add(Quad(width_m=9.0, height_m=9.0), NoiseSurface(seed=1), place((0.0, 0.0, WALL_M)), "wall")
    scene.add(Quad(width_m=0.03, height_m=1.0), NoiseSurface(seed=2), place((0.0, 0.0, POST_M)), "post")
    door = Quad(width_m=0.4 * door_m, height_m=0.3 * door_m)
    scene.add(door, NoiseSurface(seed=3), place((0.0, 0.0, door_m)), "door")
    return scene


def scattered(seed: int) -> Scene:
    """Return a wall (0) and twelve things here and there, of all sizes, turned."""
    rng, scene = np.random.default_rng(seed), Scene()
    scene.add(Quad(width_m=9.0, height_m=9.0), NoiseSurface(seed=1), place((0.0, 0.0, WALL_M)), "wall")
    for number in range(1, 13):
        x_m, y_m, z_m, yaw_rad, pitch_rad = rng.uniform(
            (-0.4, -0.3, 2.0, -0.7, -0.7), (0.4, 0.3, 5.0, 0.7, 0.7)
        ).tolist()
        width_m, height_m, depth_m = rng.uniform(0.05, 1.2, 3).tolist()
        box = Box(width_m=width_m, height_m=height_m, depth_m=depth_m)
        shape = sphere(radius_m=0.4 * width_m) if number % 4 == 0 else box
        pose = place((x_m, y_m, z_m), yaw_rad=yaw_rad, pitch_rad=pitch_rad)
        scene.add(shape, NoiseSurface(seed=number), pose, f"thing {number}")
    return scene


def blurred(scene: Scene, shifts_px: Shifts, *, channels: int = 3) -> tuple[NDArray[np.float32], int]:
    """Return the picture, and how many tiles of what stands were not drawn."""
    layers = SceneLayers(scene, list(shifts_px), threads=1)
    shifts = {number: np.array(shift_px) for number, shift_px in shifts_px.items()}
    picture = layers.blurred(PROJECTION, shifts, channels=channels)
    (entry,) = layers._back._frames.values()
    layers.close()
    return picture, int(np.count_nonzero(~entry.valid))


def blurred_whole(scene: Scene, shifts_px: Shifts) -> NDArray[np.float32]:
    """Return the picture with all that stands drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_layers, "hiding_depths", lambda *_layer: np.full(TILES, np.inf))
        picture, left_out = blurred(scene, shifts_px)
    assert left_out == 0
    return picture


def test_behind_what_fills_the_picture_nothing_is_drawn() -> None:
    assert blurred(room(door_m=2.9), STILL)[1] == TILES
    assert blurred(room(door_m=2.9), {2: (9.0, -5.0)}, channels=1)[1] == TILES


def test_what_stands_before_the_moving_object_is_drawn() -> None:
    picture, left_out = blurred(room(door_m=3.1), STILL)
    assert left_out == TILES - ROWS  # the post is in the middle column
    assert np.array_equal(picture, blurred_whole(room(door_m=3.1), STILL))


def test_what_is_uncovered_in_one_step_is_drawn() -> None:
    narrow = room(door_m=2.9)
    narrow.set_pose(2, place((0.55, 0.0, 2.9)))  # its left edge is 40 px right of the middle
    standing, moving = blurred(narrow, STILL)[1], blurred(narrow, {2: (100.0, 0.0)})[1]
    assert 0 < moving < standing < TILES
    assert np.array_equal(blurred(narrow, {2: (100.0, 0.0)})[0], blurred_whole(narrow, {2: (100.0, 0.0)}))


@pytest.mark.parametrize("seed", range(8))
def test_a_picture_is_that_with_all_drawn_bit_by_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moving = rng.choice(np.arange(1, 13), 3, replace=False).tolist()
    shifts_px = {number: tuple(rng.uniform(-15.0, 15.0, 2).tolist()) for number in moving}
    shifts_px[moving[0]] = shifts_px[moving[1]]  # these two move alike
    picture, _ = blurred(scattered(seed), shifts_px)
    assert np.array_equal(picture, blurred_whole(scattered(seed), shifts_px))


def test_random_pictures_have_tiles_that_are_hidden() -> None:
    left_out = [
        blurred(scattered(seed), {1: (5.0, 3.0), 2: (5.0, 3.0), 3: (-9.0, 4.0)})[1] for seed in range(8)
    ]
    assert sum(left_out) > 0.1 * 8 * TILES
    assert max(left_out) < TILES


def test_a_tile_that_was_left_out_is_drawn_once_it_is_uncovered() -> None:
    layers, shifts_px, aside = (
        SceneLayers(room(door_m=2.9), [2], threads=1),
        {2: np.zeros(2)},
        (0.8, 0.0, 2.9),
    )
    layers.blurred(PROJECTION, shifts_px, channels=3)
    layers.set_pose(2, place(aside))
    after = layers.blurred(PROJECTION, shifts_px, channels=3)
    layers.close()
    uncovered = room(door_m=2.9)
    uncovered.set_pose(2, place(aside))
    assert np.array_equal(after, blurred_whole(uncovered, STILL))


@pytest.mark.parametrize("seed", range(4))
def test_nothing_in_a_tile_is_nearer_than_its_bound(seed: int) -> None:
    with Renderer(scattered(seed), threads=1) as renderer:
        nearest = least_depths(renderer.radiance(PROJECTION).depth_m)
        (entry,) = renderer._frames.values()
        assert entry.stage is not None
        bound = nearest_depths(entry.stage, np.arange(TILES))
    assert (bound <= nearest + 1e-5).all()


def test_the_bound_is_the_depth_of_what_faces_the_camera_and_infinite_before_the_sky() -> None:
    facing = Scene()
    facing.add(Quad(width_m=0.4, height_m=9.0), NoiseSurface(seed=1), place((0.5, 0.0, 4.0)), "board")
    with Renderer(facing, threads=1) as renderer:
        nearest = least_depths(renderer.radiance(PROJECTION).depth_m)
        (entry,) = renderer._frames.values()
        assert entry.stage is not None
        bound = nearest_depths(entry.stage, np.arange(TILES))
    assert bound[np.isfinite(nearest)] == pytest.approx(4.0)
    assert np.isinf(bound[:COLUMNS]).sum() == 3  # of the tiles of a row the board covers two


def least_depths(depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the least depth of each tile."""
    padded = np.full((ROWS * TILE_H, COLUMNS * TILE_W), np.inf, np.float32)
    padded[:HEIGHT, :WIDTH] = depth_m
    least = padded.reshape(ROWS, TILE_H, COLUMNS, TILE_W).min(axis=(1, 3)).ravel()
    return np.asarray(least, dtype=np.float32)
