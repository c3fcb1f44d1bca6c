import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.drift_scenes import LEFT, RIGHT, SIGMA, STILL, places, pointing_rms_px
from tests.support.scenes.plane_head import CALIBRATION, noise_texture

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.calibrate.drift.check import evaluate_drift
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.drift.patches import DistinctnessMap, patches_of_known_depth
from foveacam_pipeline.calibrate.drift.values import DriftSettings, EyeTurn
from foveacam_pipeline.models import load_calibration, save_calibration
from foveacam_pipeline.verge.aim import EYES

TRUE = {Role.LEFT: LEFT, Role.RIGHT: RIGHT}
LATER = "2026-02-01T00:00:00+00:00"


def found_turns(**options: object) -> dict[Role, EyeTurn]:
    check = evaluate_drift(places(**options), CALIBRATION)  # type: ignore[arg-type] # options of one function
    return {role: check.eye(role).turn for role in EYES}


def test_with_a_known_depth_both_eyes_are_found() -> None:
    assert pointing_rms_px(found_turns(known=2), TRUE) < 1.5


def test_the_stated_error_is_the_one_made() -> None:
    ratios = []
    for seed in range(20):
        check = evaluate_drift(places(known=2, seed=seed), CALIBRATION)
        turns = {role: check.eye(role).turn for role in EYES}
        ratios.append(pointing_rms_px(turns, TRUE) / max(check.eye(role).sigma_px for role in EYES))
    assert 0.1 < float(np.sqrt(np.mean(np.square(ratios)))) < 1.2


def test_places_that_are_something_else_do_not_matter() -> None:
    good = places(known=2)
    wrong = tuple(replace(place, left=(place.left[0] + 0.01, place.left[1] - 0.004)) for place in good[3:7])
    check = evaluate_drift((*good[:3], *wrong, *good[7:]), CALIBRATION)
    assert check.locked
    assert check.agreeing == len(good) - len(wrong)
    assert pointing_rms_px({role: check.eye(role).turn for role in EYES}, TRUE) < 2.0


@pytest.mark.parametrize(("sigmas", "agrees"), [(2.5, True), (6.0, False)])
def test_a_place_agrees_within_four_of_its_errors(sigmas: float, *, agrees: bool) -> None:
    mirrors = [CALIBRATION.eye(role).mirror for role in EYES]
    lack = math.hypot(*(max(0.15 / CALIBRATION.fovea_f_px, min(mirror.sigma_rad)) for mirror in mirrors))
    apart = sigmas * math.hypot(SIGMA[2], lack)
    good = places(STILL, STILL)
    odd = replace(
        good[5],
        left=(good[5].left[0], good[5].left[1] + apart / 2.0),
        right=(good[5].right[0], good[5].right[1] - apart / 2.0),
    )
    check = evaluate_drift((*good[:5], odd, *good[6:]), CALIBRATION)
    assert check.places[5].agrees == agrees
    assert check.agreeing == len(good) - (not agrees)


@pytest.mark.parametrize("distance_m", [2.0, 8.0])
def test_the_error_of_a_taped_distance_is_a_share_of_it(distance_m: float) -> None:
    settings = DriftSettings(distance_m=distance_m, distance_rel_sigma=0.002, layout=None)
    picture = noise_texture(3)[:1080, :1440].astype(np.uint8)
    field = DistinctnessMap.of((picture, picture), CALIBRATION, settings)
    patches = patches_of_known_depth(field, CALIBRATION, settings)
    assert patches
    for patch in patches:
        assert patch.known_inverse == pytest.approx(1.0 / distance_m, rel=0.01)
        assert patch.known_sigma == pytest.approx(0.002 / distance_m, rel=0.01)


def test_without_a_known_depth_the_angle_between_the_eyes_is_left_alone() -> None:
    check = evaluate_drift(places(), CALIBRATION)
    assert check.locked
    assert not check.vergence_known
    assert check.left.turn.turn_rad[1] == pytest.approx(check.right.turn.turn_rad[1], abs=1e-9)
    assert "was not corrected" in check.detail


def test_what_does_not_depend_on_depth_is_found_without_one() -> None:
    check = evaluate_drift(places(), CALIBRATION)
    tolerance_rad = 1.0 / CALIBRATION.fovea_f_px  # one fovea px
    for role, true in TRUE.items():
        assert check.eye(role).turn.turn_rad[0] == pytest.approx(true.turn_rad[0], abs=tolerance_rad)
        assert check.eye(role).turn.turn_rad[2] == pytest.approx(true.turn_rad[2], abs=math.radians(0.01))
    mean = (LEFT.turn_rad[1] + RIGHT.turn_rad[1]) / 2.0
    assert check.left.turn.turn_rad[1] == pytest.approx(mean, abs=tolerance_rad)


def test_an_unseen_angle_between_the_eyes_raises_what_distances_state() -> None:
    corrected = correct_calibration(CALIBRATION, evaluate_drift(places(), CALIBRATION), created_utc=LATER)
    unseen_px = CALIBRATION.fovea_f_px * abs(LEFT.turn_rad[1] - RIGHT.turn_rad[1])
    assert 0.2 * unseen_px < corrected.pose_sigma_px(10.0) < 2.0 * unseen_px
    assert corrected.epipolar_sigma_px(10.0) < 5.0


