"""Objects that move evenly during an exposure: two layers against the mean of many pictures."""

from collections.abc import Mapping

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.sim.render import Box, NoiseSurface, Projection, Quad, Renderer, Scene, place
from foveacam_hardware.sim.scene_layers import ImageMotion, ObjectMotion, SceneLayers

FOCAL_PX, WIDTH, HEIGHT = 3000.0, 320, 240
PROJECTION = Projection(
    M=np.array([[FOCAL_PX, 0.0, 159.5], [0.0, FOCAL_PX, 119.5], [0.0, 0.0, 1.0]]),
    C=np.zeros(3),
    width=WIDTH,
    height=HEIGHT,
)
PICTURES = 96
"""In the mean that is taken for exact."""
LEAST_BLUR_PX = 0.7
"""What the lens blurs in any case, σ: finer differences do not reach the sensor."""
Positions = Mapping[int, tuple[float, float, float]]
Vector = tuple[float, float, float]


def scene_of_three() -> Scene:
    """Return a wall (0) and, before it, a post (1), and between them two boxes (2, 3)."""
    scene = Scene()
    scene.add(Quad(width_m=3.0, height_m=3.0), NoiseSurface(seed=1), place((0.0, 0.0, 6.0)), "wall")
    scene.add(Quad(width_m=0.04, height_m=1.0), NoiseSurface(seed=2), place((0.06, 0.0, 3.0)), "post")
    for number, seed in ((2, 3), (3, 4)):
        box = Box(width_m=0.12, height_m=0.1, depth_m=0.01)
        scene.add(
            box, NoiseSurface(seed=seed, color_a=(0.9, 0.2, 0.1)), place((0.0, 0.0, 3.0 + number)), "box"
        )
    return scene


def mean_of_pictures(
    scene: Scene, middle: Positions, moved_m: Positions, channels: int
) -> NDArray[np.float64]:
    total = np.zeros((HEIGHT, WIDTH, channels))
    with Renderer(scene, threads=1) as renderer:
        for k in range(PICTURES):
            for number, at_m in middle.items():
                scene.set_pose(number, place(shifted(at_m, moved_m[number], (k + 0.5) / PICTURES - 0.5)))
            drawn = renderer.radiance(PROJECTION, channels=channels).radiance
            total += drawn.reshape(HEIGHT, WIDTH, channels) / PICTURES
    return total


def of_layers(scene: Scene, middle: Positions, moved_m: Positions, channels: int) -> NDArray[np.float64]:
    layers, shifts = SceneLayers(scene, list(middle), threads=1), {}
    for number, at_m in middle.items():
        layers.set_pose(number, place(at_m))
        ends = [
            PROJECTION.project(corners(at_m) + np.multiply(moved_m[number], part)) for part in (-0.5, 0.5)
        ]
        shifts[number], _ = object_motion(ends[0], ends[1]).shift()
    drawn = layers.blurred(PROJECTION, shifts, channels=channels)
    layers.close()
    return np.asarray(drawn, dtype=np.float64).reshape(HEIGHT, WIDTH, channels)


def shifted(at_m: Vector, moved_m: Vector, part: float) -> Vector:
    x_m, y_m, z_m = (np.asarray(at_m) + part * np.asarray(moved_m)).tolist()
    return x_m, y_m, z_m


def corners(at_m: Vector) -> NDArray[np.float64]:
    signs = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5
    return np.asarray(at_m + signs * [0.12, 0.1, 0.01])


