"""What is broken on purpose in the simulated world: told as it was put, and true to its signs."""

import math

import pytest
from tests.support.scenes.simulated_gaze import gaze
from tests.unit.simulation.test_mirror_dynamics import codes, pair_at_rest

from foveacam_hardware.contract import MirrorVolts, Role, VirtualClock
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.faults import WorldFaults
from foveacam_hardware.sim.mirror import MirrorPair
from foveacam_hardware.sim.presets import find_preset
from foveacam_hardware.sim.world import World
from foveacam_hardware.simulated_faults import MIRROR_AXES, MirrorAxis, MountKnock, SimulatedFaults

EVERYTHING = SimulatedFaults(
    unplugged=["wide"],
    frozen=["left"],
    no_trigger=["right"],
    no_strobe=["left", "right"],
    dead_axes=["left y", "right x"],
    knocked_left=MountKnock(shift_x_deg=0.3, shift_y_deg=-0.1, rotation_deg=0.2),
    knocked_right=MountKnock(rotation_deg=-1.5),
)


def test_what_was_put_is_told_and_mended() -> None:
    faults = WorldFaults()
    assert faults.in_force == SimulatedFaults()
    assert faults.in_force.words == []

    faults.set_faults(EVERYTHING)
    assert faults.in_force == EVERYTHING
    assert len(faults.in_force.words) == 9

    faults.set_faults(SimulatedFaults())
    assert faults == WorldFaults()


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
def test_a_knocked_eye_looks_to_the_right_and_down_as_it_is_said(role: Role) -> None:
    stage = AnimatedScene("bench")
    world = World(scene=stage, preset=find_preset("rig120"), seed=0, clock=VirtualClock(0))
    try:
        before = gaze(world.static_view(role, MirrorVolts(x_v=0.0, y_v=0.0), t_ns=0))
        knock = MountKnock(shift_x_deg=0.3, shift_y_deg=0.2)
        world.faults.set_faults(SimulatedFaults(knocked_left=knock, knocked_right=knock))
        after = gaze(world.static_view(role, MirrorVolts(x_v=0.0, y_v=0.0), t_ns=0))
    finally:
        stage.close()

    moved_deg = [
        math.degrees(math.atan2(after[k], after[2]) - math.atan2(before[k], before[2])) for k in (0, 1)
    ]
    assert moved_deg == pytest.approx([0.3, 0.2], abs=0.01)


@pytest.mark.parametrize("axis", MIRROR_AXES)
def test_a_dead_axis_stays_and_the_other_three_go_on(axis: MirrorAxis) -> None:
    pair, whole = pair_at_rest(), pair_at_rest()
    pair.dead_axes = {axis}
    tilts(pair, 0)
    for mirrors in (pair, whole):
        mirrors.set_codes(0, codes(MirrorVolts(x_v=80.0, y_v=60.0)))

    dead, free = tilts(pair, 200_000_000), tilts(whole, 200_000_000)
    for number, name in enumerate(MIRROR_AXES):
        assert (abs(dead[number] - free[number]) > math.radians(1.0)) == (name == axis)

    pair.dead_axes = set()
    assert tilts(pair, 200_000_000) == pytest.approx(free)


def tilts(pair: MirrorPair, t_ns: int) -> list[float]:
    return [tilt for role in (Role.LEFT, Role.RIGHT) for tilt in pair.tilt_rad(role, t_ns)]
