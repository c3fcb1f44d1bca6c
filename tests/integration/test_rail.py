"""The rig that slides on its rail: the world stands still, and near things move more than far ones."""

from collections.abc import Iterator

import numpy as np
import pytest

from foveacam_hardware.contract import Rail, Role
from foveacam_hardware.rail_config import PAPER_PLACES
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth

POLL_NS = 20_000_000


def rail(rig: Rig) -> Rail:
    assert rig.rail is not None
    return rig.rail


def truth(rig: Rig) -> Truth:
    assert rig.truth is not None
    return rig.truth


def slide(rig: Rig, position_m: float) -> None:
    device = rail(rig)
    if not device.state.homed:
        device.home()
        rest(rig)
    device.move_to(position_m)
    rest(rig)


def rest(rig: Rig) -> None:
    while rail(rig).state.moving:
        rig.clock.sleep_until_ns(rig.clock.now_ns() + POLL_NS)


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    opened = open_simulated("bench", inline=True)
    yield opened
    opened.close()


def test_a_simulated_rig_has_the_papers_places(rig: Rig) -> None:
    assert rig.rail_places == PAPER_PLACES
    assert rail(rig).limits.max_m >= 0.3


@pytest.mark.parametrize("position_m", [-0.3, 0.1])
def test_the_rig_really_stands_there_along_its_own_x(rig: Rig, position_m: float) -> None:
    slide(rig, position_m)
    rig_from_world = truth(rig).rig_from_world(rig.clock.now_ns())

    assert np.array_equal(rig_from_world[:3, :3], np.eye(3))
    moved_m = -rig_from_world[:3, 3]
    assert np.linalg.norm(moved_m) == pytest.approx(abs(position_m), abs=1e-5)
    assert moved_m[0] == pytest.approx(position_m, abs=1e-4)  # a rail set up by eye: 0.3 degrees each way
    assert np.abs(moved_m[1:]).max() <= abs(position_m) * np.tan(np.deg2rad(0.3)) * 1.01


def test_what_the_wide_camera_sees_shifts_by_the_parallax_of_its_depth(rig: Rig) -> None:
    world = truth(rig).world
    slide(rig, 0.0)
    t_ns = rig.clock.now_ns()
    wide = world.projection(Role.WIDE, t_ns)
    seen = world.animated_scene.probe(wide, world.scene_s(t_ns))
    assert seen.depth_m is not None
    row, column = 800, 720
    depth_m = float(seen.depth_m[row, column])
    slide(rig, 0.05)
    t_ns = rig.clock.now_ns()
    again = world.animated_scene.probe(wide, world.scene_s(t_ns))
    assert again.depth_m is not None

    expected_px = wide.M[0, 0] * 0.05 / depth_m
    there = again.depth_m[row, round(column - expected_px)]
    assert float(there) == pytest.approx(depth_m, rel=0.01)
    assert expected_px > 50.0


def test_back_in_the_middle_it_sees_bit_for_bit_what_it_saw_before(rig: Rig) -> None:
    slide(rig, 0.0)

    assert np.array_equal(truth(rig).rig_from_world(rig.clock.now_ns()), np.eye(4))


def test_a_picture_taken_while_it_slides_is_smeared(rig: Rig) -> None:
    slide(rig, -0.3)
    rail(rig).move_to(0.3)
    rig.clock.sleep_until_ns(rig.clock.now_ns() + 2_000_000_000)
    stage, t_s = truth(rig).world.animated_scene, truth(rig).world.scene_s(rig.clock.now_ns())
    projection = truth(rig).world.projection(Role.LEFT, rig.clock.now_ns())
    rail(rig).state  # noqa: B018 - the motors' board is asked, so that it has gone on

    moved_px = stage.motion(projection, t_s - 0.008, t_s).largest_px

    assert moved_px == pytest.approx(28_760 * 0.1 * 0.008, rel=0.1)  # 100 mm/s at 1 m, over 8 ms
    rest(rig)
