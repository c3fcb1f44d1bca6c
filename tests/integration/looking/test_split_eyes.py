"""Each eye by itself on the simulated rig: it brings a place of its own picture to the middle."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.marker_room import make_grey

from foveacam_hardware.contract import OutOfRange, Role, StereoVolts
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.continuous_loop.settings import Gains
from foveacam_pipeline.continuous_loop.split_eyes import MOST_STEP_V, EyeState, SplitEyes, SplitStep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

GAINS = Gains(kp=0.5, ki=0.02, kd=0.0)
MIDDLE_PX = (719.5, 539.5)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with open_simulated(scene="bench", inline=True) as rig:
        make_grey(rig)
        bin_cameras(rig, 2)
        yield rig


def volts_of(rig: Rig, calibration: Calibration) -> StereoVolts:
    return calibration.steer(-0.06, 0.02, distance_m=2.0)


def looks(split: SplitEyes, rig: Rig, number: int) -> list[SplitStep]:
    return [split.step(rig.head, gains=GAINS, sensitivity=0.1) for _ in range(number)]


def test_both_eyes_bring_different_places_to_their_middles(rig: Rig, calibration: Calibration) -> None:
    volts = volts_of(rig, calibration)
    sighting, split = rig.head.look(volts), SplitEyes(calibration, clock=rig.clock)
    split.choose(Role.LEFT, sighting.left, (950.0, 400.0), volts)
    split.choose(Role.RIGHT, sighting.right, (500.0, 640.0), volts)
    last = looks(split, rig, 12)[-1]
    for role in (Role.LEFT, Role.RIGHT):
        reading = last.readings[role]
        assert reading.state is EyeState.TRACKING
        assert reading.pixel == pytest.approx(MIDDLE_PX, abs=3.0)


def test_an_eye_without_a_place_rests(rig: Rig, calibration: Calibration) -> None:
    volts = volts_of(rig, calibration)
    sighting, split = rig.head.look(volts), SplitEyes(calibration, clock=rig.clock)
    split.choose(Role.LEFT, sighting.left, (900.0, 450.0), volts)
    steps = looks(split, rig, 4)
    assert steps[-1].readings[Role.RIGHT].state is EyeState.STILL
    rights = np.array([(step.sighting.volts.right.x_v, step.sighting.volts.right.y_v) for step in steps])
    assert np.ptp(rights, axis=0) == pytest.approx(0.0, abs=0.05)
    assert abs(steps[-1].sighting.volts.left.x_v - volts.left.x_v) > 0.5


def test_no_look_moves_a_mirror_farther_than_allowed(rig: Rig, calibration: Calibration) -> None:
    volts = volts_of(rig, calibration)
    sighting, split = rig.head.look(volts), SplitEyes(calibration, clock=rig.clock)
    split.choose(Role.LEFT, sighting.left, (1300.0, 200.0), volts)
    lefts = np.array([(s.sighting.volts.left.x_v, s.sighting.volts.left.y_v) for s in looks(split, rig, 6)])
    steps_v = np.abs(np.diff(lefts, axis=0))
    assert steps_v.max() <= MOST_STEP_V + 0.01  # the converter's step
    assert steps_v.max() > 0.8 * MOST_STEP_V


def test_a_place_that_shows_nothing_is_refused_and_the_other_eye_goes_on(
    rig: Rig, calibration: Calibration
) -> None:
    volts = volts_of(rig, calibration)
    sighting, split = rig.head.look(volts), SplitEyes(calibration, clock=rig.clock)
    split.choose(Role.LEFT, sighting.left, (900.0, 450.0), volts)
    blank = replace(sighting.right, image=np.full_like(sighting.right.image, 90))
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        split.choose(Role.RIGHT, blank, (700.0, 500.0), volts)
    assert looks(split, rig, 1)[-1].readings[Role.LEFT].state is EyeState.TRACKING
