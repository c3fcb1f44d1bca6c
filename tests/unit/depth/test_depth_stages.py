"""Stages of dense depth as `bench stereo` times them: together they give the product's depth."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from foveacam_bench.depth.stages import STAGES, LookCost, StageTimes, look_cost, staged_depth
from foveacam_bench.depth.stereo import CERTIFICATE, LOOKS
from foveacam_hardware.contract import Binning, Sighting
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

TEXTURED = LOOKS[-1]


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(CERTIFICATE)


@pytest.fixture(scope="module", params=[1, 2])
def sighting(request: pytest.FixtureRequest, calibration: Calibration) -> Iterator[Sighting]:
    """Yield a look at a textured surface at each binning."""
    binning: Binning = request.param
    with open_simulated(scene="bench", inline=True) as rig:
        bin_cameras(rig, binning)
        ax_rad, ay_rad = (math.radians(angle) for angle in TEXTURED[:2])
        yield rig.head.look(calibration.steer(ax_rad, ay_rad, distance_m=TEXTURED[2]))


def test_the_stages_that_are_timed_give_the_depth_that_the_product_gives(
    sighting: Sighting, calibration: Calibration
) -> None:
    pair = rectify(sighting, calibration)
    whole = depth_map(pair, match(pair))
    staged = staged_depth(sighting, calibration, StageTimes())

    assert np.isfinite(whole.z_m).mean() > 0.85
    np.testing.assert_array_equal(staged.z_m, whole.z_m)
    np.testing.assert_array_equal(staged.sigma_m, whole.sigma_m)
    assert staged.occluded is not None and whole.occluded is not None
    np.testing.assert_array_equal(staged.occluded, whole.occluded)


def test_every_stage_of_depth_is_timed(sighting: Sighting, calibration: Calibration) -> None:
    cost = look_cost(sighting, calibration, runs=1)

    assert set(cost.stages_ms) == set(STAGES)
    assert all(cost.stages_ms[stage] > 0.0 for stage in STAGES)


def test_the_ratio_of_several_looks_weighs_each_by_its_time() -> None:
    looks = [
        LookCost(ours_ms=ours, bare_ms=bare, stages_ms={}) for ours, bare in ((90.0, 60.0), (30.0, 40.0))
    ]

    assert LookCost.overhead_ratio(looks) == pytest.approx(0.2)
