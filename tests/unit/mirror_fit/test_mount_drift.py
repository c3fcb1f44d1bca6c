"""Drift of the mounts during the sweeps: seen at nodes visited again, taken out, and stated."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.support.scenes.swept_rig import EYES, POSE_S, SweptRig, Turns, swept, visited, wide_lens

from foveacam_bench.calibration.truth import CalibrationModel, judge
from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_hardware.sim.faults import ThermalMountDrift as TrueDrift
from foveacam_hardware.sim.optics import EyeProjection
from foveacam_pipeline.calibrate.drift.check import check_drift_at_nodes
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.fit.fit import FitChoice, fit_rig
from foveacam_pipeline.calibrate.fit.fit_pictures import drift_figure
from foveacam_pipeline.calibrate.fit.measured import (
    DistanceSource,
    NominalRig,
    SweepMeasurements,
    reduce_sweeps,
)
from foveacam_pipeline.calibrate.fit.pivot import DRIFT_RAD, mount_sigma_rad
from foveacam_pipeline.calibrate.fit.samples import DriftRun, MountDrift, turn_back
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_reference import has_returned, middle_node, nodes_to_return_to
from foveacam_pipeline.models import Calibration, Intrinsics

pytestmark = pytest.mark.slow

SEED = 7
F_PX = 28_760.0
FAST_DEG = 0.012
"""Six times as much as the simulated mounts usually drift."""
FAR_S, NEAR_S = 10.0, 70.0
END_S = NEAR_S + 81 * POSE_S + 12.0
QUICK = FitChoice(mirror_orders=(7, 8), spring_orders=(), field_orders=(3,))


class SweptAt(SweptRig):
    """The truth of one moment."""

    def __init__(self, *, drift_deg: float, at_s: float) -> None:
        super().__init__(SEED, drift_deg=drift_deg)
        self._at_ns = round(1e9 * at_s)

    def static_projection(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        return super().static_projection(role, volts, t_ns=self._at_ns)


@cache
def lens() -> Intrinsics:
    return wide_lens(SweptRig(SEED))


def middles(sweep: Sweep, begin_s: float) -> dict[float, int]:
    """The middle every two rows, before and after."""
    middle = middle_node(sweep.header.plan)
    return {begin_s + POSE_S * (index - 0.5): middle for index in (0, 18, 36, 54, 72, 82)}


def returns(sweep: Sweep, begin_s: float) -> dict[float, int]:
    return {begin_s + 1.0 * k: index for k, index in enumerate(nodes_to_return_to(sweep))}


@cache
def session(drift_deg: float) -> tuple[Sweep, Sweep]:
    """Both stations one after the other with all visits, then back at the first one."""
    far = swept(SEED, 5.0, drift_deg=drift_deg, begin_s=FAR_S)
    near = swept(SEED, 2.5, drift_deg=drift_deg, begin_s=NEAR_S)
    back = returns(far, END_S - 4.0)
    return (
        visited(far, {**middles(far, FAR_S), **back}, drift_deg=drift_deg, run="one"),
        visited(near, middles(near, NEAR_S), drift_deg=drift_deg, run="one"),
    )


def measured(*sweeps: Sweep, take_out_drift: bool = True) -> SweepMeasurements:
    drawing = NominalRig(rig_id=f"sim-{SEED}")
    return reduce_sweeps(sweeps, lens(), drawing=drawing, label="drifting", take_out_drift=take_out_drift)


@cache
def fitted(drift_deg: float, *, take_out_drift: bool) -> Calibration:
    found = measured(*session(drift_deg), take_out_drift=take_out_drift)
    return fit_rig(found.rig, QUICK).calibration


def figures(calibration: Calibration, *, at_s: float, drift_deg: float = FAST_DEG) -> dict[str, float]:
    return judge(CalibrationModel(calibration), SweptAt(drift_deg=drift_deg, at_s=at_s), seed=3, count=60)


def test_without_the_visits_drift_spoils_a_calibration_and_with_them_it_does_not() -> None:
    spoilt = figures(fitted(FAST_DEG, take_out_drift=False), at_s=END_S)
    mended = figures(fitted(FAST_DEG, take_out_drift=True), at_s=END_S)

    assert spoilt["epipolar_rms_px"] > 1.2
    assert spoilt["pointing_rms_px"] > 1.0
    # 0.07 px a pose, 12 px of drift in straight pieces of 15 s, and the model's own end as without drift
    assert mended["epipolar_rms_px"] < 0.4
    assert mended["pointing_rms_px"] < 0.6
    assert mended["depth_bias_rel_15m"] < 0.002


def test_the_drift_found_is_the_true_one_within_its_error() -> None:
    drift = measured(*session(FAST_DEG)).drift
    assert drift is not None
    truth = TrueDrift(seed=SEED, amplitude_rad=math.radians(FAST_DEG))
    for role in EYES:
        (run,) = drift[role].runs
        end = truth.turn_rad(role, float(run.knots_s[-1]))
        true = np.array([truth.turn_rad(role, t_s) - end for t_s in run.knots_s.tolist()])
        missed = np.abs(run.turn_rad[:, :2] - true)
        # a straight piece between knots leaves some hundredths of a px of a swing of 12 px beside them
        assert (missed < 4.0 * run.sigma_rad + 0.3 / F_PX).all()
        assert drift[role].sigma_rad[0] < 0.15 / F_PX
        assert drift[role].rad_per_minute > 0.5 / F_PX


def test_a_mount_that_does_not_drift_is_left_alone() -> None:
    drift = measured(*session(0.0)).drift
    assert drift is not None
    for role in EYES:
        assert drift[role].moved_rad < 0.4 / F_PX
        assert drift[role].stated_rad[0] < 0.3 / F_PX


def test_runs_on_other_clocks_are_brought_together_by_their_visits() -> None:
    """The far sweep was made hours before: another run, its clock began anew, the mounts elsewhere."""
    before = swept(SEED, 5.0, drift_deg=FAST_DEG, begin_s=FAR_S + 500.0)
    far = visited(before, middles(before, FAR_S + 500.0), drift_deg=FAST_DEG, run="one")
    early = replace(far, poses=tuple(earlier(pose) for pose in far.poses), repeats=())
    early = replace(early, repeats=tuple(earlier(pose) for pose in far.repeats))
    far = visited(early, returns(before, END_S - 4.0), drift_deg=FAST_DEG, run="two")
    near = swept(SEED, 2.5, drift_deg=FAST_DEG, begin_s=NEAR_S)
    near = visited(near, middles(near, NEAR_S), drift_deg=FAST_DEG, run="two")

    found = measured(far, near)

    assert found.drift is not None
    truth = TrueDrift(seed=SEED, amplitude_rad=math.radians(FAST_DEG))
    for role in EYES:
        first, last = found.drift[role].runs
        end = truth.turn_rad(role, float(last.knots_s[-1]))
        true = np.array([truth.turn_rad(role, t_s + 500.0) - end for t_s in first.knots_s.tolist()])
        assert np.abs(true).max() > 3.0 / F_PX
        assert (np.abs(first.turn_rad[:, :2] - true) < 4.0 * first.sigma_rad + 0.3 / F_PX).all()


def test_mounts_that_were_moved_far_between_two_sessions_are_brought_together() -> None:
    """Both stations, then the rig is carried: each mount turns by 0.3 deg and rolls; then both once more."""
    knocks: Turns = ((-0.004, 0.003, 0.0017), (0.0035, -0.0038, -0.0017))
    after = session(0.0)
    before = tuple(
        visited(
            sweep := swept(SEED, distance_m, begin_s=begin_s, knocked_rad=knocks),
            middles(sweep, begin_s),
            drift_deg=0.0,
            run="0",
            knocked_rad=knocks,
        )
        for distance_m, begin_s in ((5.0, FAR_S), (2.5, NEAR_S))
    )

    found = measured(*(named_again(sweep) for sweep in before), *after)

    assert found.drift is not None
    for role, knock in zip(EYES, knocks, strict=True):
        first, last = found.drift[role].runs
        assert first.turn_rad[0] == pytest.approx(knock, abs=1.5 / F_PX)
        assert np.abs(last.turn_rad[:, :2]).max() < 0.4 / F_PX
        assert np.abs(last.turn_rad[:, 2]).max() < 0.4 / F_PX / math.tan(math.radians(9.0))  # at the rim
    both = figures(fit_rig(found.rig, QUICK).calibration, at_s=END_S, drift_deg=0.0)
    alone = figures(fitted(0.0, take_out_drift=True), at_s=END_S, drift_deg=0.0)
    assert both["epipolar_rms_px"] < alone["epipolar_rms_px"] + 0.2
    assert both["pointing_rms_px"] < alone["pointing_rms_px"] + 0.2


def named_again(sweep: Sweep) -> Sweep:
    station = sweep.header.station
    return replace(sweep, header=replace(sweep.header, station=replace(station, name=f"{station.name} (2)")))


def earlier(pose: SweepPose) -> SweepPose:
    return replace(pose, t_ns=pose.t_ns - round(500e9))


def test_sweeps_without_visits_keep_the_assumed_drift() -> None:
    found = measured(swept(SEED, 5.0), swept(SEED, 2.5))
    assert found.drift is None
    assert mount_sigma_rad(found.rig.left) == (DRIFT_RAD, DRIFT_RAD)


def test_a_calibration_states_the_drift_that_was_measured() -> None:
    found = measured(*session(FAST_DEG))
    assert found.drift is not None
    calibration = fitted(FAST_DEG, take_out_drift=True)
    for role in EYES:
        stated = found.drift[role].stated_rad
        assert stated[0] > found.drift[role].sigma_rad[0]
        for kept, least in zip(calibration.eye(role).mirror.sigma_rad, stated, strict=True):
            assert least <= kept < math.hypot(least, 0.5 / F_PX)


def test_what_drifts_after_the_fit_is_taken_out_by_nodes_visited_once_more() -> None:
    calibration = fitted(FAST_DEG, take_out_drift=True)
    far, near = session(FAST_DEG)
    later_s = END_S + 60.0
    far = visited(far, returns(far, later_s), drift_deg=FAST_DEG, run="three")
    visits = [pose for pose in far.repeats if pose.run == "three"]

    found = check_drift_at_nodes([far, near], visits, calibration, distance=DistanceSource.PRINT)
    corrected = correct_calibration(calibration, found, created_utc="2026-01-31T13:00:00+00:00")
    again = check_drift_at_nodes([far, near], visits, corrected, distance=DistanceSource.PRINT)

    assert found.locked
    assert found.significant
    assert figures(calibration, at_s=later_s + 2.0)["pointing_rms_px"] > 1.5
    after = figures(corrected, at_s=later_s + 2.0)
    assert after["pointing_rms_px"] < 0.6
    assert after["epipolar_rms_px"] < 0.4
    assert not again.significant  # twice gives the same
    assert corrected.parent_id == calibration.id


def test_a_shot_without_visits_has_no_lock() -> None:
    calibration = fitted(FAST_DEG, take_out_drift=True)
    found = check_drift_at_nodes(session(FAST_DEG), [], calibration, distance=DistanceSource.PRINT)
    assert not found.locked
    assert not found.significant


def test_gaze_and_corners_turn_back_together() -> None:
    turn = np.array([[1e-3, -2e-3, 3e-3]])
    angles, corners = np.array([[0.1, -0.05]]), np.array([[[300.0, 200.0], [np.nan, np.nan]]])
    gaze, plane = turn_back(angles, corners, turn, f_px=F_PX)
    there, back = turn_back(gaze, plane, -turn, f_px=F_PX)
    assert np.abs(gaze - angles).max() > 1e-3
    assert plane[0, 0] == pytest.approx([300.0, 200.0], abs=3.0)  # 3 mrad of roll on 360 px
    np.testing.assert_allclose(there, angles, atol=1e-8)  # small turns: the order of the axes is felt squared
    np.testing.assert_allclose(back[0, 0], corners[0, 0], atol=1e-3)
    assert np.isnan(plane[0, 1]).all()


def test_a_drift_says_how_fast_and_how_far() -> None:
    run = DriftRun(
        knots_s=np.array([0.0, 60.0, 120.0]),
        turn_rad=np.array([[0.0, 2e-5, 0.0], [0.0, -1e-5, 0.0], [0.0, 0.0, 0.0]]),
        sigma_rad=np.full((3, 2), 1e-6),
    )
    drift = MountDrift(runs=(run,), sigma_rad=(1e-6, 2e-6), pivot_sigma_m=1e-5, visits=9)
    assert drift.minutes == 2.0
    assert drift.pieces == 2
    assert drift.moved_rad == pytest.approx(2e-5)
    assert drift.rad_per_minute == pytest.approx(2e-5)  # 3e-5 and 1e-5 in two minutes
    assert drift.stated_rad[1] == pytest.approx(2e-6)  # never left its row: its error alone
    assert len(drift_figure({Role.LEFT: drift, Role.RIGHT: drift}, f_px=F_PX).axes) == 2


def test_runs_are_drawn_one_after_the_other_and_the_far_one_says_how_far() -> None:
    knots_s = np.array([1000.0, 1060.0])
    far = DriftRun(
        knots_s=knots_s,
        turn_rad=np.array([[0.0, 5e-3, 0.0], [0.0, 5.01e-3, 0.0]]),
        sigma_rad=np.full((2, 2), 1e-6),
    )
    last = DriftRun(knots_s=np.array([30.0]), turn_rad=np.zeros((1, 3)), sigma_rad=np.full((1, 2), 1e-6))
    drift = MountDrift(runs=(far, last), sigma_rad=(1e-6, 2e-6), pivot_sigma_m=1e-5, visits=9)

    (axes,) = drift_figure({Role.LEFT: drift}, f_px=F_PX).axes

    assert [text.get_text() for text in axes.texts] == ["144.1 px off"]
    low_px, high_px = axes.get_ylim()
    assert high_px - low_px < 2.0  # what a run did is not lost beside where it stood
    begin_min, end_min = axes.get_xlim()
    assert begin_min < -1.0 < end_min


def test_the_rig_has_returned_once_nodes_out_in_the_field_were_visited_in_the_last_run() -> None:
    far, near = session(0.0)
    assert has_returned([far, near])
    assert not has_returned([replace(far, repeats=far.repeats[:6]), near])
    poses = (*near.poses[:-1], replace(near.poses[-1], run="two"))
    assert not has_returned([far, replace(near, poses=poses)])  # resumed since: the mounts have drifted on
    assert not has_returned([swept(SEED, 5.0)])


def test_a_grid_without_a_node_in_its_middle_is_returned_to_once() -> None:
    even = swept(SEED, 5.0, side=4, field_deg=5.0)
    nodes = nodes_to_return_to(even)
    assert len(nodes) == 4  # the nearest to the middle is one of those out in the field
    visits = {100.0 + number: node for number, node in enumerate(nodes)}
    assert has_returned([visited(even, visits, drift_deg=0.0, run="one")])
    assert not has_returned([visited(even, {100.0: nodes[0]}, drift_deg=0.0, run="one")])


def test_nodes_to_return_to_lie_in_the_middle_and_out_in_all_four_quarters() -> None:
    sweep = swept(SEED, 5.0)
    nodes = sweep.header.plan.nodes_rad()[nodes_to_return_to(sweep)]
    assert np.abs(nodes[0]).max() == pytest.approx(0.0, abs=1e-9)
    assert {(x > 0.0, y > 0.0) for x, y in nodes[1:].tolist()} == {
        (a, b) for a in (True, False) for b in (True, False)
    }
