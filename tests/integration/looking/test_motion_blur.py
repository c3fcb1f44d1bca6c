"""Which exposures of the simulated rig are drawn from two layers, and which picture by picture."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Role, VirtualClock
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.exposures import ExposureInterval
from foveacam_hardware.sim.optics import FOVEA_FOCAL_PX
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.scenes.format import SceneFile
from foveacam_hardware.sim.world import SETTLED_PX, World

EXPOSURE_NS = 8_000_000
PICTURES = 48
BOARD = {"shape": "quad", "material": "print", "size_m": [0.2, 0.2]}
PRINT = {"kind": "noise", "color": "#102040", "accent": "#e0c080", "seed": 3}
WALL = {"name": "wall", "shape": "quad", "material": "print", "size_m": [20, 20], "position_m": [0, 0, 12]}
WALK = {"kind": "path", "points_m": [[-1, 0, 6], [1, 0, 6]], "speed_m_per_s": 1.0}
"""A board that passes before both foveae at rest after 1 s: 29 px of the sensor in 8 ms."""
SPIN = {"kind": "spin", "period_s": 0.5}


def world_with(motion: dict[str, object]) -> World:
    board = {"name": "board", "position_m": [0, 0, 6], **BOARD, "motion": motion}
    scene = {
        "format": "foveacam-scene",
        "version": 1,
        "materials": {"print": PRINT},
        "objects": [WALL, board],
    }
    stage = AnimatedScene(SceneFile.model_validate(scene), threads=1)
    return World(scene=stage, preset=RIG120, seed=0, clock=VirtualClock())


def exposure(world: World, begins_s: float) -> ExposureInterval:
    return ExposureInterval(start_ns=world.t0_ns + round(1e9 * begins_s), length_ns=EXPOSURE_NS)


@pytest.fixture
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    made = world_with(request.param)
    yield made
    made.animated_scene.close()


@pytest.mark.parametrize(("parts", "middles_ns"), [(1, [500]), (4, [200, 400, 600, 800])])
def test_the_parts_of_an_exposure_lie_evenly_about_its_middle(parts: int, middles_ns: list[int]) -> None:
    assert ExposureInterval(start_ns=100, length_ns=800).middles_ns(parts) == middles_ns


@pytest.mark.parametrize("world", [WALK], indirect=True)
@pytest.mark.parametrize("binning", [1, 2])
def test_what_walks_by_is_blurred_as_in_the_mean_of_many_pictures(world: World, binning: Binning) -> None:
    taken = exposure(world, 1.05)
    drawn = count_pictures(world)
    found = world.radiance(Role.LEFT, taken, channels=1, binning=binning)
    assert drawn == []
    exact = mean_of_pictures(world, taken, binning)
    sharp = world.animated_scene.radiance(
        world.projection(Role.LEFT, taken.middle_ns, binning=binning),
        world.scene_s(taken.middle_ns),
        channels=1,
    )
    assert rms(sharp - exact) > 0.01  # much of the picture is blurred
    assert rms(found - exact) < 0.003


@pytest.mark.parametrize("world", [SPIN], indirect=True)
def test_what_turns_is_drawn_picture_by_picture(world: World) -> None:
    drawn = count_pictures(world)
    world.radiance(Role.LEFT, exposure(world, 1.06), channels=1)
    assert len(drawn) > 1


@pytest.mark.parametrize("world", [WALK], indirect=True)
@pytest.mark.parametrize("begins_s", [1.05, 1.8])  # a board passes, and nothing moves but the mirror
def test_a_mirror_that_comes_to_rest_is_drawn_once_where_it_is_on_the_average(
    world: World, begins_s: float
) -> None:
    taken = exposure(world, begins_s)
    step_mirrors(world, taken.start_ns - 21_000_000)
    places_px = eye_places_px(world, taken)
    assert 0.7 < np.ptp(places_px, axis=0).max() < SETTLED_PX
    assert np.abs(places_px.mean(axis=0) - places_px[PICTURES // 2]).max() > 0.1  # not that of the middle
    drawn = count_pictures(world)
    found = world.radiance(Role.LEFT, taken, channels=1, binning=2)
    assert len(drawn) == (1 if begins_s > 1.5 else 0)
    exact = mean_of_pictures(world, taken, 2)
    assert rms(found - exact) < 0.002
    middle = world.animated_scene.radiance(
        world.projection(Role.LEFT, taken.middle_ns, binning=2), world.scene_s(taken.middle_ns), channels=1
    )
    assert rms(middle - exact) > 3.0 * rms(found - exact)


@pytest.mark.parametrize("world", [WALK], indirect=True)
def test_while_the_mirror_swings_all_is_drawn_picture_by_picture(world: World) -> None:
    drawn, taken = count_pictures(world), exposure(world, 1.05)
    step_mirrors(world, taken.start_ns)
    world.radiance(Role.LEFT, taken, channels=1)
    assert len(drawn) > 1


def step_mirrors(world: World, t_ns: int) -> None:
    """Drive both mirrors by some degrees, to where they rest without a drive."""
    world.set_rail(world.t0_ns, on=True)
    world.set_low_pass(world.t0_ns, 240)
    world.set_codes(world.t0_ns, (40_000, 25_000) * 4)
    world.set_codes(t_ns, (0,) * 8)


def eye_places_px(world: World, taken: ExposureInterval) -> NDArray[np.float64]:
    """Return where the left eye looks during an exposure, (n, 2) px of the sensor."""
    tilts_rad = world.mirrors.tilts_rad(Role.LEFT, taken.middles_ns(PICTURES))
    return 2.0 * FOVEA_FOCAL_PX * tilts_rad


def count_pictures(world: World) -> list[float]:
    """Return a list that every picture of the whole scene adds its time to."""
    stage, times_s = world.animated_scene, list[float]()
    radiance = stage.radiance

    def counted(projection: Projection, t_s: float, *, channels: int) -> NDArray[np.float32]:
        times_s.append(t_s)
        return radiance(projection, t_s, channels=channels)

    stage.radiance = counted  # type: ignore[method-assign]  # of this scene alone
    return times_s


def mean_of_pictures(world: World, taken: ExposureInterval, binning: Binning) -> NDArray[np.float64]:
    views = (
        (world.projection(Role.LEFT, t_ns, binning=binning), world.scene_s(t_ns))
        for t_ns in taken.middles_ns(PICTURES)
    )
    pictures = (world.animated_scene.radiance(view, t_s, channels=1) for view, t_s in views)
    return np.asarray(sum(picture.astype(np.float64) for picture in pictures) / PICTURES)


def rms(difference: NDArray[np.float64]) -> float:
    """Return the root mean square of what the lens lets through."""
    return float(np.sqrt(np.mean(cv2.GaussianBlur(difference, (0, 0), 0.7) ** 2)))
