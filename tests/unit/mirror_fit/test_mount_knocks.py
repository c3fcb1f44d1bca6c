"""A rig that is knocked in the middle of a sweep: when is found, what it did is taken out and told."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.support.scenes.swept_rig import EYES, POSE_S, UPRIGHT, SweptRig, Turns, swept, visited, wide_lens

from foveacam_bench.calibration.truth import CalibrationModel, judge
from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.fit import FitChoice, fit_rig
from foveacam_pipeline.calibrate.fit.measured import NominalRig, SweepMeasurements, reduce_sweeps
from foveacam_pipeline.calibrate.fit.samples import MountDrift
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_reference import middle_node, nodes_to_return_to
from foveacam_pipeline.models import Calibration, Intrinsics

pytestmark = pytest.mark.slow

SEED = 7
F_PX = 28_760.0
DRIFT_DEG = 0.004
FAR_S, NEAR_S, BACK_S = 10.0, 70.0, 123.0
AMID_FAR_S, BETWEEN_S, AMID_NEAR_S = 35.2, 57.0, 90.0
HARD: Turns = ((-0.005, 0.0035, 0.0017), (0.0, 0.0, 0.0))
"""The left mount is hit: 0.35 degrees."""
HARD_RIGHT: Turns = (HARD[1], HARD[0])
SOFT: Turns = ((-1e-4, 8e-5, 0.0), (9e-5, 1e-4, 0.0))
"""Both, by some four fovea px."""
QUICK = FitChoice(mirror_orders=(7, 8), spring_orders=(), field_orders=(3,))


@cache
def lens() -> Intrinsics:
    return wide_lens(SweptRig(SEED))


@cache
def session(knocked_rad: Turns, drift_deg: float = DRIFT_DEG) -> tuple[Sweep, Sweep]:
    """Both stations in one run, with all visits, of a rig whose mounts stand turned."""

    def station(distance_m: float, begin_s: float) -> Sweep:
        sweep = swept(SEED, distance_m, begin_s=begin_s, drift_deg=drift_deg, knocked_rad=knocked_rad)
        rows = {begin_s + POSE_S * (k - 0.5): middle_node(sweep.header.plan) for k in (0, 18, 36, 54, 72, 82)}
        back = {BACK_S + k: index for k, index in enumerate(nodes_to_return_to(sweep))}
        visits = rows | back if begin_s == FAR_S else rows
        return visited(sweep, visits, drift_deg=drift_deg, run="one", knocked_rad=knocked_rad)

    return station(5.0, FAR_S), station(2.5, NEAR_S)


def knocked(*knocks: tuple[float, Turns], drift_deg: float = DRIFT_DEG) -> tuple[Sweep, ...]:
    """Return the session with its mounts turned so until each moment, s, and upright after the last one."""

    def chosen(poses: tuple[tuple[SweepPose, ...], ...]) -> tuple[SweepPose, ...]:
        return tuple(
            same[sum(pose.t_ns > 1e9 * t_s for t_s, _ in knocks)]
            for same in zip(*poses, strict=True)
            for pose in same[:1]
        )

    states = [session(turns, drift_deg) for turns in (*(turns for _, turns in knocks), UPRIGHT)]
    return tuple(
        replace(
            each[-1],
            poses=chosen(tuple(sweep.poses for sweep in each)),
            repeats=chosen(tuple(sweep.repeats for sweep in each)),
        )
        for each in zip(*states, strict=True)
    )


def measured(sweeps: tuple[Sweep, ...]) -> SweepMeasurements:
    return reduce_sweeps(sweeps, lens(), drawing=NominalRig(rig_id=f"sim-{SEED}"), label="knocked")


def drift_of(sweeps: tuple[Sweep, ...]) -> dict[Role, MountDrift]:
    found = measured(sweeps).drift
    assert found is not None
    return found


def figures(calibration: Calibration) -> dict[str, float]:
    return judge(CalibrationModel(calibration), SweptRig(SEED), seed=3, count=60)


@cache
def calm() -> dict[str, float]:
    """Return the figures of the session without a knock."""
    return figures(fit_rig(measured(session(UPRIGHT)).rig, QUICK).calibration)


@pytest.mark.parametrize("at_s", [AMID_FAR_S, BETWEEN_S, AMID_NEAR_S])
def test_a_knock_amid_the_sweeps_leaves_a_calibration_as_good_as_without(at_s: float) -> None:
    found = measured(knocked((at_s, HARD)))
    mended = figures(fit_rig(found.rig, QUICK).calibration)

    assert found.drift is not None
    (jump_rad,) = found.drift[Role.LEFT].knocks_rad
    assert jump_rad == pytest.approx(math.hypot(*HARD[0][:2]), abs=1.5 / F_PX)
    assert found.drift[Role.RIGHT].knocks_rad == ()
    assert mended["epipolar_rms_px"] < calm()["epipolar_rms_px"] + 0.35  # 240 px where it stays in
    assert mended["pointing_rms_px"] < calm()["pointing_rms_px"] + 0.25


def test_a_soft_knock_is_found_at_its_moment() -> None:
    drift = drift_of(knocked((AMID_FAR_S, SOFT)))
    for role, turns in zip(EYES, SOFT, strict=True):
        before, after = drift[role].runs
        assert before.knocked
        assert not after.knocked
        assert before.knots_s[-1] < AMID_FAR_S < after.knots_s[0]
        (jump_rad,) = drift[role].knocks_rad
        assert jump_rad == pytest.approx(math.hypot(*turns[:2]), abs=0.5 / F_PX)


def test_two_knocks_are_two() -> None:
    drift = drift_of(knocked((AMID_FAR_S, HARD), (AMID_NEAR_S, SOFT)))
    first, second = drift[Role.LEFT].knocks_rad
    assert first > 100.0 / F_PX
    assert second == pytest.approx(math.hypot(*SOFT[0][:2]), abs=0.7 / F_PX)


@pytest.mark.parametrize("drift_deg", [0.0, 0.03])
def test_a_mount_that_drifts_however_fast_was_not_knocked(drift_deg: float) -> None:
    drift = drift_of(session(UPRIGHT, drift_deg))
    for role in EYES:
        assert len(drift[role].runs) == 1
        assert drift[role].knocks_rad == ()


def bent(sweep: Sweep) -> Sweep:
    """Return a sweep whose left gaze is 10 px aside over its upper rows, always, whatever the time."""

    def lower(pose: SweepPose) -> SweepPose:
        left = pose.left
        if left is None or pose.index < 4 * sweep.header.plan.columns:
            return pose
        aside = replace(left.corners, corners_px=left.corners.corners_px + np.array([6.0, -8.0]))
        return replace(pose, left=replace(left, corners=aside))

    return replace(
        sweep,
        poses=tuple(lower(pose) for pose in sweep.poses),
        repeats=tuple(lower(pose) for pose in sweep.repeats),
    )


def test_what_goes_with_the_row_is_no_knock() -> None:
    """It looks like one in the order of the poses; the nodes that were visited again know better."""
    far, near = session(UPRIGHT)
    for sweeps in ((bent(far), near), (far, bent(near)), (bent(far),)):
        assert [len(eye.runs) for eye in drift_of(sweeps).values()] == [1, 1]


def spoilt(sweep: Sweep, *indices: int) -> Sweep:
    """Return a sweep at whose poses the left eye's marker was found at wrong places."""
    poses = list(sweep.poses)
    for index in indices:
        left = poses[index].left
        assert left is not None
        aside = replace(left.corners, corners_px=left.corners.corners_px + np.array([30.0, -20.0]))
        poses[index] = replace(poses[index], left=replace(left, corners=aside))
    return replace(sweep, poses=tuple(poses))


