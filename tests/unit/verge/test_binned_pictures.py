"""One scene at both binnings: all procedures tell the same, in pixels of the sensor, with honest errors."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.binned_head import BinnedHead, binned_frame, binned_sighting
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Head, InvalidInput, Role, Sighting
from foveacam_pipeline.calibrate.drift.patches import DistinctnessMap, select_patches
from foveacam_pipeline.calibrate.drift.place_finder import DriftExpectation, DriftPlaceFinder
from foveacam_pipeline.calibrate.drift.values import DriftSettings
from foveacam_pipeline.continuous_loop.guide_match import errors_of, match_guide
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.stereo.match import gray, match
from foveacam_pipeline.stereo.rectify import rectify, to_uint8
from foveacam_pipeline.track.follow import Follower
from foveacam_pipeline.track.target import FollowedTarget, FollowState
from foveacam_pipeline.verge.aim import Gazes, aim_at, gazes_under, volts_for
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.matching.fine import MatchGuess, match_fine
from foveacam_pipeline.verge.matching.survey import reduce_eye
from foveacam_pipeline.verge.matching.wide_patch import cut_view, survey_f_px
from foveacam_pipeline.verge.single_eye.eye_match import SHARED_SIGMA_PX, register_eye, view_half_px
from foveacam_pipeline.verge.suggest import suggest_targets
from foveacam_pipeline.verge.values import Basis, Fixation, FixationState, PixelTarget
from foveacam_pipeline.wide_depth.rendering import context_cloud
from foveacam_pipeline.wide_depth.values import DepthSource
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_pipeline.wide_depth.wide_matches import wide_matches

pytestmark = pytest.mark.slow

CLICK = PixelTarget(x_px=850.3, y_px=420.7)
TARGET = np.array([0.02, -0.03])
Z_M = 6.0
NOISE = 6.0
"""Enough for noise, and not interpolation, to make the errors, grey levels."""


def plane(**options: object) -> PlaneHead:
    return PlaneHead(z_m=Z_M, texture=noise_texture(), **options)  # type: ignore[arg-type]  # options of the painted head


def looks(head: PlaneHead, *, off_per_m: float = 0.0) -> tuple[Sighting, Sighting]:
    """Return one look at the target at both binnings, the gazes meeting beside the plane's depth."""
    full = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, TARGET, 1.0 / Z_M + off_per_m)))
    return full, binned_sighting(full)


