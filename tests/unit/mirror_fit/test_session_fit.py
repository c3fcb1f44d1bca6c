"""A session's fit, judged by the simulation's truth at poses never seen; the paper's plain model beside."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.swept_rig import EYES, SweptRig, swept, visited, wide_lens

from foveacam_bench.calibration.truth import CalibrationModel, judge
from foveacam_hardware.contract import OutOfRange, Role
from foveacam_pipeline.calibrate.fit.fit_pictures import fit_pictures
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig
from foveacam_pipeline.calibrate.fit.session_fit import FitResult, FitSettings, fit_session
from foveacam_pipeline.calibrate.records.compare import compare
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.models import Intrinsics

pytestmark = pytest.mark.slow

DRAWING = NominalRig(rig_id="sim-1")


@pytest.fixture(scope="module")
def swept_rig() -> SweptRig:
    return SweptRig(1)


@pytest.fixture(scope="module")
def lens(swept_rig: SweptRig) -> Intrinsics:
    return wide_lens(swept_rig)


@pytest.fixture(scope="module")
def result(lens: Intrinsics) -> FitResult:
    sweeps = [swept(1, 5.0), swept(1, 2.5)]
    return fit_session(sweeps, lens, drawing=DRAWING, label="both", session_id="abc")


def test_eyes_point_and_rectify_within_the_bars_where_they_were_not_swept(
    swept_rig: SweptRig, result: FitResult
) -> None:
    figures = judge(CalibrationModel(result.calibration), swept_rig, seed=3, count=100)
    # 0.05 wide px on fifty corners, 37 coefficients of 150 poses, the order's own end: about 0.15 fovea px.
    assert figures["pointing_rms_px"] < 0.4
    assert figures["epipolar_rms_px"] < 0.3
    assert figures["epipolar_p95_px"] < 0.8
    assert figures["depth_bias_rel_5m"] < 0.0005
    assert figures["depth_bias_rel_15m"] < 0.001


def test_volts_survive_the_way_to_angles_and_back(result: FitResult) -> None:
    assert result.volts_roundtrip_max_lsb < 1e-3


def test_the_paper_s_plain_model_stands_beside_it_and_is_worse_in_all(
    swept_rig: SweptRig, result: FitResult
) -> None:
    assert result.paper is not None
    figures = judge(result.paper, swept_rig, seed=3, count=60)
    assert 8.0 < figures["pointing_rms_px"] < 30.0  # the cubic's own end: 8.6 px an axis
    assert figures["epipolar_rms_px"] > 3.0
    assert figures["depth_bias_rel_15m"] > 0.018  # Eq. 1 is left in: half as much if it were not
    assert result.paper.roundtrip_lsb > 50.0
    assert result.paper.station == "markers at 5 m"
    with pytest.raises(OutOfRange, match="beyond what was swept"):
        result.paper.steer(0.3, 0.0)


def test_each_addition_is_worth_something(result: FitResult) -> None:
    scores = {score.name: score for score in result.variants}
    ours = scores["ours"]
    assert ours.pointing_rms_px < 0.5
    assert ours.epipolar_rms_px < 0.35
    for name, least in (
        ("paper", 20.0),
        ("ours, but the cubic", 20.0),
        ("ours, but Eq. 1 left in", 10.0),
        ("ours, but one distance", 2.0),
        ("ours, but pivot and pupil as drawn", 2.0),
    ):
        assert scores[name].pointing_rms_px > least * ours.pointing_rms_px
    assert scores["ours, but pose by pose"].rectification_rms_px > ours.rectification_rms_px


def test_variants_are_judged_at_nodes_that_they_were_not_fitted_to(result: FitResult) -> None:
    fitted_rad = [math.hypot(*mirror.chosen.rms_rad) for mirror in result.fit.mirrors.values()]
    fitted_px = result.calibration.fovea_f_px * math.sqrt(float(np.mean(np.square(fitted_rad))))
    ours = next(score for score in result.variants if score.name == "ours")
    assert ours.pointing_rms_px > 1.4 * fitted_px  # 1.1 at the nodes of the fit themselves


def test_the_calibration_names_its_session_and_both_tables_name_one_winner(result: FitResult) -> None:
    assert result.calibration.session_id == "abc"
    assert result.calibration.origin == "measured"
    for role in EYES:
        assert sum(score.chosen for score in result.models[role]) == 1
        assert sum(score.chosen for score in result.fit.fields[role].scores) == 1
        assert [score.order for score in result.models[role] if score.paper] == [3]


def test_pivots_and_pupil_are_those_of_the_rig(swept_rig: SweptRig, result: FitResult) -> None:
    calibration = result.calibration
    assert calibration.pupil_m == pytest.approx(0.040, abs=0.3e-3)
    apart = swept_rig.pivot_m(Role.RIGHT) - swept_rig.pivot_m(Role.LEFT)
    # The camera's axis passes up to 0.3 mm beside each pivot, and the gaze leaves from there.
    assert calibration.baseline_m == pytest.approx(float(apart[0]), abs=0.6e-3)


def test_an_operator_may_choose_the_orders(lens: Intrinsics) -> None:
    settings = FitSettings(mirror_order=5, field_order=2, pose_by_pose=True, compare=False)
    found = fit_session([swept(1, 5.0)], lens, drawing=DRAWING, label="fives", settings=settings)
    for role in EYES:
        assert found.calibration.eye(role).mirror.forward.order == 5
        assert found.calibration.eye(role).homography.polynomial.order == 2
        assert "pose by pose" in found.fit.fields[role].scores[0].name
    assert found.variants == ()


def test_one_distance_keeps_the_drawing(lens: Intrinsics) -> None:
    sweeps = [swept(1, 5.0), swept(1, 2.5)]
    settings = FitSettings(all_distances=False, compare=False)
    found = fit_session(sweeps, lens, drawing=DRAWING, label="far", settings=settings)
    assert [parallax.station for parallax in found.parallax] == ["markers at 5 m"]
    assert found.calibration.baseline_m == 0.2
    assert found.calibration.pupil_m == 0.04


def test_an_unknown_distance_is_reported_and_costs_pixels(swept_rig: SweptRig, lens: Intrinsics) -> None:
    settings = FitSettings(distance=DistanceSource.UNKNOWN, compare=False)
    found = fit_session([swept(1, 5.0)], lens, drawing=DRAWING, label="unknown", settings=settings)
    assert not found.parallax[0].corrected
    assert judge(CalibrationModel(found.calibration), swept_rig, seed=3, count=40)["pointing_rms_px"] > 1.5


def test_a_wrong_pose_does_not_pull_the_fit(swept_rig: SweptRig, lens: Intrinsics, result: FitResult) -> None:
    sweep = swept(1, 5.0)
    pose = sweep.poses[40]
    assert pose.left is not None
    x_v, y_v = pose.left.volts_v
    off = replace(pose, left=replace(pose.left, volts_v=(x_v + 2.0, y_v)))  # 60 fovea px
    spoilt = replace(sweep, poses=(*sweep.poses[:40], off, *sweep.poses[41:]))
    settings = FitSettings(compare=False)
    found = fit_session([spoilt, swept(1, 2.5)], lens, drawing=DRAWING, label="one off", settings=settings)
    assert judge(CalibrationModel(found.calibration), swept_rig, seed=3, count=60)["pointing_rms_px"] < 0.6


def test_pictures_of_a_fit_are_png(result: FitResult) -> None:
    pictures = fit_pictures(result)
    assert set(pictures) == {"quiver_left", "quiver_right", "loo", "warp_left", "warp_right"}
    for draw in pictures.values():
        assert draw().startswith(b"\x89PNG\r\n")


def test_a_direction_that_was_not_swept_is_refused(result: FitResult) -> None:
    mirror = result.calibration.left.mirror
    with pytest.raises(OutOfRange, match="beyond the calibrated field"):
        mirror.volts(float(np.deg2rad(12.0)), 0.0)


def test_sweeps_of_two_sessions_are_fitted_as_one(lens: Intrinsics) -> None:
    """The mounts turn by pixels between the sessions: found, and all referred to the end of the later one."""
    runs = ("2026-01-01T08:00", "2026-01-01T12:00")
    earlier, later = (
        session_of(run, begin_s=begin_s) for run, begin_s in zip(runs, (10.0, 4000.0), strict=True)
    )
    settings = FitSettings(mirror_order=8, field_order=3, compare=False)
    before, after, both = (
        fit_session(sweeps, lens, drawing=DRAWING, label="fit", settings=settings)
        for sweeps in (earlier, later, [*earlier, *later])
    )
    assert both.drift is not None
    assert {len(drift.runs) for drift in both.drift.values()} == {2}
    moved, off = (compare(after.calibration, fit.calibration) for fit in (before, both))
    assert moved.pointing.rms_px > 2.0
    assert off.pointing.rms_px < 0.4
    assert off.epipolar.rms_px < 0.3


def session_of(run: str, *, begin_s: float) -> list[Sweep]:
    """Return sweeps at two distances on a mount that drifts, some nodes visited again."""
    sweeps = []
    for distance_m, after_s in ((5.0, 0.0), (2.5, 200.0)):
        sweep = swept(1, distance_m, drift_deg=0.01, begin_s=begin_s + after_s)
        visits = {begin_s + after_s + 100.0 + 2.0 * k: node for k, node in enumerate((10, 40, 70))}
        sweep = visited(sweep, visits, drift_deg=0.01, run=run)
        station = replace(sweep.header.station, name=f"{sweep.header.station.name} of {run}")
        sweeps.append(replace(sweep, header=replace(sweep.header, station=station)))
    return sweeps
