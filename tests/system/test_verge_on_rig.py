"""Vergence on the simulated rig, judged by its truth."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.loop import fixate
from foveacam_pipeline.verge.values import Fixation, FixationState, PixelTarget
from foveacam_server.runtime.calibrations import SHIPPED

SURVEYED = Path(__file__).parents[1] / "data" / "rig120-calibration.json"
WHITEBOARD = (660.0, 300.0)
HIDDEN_FROM_THE_LEFT = (602.0, 561.0)
"""On the notice, behind the marble figure for the left eye, which sees another letter in its place."""


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    warm_up()
    with open_simulated(scene="bench", inline=True) as opened:
        yield opened


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def look_at(rig: Rig, calibration: Calibration, x_px: float, y_px: float) -> Fixation:
    return fixate(rig.head, calibration, PixelTarget(x_px=x_px, y_px=y_px), clock=rig.clock)


@pytest.mark.parametrize(("x_px", "y_px"), [(1000.0, 780.0), (640.0, 550.0), (870.0, 400.0), (900.0, 880.0)])
def test_distance_is_true_within_three_sigma(
    rig: Rig, calibration: Calibration, x_px: float, y_px: float
) -> None:
    found = look_at(rig, calibration, x_px, y_px)
    assert found.state is FixationState.VERGED, found.reason
    assert found.distance_m is not None
    assert found.distance_sigma_m is not None
    assert rig.truth is not None
    seen = rig.truth.depth_at(x_px, y_px, rig.clock.now_ns())
    assert seen is not None
    assert abs(found.distance_m - seen.range_m) <= 3.0 * found.distance_sigma_m


def test_a_plain_board_has_no_texture(rig: Rig, calibration: Calibration) -> None:
    assert look_at(rig, calibration, *WHITEBOARD).state is FixationState.NO_TEXTURE


@pytest.mark.parametrize("surveyed", [False, True])
@pytest.mark.parametrize(("aside_px", "down_px"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, -1.0)])
def test_a_look_alike_beside_a_hidden_target_is_not_taken_for_it(
    rig: Rig, calibration: Calibration, aside_px: float, down_px: float, *, surveyed: bool
) -> None:
    x_px, y_px = HIDDEN_FROM_THE_LEFT
    used = load_calibration(SURVEYED) if surveyed else calibration
    found = look_at(rig, used, x_px + aside_px, y_px + down_px)
    assert found.state is FixationState.LOST, found.reason
    assert found.distance_m is None
    assert "eye" in found.reason