def test_poses_that_went_wrong_are_no_knock_and_hide_none() -> None:
    far, near = session(UPRIGHT)
    wrong = drift_of((spoilt(far, 12, 40, 77), near))
    assert [len(eye.runs) for eye in wrong.values()] == [1, 1]

    far, near = knocked((AMID_NEAR_S, SOFT))
    (jump_rad,) = drift_of((spoilt(far, 12, 40, 77), near))[Role.LEFT].knocks_rad
    assert jump_rad == pytest.approx(math.hypot(*SOFT[0][:2]), abs=0.7 / F_PX)


def test_an_eye_whose_marker_stays_hidden_after_the_knock_keeps_what_it_measured() -> None:
    """The left eye sees nothing any more: it stays as it was before, and the right one is whole."""
    hit = [
        replace(
            sweep,
            poses=tuple(hidden(pose) for pose in sweep.poses),
            repeats=tuple(hidden(pose) for pose in sweep.repeats),
        )
        for sweep in knocked((AMID_NEAR_S, HARD_RIGHT))
    ]
    drift = drift_of(tuple(hit))
    (jump_rad,) = drift[Role.RIGHT].knocks_rad
    assert jump_rad == pytest.approx(math.hypot(*HARD_RIGHT[1][:2]), abs=1.5 / F_PX)
    assert drift[Role.LEFT].knocks_rad == ()


def hidden(pose: SweepPose) -> SweepPose:
    return replace(pose, left=None, left_refusal="hidden") if pose.t_ns > 1e9 * AMID_NEAR_S else pose
