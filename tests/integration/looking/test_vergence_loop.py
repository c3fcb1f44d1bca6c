"""The vergence loop on the simulated rig, in virtual time."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from tests.support.scenes.marker_room import bench_with, make_grey

from foveacam_bench.loop.charged_loop import ChargedLoop
from foveacam_bench.loop.refused_tuning import tune_with_dead_axis
from foveacam_bench.loop.tuned_steps import POSTER_PER_M, POSTER_PX
from foveacam_hardware.contract import Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.continuous_loop.autotune import autotune
from foveacam_pipeline.continuous_loop.fault_gate import LATCH_AFTER
from foveacam_pipeline.continuous_loop.settings import AXES, Axis, Gains, LoopSettings
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStatus
from foveacam_pipeline.verge.aim import gazes_under
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

WHITEBOARD_PX = (600.0, 380.0)
SWIFT = Gains(kp=0.5, ki=0.02, kd=0.0)
"""Settles in half a dozen looks."""
FIXED = LoopSettings(tracker=None, pan=SWIFT, depth=SWIFT, vertical=SWIFT)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    walls = ("back wall", "poster", "whiteboard frame", "plain whiteboard")
    with open_simulated(bench_with(tmp_path_factory.mktemp("scene"), *walls), inline=True) as opened:
        make_grey(opened)
        bin_cameras(opened, 2)
        yield opened


def begun(
    rig: Rig,
    settings: LoopSettings = FIXED,
    *,
    pixel: tuple[float, float] = POSTER_PX,
    inverse_z_per_m: float = 1.1 * POSTER_PER_M,
) -> ChargedLoop:
    """Return a loop that looks at the poster, or at another pixel, from a depth that is a tenth off."""
    charged = ChargedLoop(rig, settings=settings)
    charged.choose(pixel, inverse_z_per_m=inverse_z_per_m)
    return charged


def test_the_loop_settles_on_a_place_and_tells_its_distance(rig: Rig) -> None:
    charged = begun(rig)
    steps = [charged.step() for _ in range(9)]
    errors = steps[-1].errors
    assert steps[-1].status is LoopStatus.TRACKING
    assert errors is not None
    assert errors.point is not None
    assert float(np.abs(errors.values_rad).max()) < math.radians(0.02)
    truth = truth_of(rig).depth_at(*POSTER_PX, rig.clock.now_ns())
    assert truth is not None
    assert errors.point.distance_m == pytest.approx(truth.range_m, abs=3.0 * errors.point.distance_sigma_m)


def test_axes_that_are_held_do_not_move(rig: Rig) -> None:
    charged = begun(rig)
    charged.loop.held = {Axis.VERGE, Axis.PAN_Y}
    before = dict(zip(AXES, charged.loop.command_rad, strict=True))
    for _ in range(3):
        charged.step()
    moved = {axis for axis, now in zip(AXES, charged.loop.command_rad, strict=True) if now != before[axis]}
    assert moved == {Axis.PAN_X, Axis.SHIFT_Y}


def test_a_paused_loop_looks_and_corrects_nothing(rig: Rig) -> None:
    charged = begun(rig)
    charged.loop.paused = True
    before = charged.loop.command_rad
    step = charged.step()
    assert step.status is LoopStatus.HELD
    assert step.errors is not None
    np.testing.assert_array_equal(charged.loop.command_rad, before)


def test_a_drag_lets_both_eyes_look_in_parallel_until_it_ends(rig: Rig) -> None:
    charged = begun(rig)
    charged.step()
    place, before = np.array([0.05, -0.04]), charged.loop.command_rad
    charged.loop.drag(place)
    dragged = charged.step()
    assert dragged.status is LoopStatus.MANUAL
    assert dragged.sighting is not None
    gazes = gazes_under(charged.calibration, dragged.sighting.volts)
    np.testing.assert_allclose(gazes.left, place, atol=1e-5)
    np.testing.assert_allclose(gazes.right, place, atol=1e-5)
    charged.loop.drag(None)
    np.testing.assert_array_equal(charged.loop.command_rad, before)
    assert charged.step().status is LoopStatus.TRACKING


def test_commands_are_frozen_once_the_time_for_correcting_is_over(rig: Rig) -> None:
    charged = begun(rig, LoopSettings(tracker=None, correct_for_ms=100.0))
    assert charged.step().status is LoopStatus.TRACKING
    charged.step()
    frozen = charged.step()
    assert frozen.status is LoopStatus.FROZEN
    np.testing.assert_array_equal(charged.loop.command_rad, frozen.command_rad)


def test_a_blank_board_has_too_low_a_score(rig: Rig) -> None:
    charged = begun(rig, pixel=WHITEBOARD_PX)
    before = charged.loop.command_rad
    step = charged.step()
    assert (step.status, step.errors) == (LoopStatus.LOW_SCORE, None)
    np.testing.assert_array_equal(charged.loop.command_rad, before)


def test_exposures_without_a_strobe_latch_the_gate(rig: Rig) -> None:
    charged = begun(rig)
    faults = truth_of(rig).world.faults
    faults.no_strobe.add(Role.LEFT)
    try:
        statuses = {charged.step().status for _ in range(LATCH_AFTER)}
    finally:
        faults.no_strobe.clear()
    assert statuses == {LoopStatus.TRIGGER_FAULT}
    assert charged.loop.gate.latched
    assert "strobe" in (charged.loop.gate.reason or "").lower()
    charged.loop.gate.reset()
    assert charged.step().status is LoopStatus.TRACKING


@pytest.mark.timeout(300)  # some 80 looks
def test_tuned_gains_settle_faster_than_the_default_ones(rig: Rig) -> None:
    charged = begun(rig, LoopSettings(tracker=None), inverse_z_per_m=POSTER_PER_M)
    result = autotune(charged.loop, charged.step)
    assert charged.loop.settings == result.settings
    for axis, before in result.before.items():
        after = result.after[axis]
        assert after.cost < 0.6 * before.cost
        assert after.overshoot < 0.10


@pytest.mark.timeout(300)  # some 40 looks
def test_a_stuck_axis_is_refused_and_everything_is_as_before() -> None:
    refusal = tune_with_dead_axis("left x")
    assert refusal.reason is not None
    assert refusal.restored