def test_a_known_angle_between_the_eyes_is_not_stated_as_unknown() -> None:
    corrected = correct_calibration(
        CALIBRATION, evaluate_drift(places(known=2), CALIBRATION), created_utc=LATER
    )
    assert corrected.pose_sigma_px(10.0) < 5.0


def test_applied_twice_is_as_once() -> None:
    check = evaluate_drift(places(known=2), CALIBRATION)
    once = correct_calibration(CALIBRATION, check, created_utc=LATER)
    twice = correct_calibration(once, check, created_utc="2026-02-02T00:00:00+00:00")
    assert once.id != CALIBRATION.id
    assert twice.id == once.id


def test_after_a_correction_the_next_shot_finds_nothing_to_correct() -> None:
    corrected = correct_calibration(
        CALIBRATION, evaluate_drift(places(known=2), CALIBRATION), created_utc=LATER
    )
    again = evaluate_drift(places(STILL, STILL, known=2, seed=5), corrected)
    assert again.locked
    assert not again.significant
    assert correct_calibration(corrected, again, created_utc=LATER).id == corrected.id


HALF_PX = 0.5 / CALIBRATION.fovea_f_px
RAISED, LOWERED = EyeTurn(turn_rad=(HALF_PX, 0.0, 0.0)), EyeTurn(turn_rad=(-HALF_PX, 0.0, 0.0))


def test_a_pixel_between_the_eyes_in_height_is_corrected_alone_and_only_once() -> None:
    check = evaluate_drift(places(RAISED, LOWERED), CALIBRATION)
    assert check.height_alone
    assert re.search(
        r"the right one [01]\.\d ± 0\.\d px lower than the left: that alone has drifted", check.detail
    )
    for role, sign in ((Role.LEFT, 1.0), (Role.RIGHT, -1.0)):
        assert check.eye(role).significant
        assert check.eye(role).turn.turn_rad == pytest.approx((sign * HALF_PX, 0.0, 0.0), abs=0.1 * HALF_PX)
    corrected = correct_calibration(CALIBRATION, check, created_utc=LATER)
    assert corrected.epipolar_sigma_px(10.0) < CALIBRATION.epipolar_sigma_px(10.0) + 0.2
    again = evaluate_drift(places(STILL, STILL, seed=5), corrected)
    assert again.locked
    assert not again.significant


def test_a_later_correction_that_does_not_know_the_angle_between_the_eyes_keeps_the_doubt() -> None:
    unseen = correct_calibration(CALIBRATION, evaluate_drift(places(), CALIBRATION), created_utc=LATER)
    up, down = (EyeTurn(turn_rad=(sign * 4.0 * HALF_PX, 0.0, 0.0)) for sign in (1.0, -1.0))
    check = evaluate_drift(places(up, down, seed=4), unseen)
    assert check.height_alone
    later = correct_calibration(unseen, check, created_utc=LATER)
    assert later.pose_sigma_px(10.0) >= unseen.pose_sigma_px(10.0)
    known = evaluate_drift(places(known=2, seed=4), unseen)
    assert correct_calibration(unseen, known, created_utc=LATER).pose_sigma_px(10.0) < 5.0


def test_eyes_that_both_look_a_little_off_within_their_error_are_left_alone() -> None:
    check = evaluate_drift(places(RAISED, RAISED), CALIBRATION)
    assert check.locked
    assert not check.significant
    assert not check.height_alone


def test_a_corrected_calibration_names_its_parent_and_is_kept_whole(tmp_path: Path) -> None:
    path = tmp_path / "corrected.json"
    corrected = correct_calibration(
        CALIBRATION, evaluate_drift(places(known=2), CALIBRATION), created_utc=LATER
    )
    save_calibration(corrected, path)
    assert load_calibration(path).id == corrected.id
    assert corrected.origin == "corrected"
    assert corrected.parent_id == CALIBRATION.id


def test_eyes_that_did_not_move_are_left_alone() -> None:
    check = evaluate_drift(places(STILL, STILL, known=2), CALIBRATION)
    assert check.locked
    assert not check.significant
    assert correct_calibration(CALIBRATION, check, created_utc=LATER).id == CALIBRATION.id


@pytest.mark.parametrize("options", [{"count": 5}, {"field_rad": 0.02}], ids=["few", "all in one corner"])
def test_without_lock_nothing_is_applied(options: dict[str, float]) -> None:
    check = evaluate_drift(places(**options), CALIBRATION)  # type: ignore[arg-type] # options of one function
    assert not check.locked
    with pytest.raises(NotCalibrated, match="no lock"):
        correct_calibration(CALIBRATION, check, created_utc=LATER)


def test_nothing_found_is_said_so() -> None:
    check = evaluate_drift((), CALIBRATION)
    assert not check.locked
    assert "texture" in check.detail


def test_a_check_of_another_calibration_is_refused() -> None:
    check = evaluate_drift(places(known=2), CALIBRATION)
    other = replace(CALIBRATION, label="another")
    with pytest.raises(NotCalibrated, match="cannot correct"):
        correct_calibration(other, check, created_utc=LATER)


def test_a_distance_that_cannot_be_is_refused() -> None:
    with pytest.raises(InvalidInput, match="distance"):
        DriftSettings(distance_m=0.1)
