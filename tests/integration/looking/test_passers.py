"""Clicks in the street on places that somebody walks past right after, judged by the simulation's truth."""

import numpy as np
import pytest

from foveacam_bench.verge.field_clicks import JudgedClick, judge
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.looking.passing_detector import LONGEST_S
from foveacam_pipeline.verge.values import Basis
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

TOWN_HALL = (886.5, 615.5), 33.771
"""Texture, over which somebody walks in 0.1 s at 10 m; their edge is followed as if the target had moved."""
VAN_DOOR = (395.3, 520.3), 11.834
"""A plain surface, before which somebody at 11 m stands while what surrounds it is measured."""


def clicked(pixel: tuple[float, float], at_s: float) -> JudgedClick:
    warm_up()
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    with open_simulated(scene="street", inline=True) as rig:
        bin_cameras(rig, 2)
        rig.clock.sleep_until_ns(round(1e9 * at_s))
        return judge(rig, calibration, "street", np.array(pixel))


@pytest.mark.parametrize(
    ("place", "basis"), [(TOWN_HALL, Basis.BOTH_FOVEAE), (VAN_DOOR, Basis.SURROUNDINGS)], ids=["hall", "door"]
)
def test_who_passes_is_not_taken_for_what_was_clicked(
    place: tuple[tuple[float, float], float], basis: Basis
) -> None:
    found = clicked(*place)
    assert found.fixation.duration_ms >= 1e3 * LONGEST_S  # it waited: somebody walks there all the time
    assert found.fixation.basis is basis
    assert found.fixation.distance_m == pytest.approx(found.range_m, rel=0.03), found.fixation.reason