def offsets(sighting: Sighting) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the true (2,) tangents of the target from both gazes."""
    true, gazes = aim_at(CALIBRATION, TARGET, 1.0 / Z_M), gazes_under(CALIBRATION, sighting.volts)
    return true.left - gazes.left, true.right - gazes.right


def fixated(head: Head, painted: PlaneHead) -> Fixation:
    return fixate(head, CALIBRATION, CLICK, clock=painted.clock)


@pytest.mark.parametrize("z_m", [1.8, 9.0])
def test_a_click_is_answered_alike_at_both_binnings(z_m: float) -> None:
    answers = []
    for binned in (False, True):
        painted = PlaneHead(z_m=z_m, texture=noise_texture())
        answers.append(fixated(BinnedHead(painted) if binned else painted, painted))
    full, half = answers
    assert half.state is FixationState.VERGED, half.reason
    assert full.distance_m is not None and full.distance_sigma_m is not None
    assert half.distance_m is not None and half.distance_sigma_m is not None
    true_m = z_m * math.hypot(1.0, math.tan(half.target_ax_rad), math.tan(half.target_ay_rad))
    assert abs(half.distance_m - true_m) <= 3.0 * half.distance_sigma_m
    assert half.distance_m == pytest.approx(full.distance_m, abs=0.1 * full.distance_sigma_m)
    assert half.distance_sigma_m == pytest.approx(full.distance_sigma_m, rel=0.05)
    assert half.residual_px is not None and half.residual_px <= 0.71  # of the sensor
    assert (half.target_ax_rad, half.target_ay_rad) == (full.target_ax_rad, full.target_ay_rad)


def test_one_eye_and_the_wide_camera_answer_at_binning_two() -> None:
    painted = plane(blind=frozenset({Role.LEFT}))
    found = fixated(BinnedHead(painted), painted)
    assert found.basis is Basis.FOVEA_AND_WIDE, found.reason
    assert found.distance_m is not None and found.distance_sigma_m is not None
    true_m = Z_M * math.hypot(1.0, math.tan(found.target_ax_rad), math.tan(found.target_ay_rad))
    assert abs(found.distance_m - true_m) <= 3.0 * found.distance_sigma_m


def test_matches_state_honest_errors_in_sensor_pixels_at_both_binnings() -> None:
    painted = plane(noise=NOISE)  # drawn anew in each look
    errors: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(8):
        for sighting in looks(painted, off_per_m=2e-4):
            left, right = offsets(sighting)
            true_px = CALIBRATION.fovea_f_px * (left - right)[0]
            fine = match_fine(sighting, CALIBRATION, MatchGuess(left=left + 5e-5, right=right))
            errors[sighting.left.binning].append((fine.residual_x_px - true_px) / fine.sigma_x_px)
    for found in errors.values():
        assert max(map(abs, found)) <= 3.0
        assert 0.5 <= float(np.sqrt(np.mean(np.square(found)))) <= 1.2
    assert abs(true_px) > 1.0  # else half a pixel would not show


def test_one_eye_against_the_wide_view_states_honest_errors_at_both_binnings() -> None:
    f_px, half_baseline_m = survey_f_px(CALIBRATION.wide), CALIBRATION.baseline_m / 2.0
    pose_per_m = CALIBRATION.left.angle_sigma_rad(Z_M)[0] / half_baseline_m
    shared_per_m = SHARED_SIGMA_PX / f_px / half_baseline_m  # neither drift nor fine texture here
    errors: dict[int, list[float]] = {1: [], 2: []}
    for shift in np.linspace(0.0, 0.8, 5):
        for sighting in looks(plane(noise=NOISE, shift_m=lambda t_ns, at=shift: (at, 0.3 * at))):
            eye = reduce_eye(sighting, CALIBRATION, Role.LEFT, f_px=f_px, depth_m=Z_M)
            image = gray(to_uint8(sighting.wide))
            view = cut_view(image, CALIBRATION.wide, TARGET, f_px=f_px, half=view_half_px())
            found = register_eye(eye, Role.LEFT, view, TARGET, 1.0 / Z_M, calibration=CALIBRATION, f_px=f_px)
            assert found is not None
            own_per_m = math.sqrt(found.sigma_per_m**2 - pose_per_m**2 - shared_per_m**2)
            errors[sighting.left.binning].append((found.inverse_z_per_m - 1.0 / Z_M) / own_per_m)
    for binned in errors.values():
        assert max(map(abs, binned)) <= 3.0
        assert float(np.sqrt(np.mean(np.square(binned)))) >= 0.3


def test_the_loop_measures_the_same_errors_at_both_binnings() -> None:
    full, half = (
        errors_of(
            sighting,
            CALIBRATION,
            match_guide(sighting, CALIBRATION, TARGET, LoopSettings()),
            TARGET,
        )
        for sighting in looks(plane(), off_per_m=2e-3)
    )
    assert full.fine and half.fine
    px_rad = 1.0 / CALIBRATION.wide.fx_px
    assert half.values_rad[:2] == pytest.approx(full.values_rad[:2], abs=0.5 * px_rad)
    assert half.values_rad[2:] == pytest.approx(full.values_rad[2:], abs=0.1 / CALIBRATION.fovea_f_px)


def test_a_walker_is_followed_at_binning_two() -> None:
    painted = plane(shift_m=lambda t_ns: (0.3 * math.sin(2.0 * t_ns / 1e9), 0.0))
    head = BinnedHead(painted)
    x_m, y_m = painted.shift_m(painted.clock.now_ns() + painted.look_ns)
    point = (x_m, y_m, Z_M)
    sighting = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.array(point[:2]) / Z_M, 1.0 / Z_M)))
    follower = Follower(CALIBRATION, clock=painted.clock)
    wide = gray(to_uint8(sighting.wide))
    follower.add(FollowedTarget("one", sighting, point, calibration=CALIBRATION, wide=wide))
    for _ in range(10):
        step = follower.step(head)
    report = follower.reports()[0]
    assert (report.state, report.hits) == (FollowState.FOLLOWED, 10)
    true_m = np.array([*painted.shift_m(step.t_ns), Z_M])
    assert np.linalg.norm(follower.targets["one"].at(step.t_ns).position_rig_m - true_m) < 0.02


def test_coarse_depth_against_the_wide_view_is_honest_at_both_binnings() -> None:
    for sighting in looks(plane()):
        found = wide_matches(sighting, CALIBRATION)
        assert len(found) > 300
        sigmas = np.abs(found.inverse_z_per_m - 1.0 / Z_M) / found.sigma_per_m
        assert float(np.median(found.inverse_z_per_m)) == pytest.approx(1.0 / Z_M, abs=6e-4)
        assert np.mean(sigmas <= 3.0) >= 0.99
        assert float(np.quantile(sigmas, 0.68)) >= 0.2


def test_dense_depth_is_the_same_window_and_disparity_at_both_binnings() -> None:
    full, half = (rectify(sighting, CALIBRATION, scale=0.5) for sighting in looks(plane(), off_per_m=1e-3))
    assert (half.f_px, half.u0_left_px, half.v0_px) == pytest.approx((full.f_px, full.u0_left_px, full.v0_px))
    assert half.pose_sigma_px == full.pose_sigma_px
    assert np.abs(half.left.astype(int) - full.left)[full.valid_left & half.valid_left].max() <= 1
    found = [float(np.nanmedian(match(pair).residual_px)) for pair in (full, half)]
    assert found[1] == pytest.approx(found[0], abs=0.02)


def test_a_binned_look_has_no_depth_at_full_size_and_says_so() -> None:
    with pytest.raises(InvalidInput, match="binned by 2 and show no more than scale"):
        rectify(looks(plane())[1], CALIBRATION, scale=1.0)


def test_looks_whose_cameras_bin_differently_are_refused() -> None:
    full, half = looks(plane())
    mixed = replace(full, right=half.right)
    with pytest.raises(InvalidInput, match="left frame is binned by 1, the right one by 2"):
        rectify(mixed, CALIBRATION)
    with pytest.raises(InvalidInput, match="set all cameras alike"):
        match_fine(mixed, CALIBRATION, MatchGuess(left=np.zeros(2), right=np.zeros(2)))


def test_a_drift_check_places_patches_alike_at_both_binnings() -> None:
    painted, settings = plane(), DriftSettings()
    first = painted.wide()
    found = []
    for head, frame in ((painted, first), (BinnedHead(painted), binned_frame(first))):
        image = gray(to_uint8(frame))
        field = DistinctnessMap.of((image, image), CALIBRATION, settings)
        assert field.energy.shape == (1080, 1440)
        finder = DriftPlaceFinder(head, CALIBRATION, settings)
        expected = DriftExpectation(inverse_depths=[1.0 / Z_M])
        place = finder.measure(select_patches(field, CALIBRATION, settings)[0], expected)
        assert place is not None
        truth = aim_at(CALIBRATION, np.array(place.target), 1.0 / Z_M)
        found.append(_errors(Gazes(left=np.array(place.left), right=np.array(place.right)), truth))
    for errors in found:
        assert np.abs(errors).max() <= 0.5 / CALIBRATION.wide.fx_px
        assert abs(errors[0][0] - errors[1][0]) <= 0.1 / CALIBRATION.fovea_f_px


def _errors(seen: Gazes, truth: Gazes) -> NDArray[np.float64]:
    return np.array([seen.left - truth.left, seen.right - truth.right])


def test_suggestions_and_changes_of_the_wide_view_are_in_sensor_pixels() -> None:
    frame = plane().wide()
    shades, binned = to_uint8(frame), to_uint8(binned_frame(frame))
    colour, half = (cv2.cvtColor(image, cv2.COLOR_GRAY2RGB).astype(np.uint8) for image in (shades, binned))
    for one, other in zip(
        suggest_targets(colour, CALIBRATION), suggest_targets(half, CALIBRATION), strict=True
    ):
        assert math.hypot(one.x_px - other.x_px, one.y_px - other.y_px) <= 24.0
    context = WideContext(CALIBRATION.wide)
    context.fuse(wide_matches(looks(plane())[1], CALIBRATION), source=DepthSource.WIDE_MATCH, gray=shades)
    assert context.detect_changes(binned) == 0
    clouds = [context_cloud(context.snapshot(), picture, CALIBRATION.wide) for picture in (colour, half)]
    apart = clouds[0].colors.astype(float) - clouds[1].colors
    assert len(apart) > 100
    assert float(np.sqrt(np.mean(apart**2))) < 8.0  # another place would differ by 50
    assert np.isfinite(context.snapshot().inverse_z_per_m).any()  # nothing was withheld as changed