def difference(ours: NDArray[np.float64], exact: NDArray[np.float64]) -> NDArray[np.float64]:
    blurred = cv2.GaussianBlur(ours - exact, (0, 0), LEAST_BLUR_PX)
    return np.asarray(blurred, dtype=np.float64).reshape(exact.shape)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize(
    ("at_m", "moved_m"),
    [
        pytest.param((-0.05, 0.0, 5.0), (0.03, 0.004, 0.0), id="before the wall"),
        pytest.param((0.06, 0.02, 5.0), (0.03, 0.0, 0.0), id="behind the post"),
        pytest.param((-0.3, 0.0, 5.0), (0.05, 0.0, 0.0), id="into the picture"),
        pytest.param((0.0, -0.02, 5.0), (0.0, 0.03, 0.0), id="downwards"),
    ],
)
def test_the_blur_of_a_shifted_layer_is_the_mean_of_many_pictures(
    at_m: Vector, moved_m: Vector, channels: int
) -> None:
    exact = mean_of_pictures(scene_of_three(), {2: at_m}, {2: moved_m}, channels)
    found = difference(of_layers(scene_of_three(), {2: at_m}, {2: moved_m}, channels), exact)
    still = difference(of_layers(scene_of_three(), {2: at_m}, {2: (0.0, 0.0, 0.0)}, channels), exact)
    assert float(np.sqrt(np.mean(found**2))) < 7e-4
    assert np.abs(found).max() < 0.015 < np.abs(still).max()  # and the blur is one that shows


def test_of_two_that_cross_the_nearer_hides_the_other() -> None:
    middle = {2: (-0.02, 0.0, 5.0), 3: (0.03, 0.02, 5.5)}
    moved_m = {2: (0.03, 0.0, 0.0), 3: (-0.04, 0.0, 0.0)}
    exact = mean_of_pictures(scene_of_three(), middle, moved_m, 1)
    found = difference(of_layers(scene_of_three(), middle, moved_m, 1), exact)
    assert np.percentile(np.abs(found), 99.0) < 0.01
    back = {2: (-0.02, 0.0, 5.5), 3: (0.03, 0.02, 5.0)}
    exchanged = difference(of_layers(scene_of_three(), back, moved_m, 1), exact)
    assert np.percentile(np.abs(exchanged), 99.0) > 0.05


def test_the_shift_of_an_object_is_that_of_its_part_in_the_image() -> None:
    before = PROJECTION.project(corners((0.0, 0.0, 5.0)))
    across = object_motion(before, before + np.array([6.0, -2.0]))
    assert across.largest_px == pytest.approx(np.hypot(6.0, 2.0))
    shift_px, uneven_px = across.shift()
    assert shift_px == pytest.approx([6.0, -2.0])
    assert uneven_px == pytest.approx(0.0, abs=1e-9)
    nearer_px, uneven_px = object_motion(before, PROJECTION.project(corners((0.0, 0.0, 4.5)))).shift()
    assert nearer_px == pytest.approx([0.0, 0.0], abs=0.2)
    assert uneven_px > 5.0
    huge = 40.0 * (before - [159.5, 119.5]) + [159.5, 119.5]  # most of it is outside the image
    zoomed = object_motion(huge, 1.001 * (huge - [159.5, 119.5]) + [165.5, 119.5])
    shift_px, uneven_px = zoomed.shift()
    assert shift_px == pytest.approx([6.0, 0.0], abs=0.05)
    assert zoomed.largest_px > 6.5
    assert uneven_px < 0.5


def test_shifts_are_even_while_the_rig_stands_and_each_object_moves_as_one() -> None:
    before = PROJECTION.project(corners((0.0, 0.0, 5.0)))
    across = object_motion(before, before + np.array([6.0, -2.0]))
    nearer = object_motion(before, PROJECTION.project(corners((0.0, 0.0, 4.5))))
    even = ImageMotion(rig_px=0.0, objects={2: across}).even_shifts(2.0)
    assert even is not None
    assert even[2] == pytest.approx([6.0, -2.0])
    assert ImageMotion(rig_px=0.0, objects={2: across, 3: nearer}).even_shifts(2.0) is None
    assert ImageMotion(rig_px=0.1, objects={2: across}).even_shifts(2.0) is None


def object_motion(before_px: NDArray[np.float64], after_px: NDArray[np.float64]) -> ObjectMotion:
    return ObjectMotion(before_px=before_px, after_px=after_px, size=(WIDTH, HEIGHT))
