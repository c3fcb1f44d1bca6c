"""The part of a distance's error that differs from look to look is as large as looks really differ."""

import numpy as np
import pytest

from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Basis, PixelTarget
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

PLACES = ((736.0, 360.0), (628.0, 532.0), (857.0, 318.0))
LOOKS = 8
pytestmark = pytest.mark.timeout(300)


def test_looks_at_one_place_differ_as_stated() -> None:
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    shares = []
    with open_simulated(scene="bench", inline=True) as rig:
        bin_cameras(rig, 2)
        for x_px, y_px in PLACES:
            target = PixelTarget(x_px=x_px, y_px=y_px)
            found = [fixate(rig.head, calibration, target, clock=rig.clock) for _ in range(LOOKS)]
            assert {one.basis for one in found} == {Basis.BOTH_FOVEAE}
            stated_m = [one.distance_sigma_random_m or 0.0 for one in found]
            distances_m = [one.distance_m or 0.0 for one in found]
            shares.append(np.std(distances_m, ddof=1) / np.median(stated_m))
    assert 0.5 <= np.sqrt(np.mean(np.square(shares))) <= 1.4
