import math
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.drift_scenes import STILL, undone
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import StereoVolts
from foveacam_pipeline.calibrate.drift.health import (
    MAX_RESIDUALS,
    MIN_FIXATIONS,
    NEWEST_COUNT,
    HealthMonitor,
    HealthReport,
    HealthVerdict,
)
from foveacam_pipeline.calibrate.drift.values import EyeTurn
from foveacam_pipeline.geometry.triangulate import closest_approach
from foveacam_pipeline.verge.aim import EYES, Gazes, aim_at, volts_for
from foveacam_pipeline.verge.matching.target_offset import TargetOffset
from foveacam_pipeline.verge.values import Fixation, FixationState

WIDE_PX = 1.0 / CALIBRATION.wide.fx_px
KNOCKED = EyeTurn(turn_rad=(math.radians(0.03), math.radians(0.02), 0.0))
TILTED = EyeTurn(turn_rad=(math.radians(0.008), 0.0, 0.0))
ROLLED = EyeTurn(turn_rad=(0.0, 0.0, math.radians(0.4)))


def fixation(rng: np.random.Generator, left: EyeTurn, right: EyeTurn, *, moved_rad: float = 0.0) -> Fixation:
    """Return what eyes that have moved make of a target: they are driven until they see it."""
    target = np.tan(rng.uniform(-0.1, 0.1, 2))
    true = aim_at(CALIBRATION, target + np.array([moved_rad, 0.0]), rng.uniform(0.05, 0.4))
    placed = rng.normal(0.0, 0.1 * WIDE_PX, 2)
    gazes = Gazes(left=undone(left, true.left) + placed, right=undone(right, true.right) + placed)
    volts: StereoVolts = volts_for(CALIBRATION, gazes)
    pivots = [CALIBRATION.pivot_rig_m(role) for role in EYES]
    met = closest_approach(pivots[0], np.append(gazes.left, 1.0), pivots[1], np.append(gazes.right, 1.0))
    x, y, z = met.point_m.tolist()
    return Fixation(
        state=FixationState.VERGED,
        reason="",
        target_ax_rad=math.atan(target[0]),
        target_ay_rad=math.atan(target[1]),
        steps=(),
        point_rig_m=(x, y, z),
        volts=volts,
    )


def health(
    left: EyeTurn = STILL, right: EyeTurn = STILL, *, count: int = 20, movers: int = 0
) -> HealthReport:
    rng = np.random.default_rng(7)
    checkup = HealthMonitor(CALIBRATION)
    for index in range(count):
        checkup.add(fixation(rng, left, right, moved_rad=0.02 if index < movers else 0.0))
    return checkup.health


def test_a_calibration_that_holds_is_good() -> None:
    found = health()
    assert found.verdict is HealthVerdict.GOOD
    assert found.score is not None
    assert found.score < 1.0


@pytest.mark.parametrize("turn", [KNOCKED, ROLLED], ids=["knocked", "rolled"])
def test_eyes_that_look_beside_their_targets_call_for_a_calibration(turn: EyeTurn) -> None:
    assert health(turn, turn).verdict is HealthVerdict.RECALIBRATE


def test_one_eye_that_looks_too_high_shows_between_the_eyes() -> None:
    found = health(TILTED, STILL)
    assert found.verdict is HealthVerdict.RECALIBRATE
    assert found.rows_px is not None
    assert found.rows_px == pytest.approx(CALIBRATION.fovea_f_px * math.radians(0.008), rel=0.1)


@pytest.mark.parametrize(("sigmas", "verdict"), [(3.0, HealthVerdict.GOOD), (6.0, HealthVerdict.RECALIBRATE)])
def test_an_error_that_the_calibration_states_is_one_draw_however_many_fixations_show_it(
    sigmas: float, verdict: HealthVerdict
) -> None:
    apart_rad = sigmas * CALIBRATION.epipolar_sigma_px() / CALIBRATION.fovea_f_px
    lower = EyeTurn(turn_rad=(apart_rad, 0.0, 0.0))
    assert health(lower, STILL, count=MAX_RESIDUALS).verdict is verdict


def test_a_few_fixations_tell_nothing() -> None:
    found = health(KNOCKED, KNOCKED, count=MIN_FIXATIONS - 1)
    assert found.verdict is HealthVerdict.UNKNOWN
    assert found.fixations == MIN_FIXATIONS - 1
    assert found.score is None


def test_targets_that_moved_do_not_make_a_calibration_bad() -> None:
    assert health(count=20, movers=7).verdict is HealthVerdict.GOOD


def test_targets_that_were_seen_to_move_say_nothing_however_many_they_are() -> None:
    rng, checkup = np.random.default_rng(3), HealthMonitor(CALIBRATION)
    for _ in range(MAX_RESIDUALS):
        checkup.add(replace(fixation(rng, STILL, STILL, moved_rad=0.02), target_moved=True))
    assert checkup.health.verdict is HealthVerdict.UNKNOWN
    assert checkup.health.fixations == 0


def test_single_bad_fixations_do_not_hide_that_it_is_bad() -> None:
    assert health(KNOCKED, KNOCKED, count=20, movers=4).verdict is HealthVerdict.RECALIBRATE


def test_a_fixation_that_did_not_verge_says_nothing() -> None:
    checkup = HealthMonitor(CALIBRATION)
    checkup.add(Fixation(state=FixationState.LOST, reason="", target_ax_rad=0.0, target_ay_rad=0.0, steps=()))
    assert checkup.health.fixations == 0


def test_a_target_that_both_eyes_show_elsewhere_says_so() -> None:
    rng, checkup = np.random.default_rng(3), HealthMonitor(CALIBRATION)
    for _ in range(MAX_RESIDUALS):
        checkup.add(fixation(rng, STILL, STILL))
    target_offset = TargetOffset(across_px=2.0, down_px=-20.0, rows_px=50.0, sigma_px=4.5)
    not_found = Fixation(
        state=FixationState.LOST,
        reason="",
        target_ax_rad=0.0,
        target_ay_rad=0.0,
        steps=(),
        target_offset=target_offset,
    )
    verdicts = []
    for _ in range(NEWEST_COUNT // 2 + 1):
        checkup.add(not_found)
        verdicts.append(checkup.health.verdict)
    assert verdicts[:-1] == [HealthVerdict.GOOD] * (NEWEST_COUNT // 2)  # these may have been anything
    assert verdicts[-1] is HealthVerdict.RECALIBRATE
    assert checkup.health.rows_px == pytest.approx(50.0, abs=0.1)


def test_a_knock_shows_after_five_fixations_however_many_were_good_before() -> None:
    rng, checkup = np.random.default_rng(3), HealthMonitor(CALIBRATION)
    for _ in range(MAX_RESIDUALS):
        checkup.add(fixation(rng, STILL, STILL))
    for _ in range(NEWEST_COUNT // 2 + 1):
        checkup.add(fixation(rng, KNOCKED, KNOCKED))
    assert checkup.health.verdict is HealthVerdict.RECALIBRATE


@pytest.mark.parametrize("seed", range(20))
def test_chance_alone_never_calls_for_a_calibration(seed: int) -> None:
    rng, checkup = np.random.default_rng(seed), HealthMonitor(CALIBRATION)
    for _ in range(MAX_RESIDUALS):
        checkup.add(fixation(rng, STILL, STILL))
        assert checkup.health.verdict is not HealthVerdict.RECALIBRATE


def test_what_is_long_ago_is_forgotten() -> None:
    assert health(count=MAX_RESIDUALS + 10).fixations == MAX_RESIDUALS
