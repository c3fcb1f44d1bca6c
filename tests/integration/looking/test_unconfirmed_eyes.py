"""Depths that one fovea alone suggests, where nothing measured about the target confirms them."""

from collections.abc import Iterator

import pytest

from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Basis, PixelTarget
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

FACADE_PX = ((1161.9, 340.9), (308.3, 185.0))
"""On a town hall 35 m away with rows of alike ornaments. An eye that cannot see the point shows another
ornament where it would lie if it were 1.8 or 3.0 m away, which the other eye cannot turn to."""
NEAREST_M, FARTHEST_M = 30.0, 42.0


@pytest.fixture(scope="module")
def street_rig() -> Iterator[Rig]:
    warm_up()
    with open_simulated(scene="street", inline=True) as rig:
        bin_cameras(rig, 2)
        yield rig


@pytest.mark.parametrize("pixel", FACADE_PX)
def test_a_near_match_by_one_eye_yields_to_what_surrounds_the_target(
    street_rig: Rig, pixel: tuple[float, float]
) -> None:
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    target = PixelTarget(x_px=pixel[0], y_px=pixel[1])
    answer = fixate(street_rig.head, calibration, target, clock=street_rig.clock)
    assert answer.basis is not Basis.FOVEA_AND_WIDE, answer.reason
    suggested = [one.distance_m for one in answer.alternatives if one.probability >= 0.5]
    if answer.distance_m is not None:
        suggested.append(answer.distance_m)
    assert suggested
    assert all(NEAREST_M <= distance_m <= FARTHEST_M for distance_m in suggested), answer.reason
