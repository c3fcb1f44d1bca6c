"""Which frames a calibration step gets on a rig that it opened itself."""

import pytest

from foveacam_hardware.contract import Binning, Role
from foveacam_hardware.sim.rig import open_simulated
from foveacam_server.resources.calibrating.sessions.step_environment import environment_of


@pytest.mark.parametrize(("asked", "working", "used"), [(1, 2, 1), (None, 2, 2), (None, 1, 1)])
def test_a_step_has_the_binning_that_it_asks_for_and_leaves_the_cameras_as_they_were(
    asked: Binning | None, working: Binning, used: Binning
) -> None:
    with open_simulated("toy", inline=True) as rig:
        rig.working_binning = working
        cameras = [rig.camera(role) for role in Role]

        with environment_of(rig).use("a test", binning=asked):
            during = [camera.settings.binning for camera in cameras]

        assert during == [used] * 3
        assert [camera.settings.binning for camera in cameras] == [1] * 3
