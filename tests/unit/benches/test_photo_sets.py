"""Photographs of known cameras: their lenses are exact, and right and wrong sets are counted as such."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from foveacam_bench.accept.photo_judging import Fits, SetOutcome, field_fault
from foveacam_bench.accept.photo_pictures import KnownCamera, Series, _poses
from foveacam_bench.accept.photo_sets import (
    ACTION,
    CHECKERBOARD,
    FOLDING,
    NEAR,
    PHONE,
    SETS,
    WEBCAM,
    PhotoSet,
    _as_given,
    faults_of,
    photo_set_figures,
    run_sets,
)
from foveacam_server.resources.calibrating.sessions.wide_step import chosen_board

BY_NAME = {one.name: one for one in SETS}
PNG = replace(BY_NAME["png"], model="five", series=Series(count=8), expected=Fits(camera=WEBCAM, views=8))


def _with_focal_length(camera: KnownCamera, factor: float) -> KnownCamera:
    fx_px, fy_px = camera.focal_px
    return replace(camera, focal_px=(factor * fx_px, factor * fy_px))


@pytest.mark.parametrize("camera", [WEBCAM, PHONE, ACTION, FOLDING, FOLDING.halved()])
def test_the_lens_of_the_photographs_is_opencvs(camera: KnownCamera) -> None:
    x, y = np.meshgrid(np.linspace(0.0, camera.width, 33), np.linspace(0.0, camera.height, 25))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    tangents = camera.tangents(pixels)
    known = np.isfinite(tangents).all(axis=1)
    points = np.column_stack([tangents[known], np.ones(known.sum())])
    lens = _as_given(camera)
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), lens.matrix, np.array(lens.distortion))[0]
    # a table of steps of 1e-4 focal lengths, interpolated: a hundredth of a step where the lens turns back
    assert np.abs(seen[:, 0] - pixels[known]).max() < 1e-6 * camera.focal_px[0]
    assert np.abs(camera.pixels(tangents[known]) - seen[:, 0]).max() < 1e-9
    assert known.all() == (camera not in (FOLDING, FOLDING.halved()))


def test_the_strong_lens_bends_a_board_by_half_a_square() -> None:
    board = chosen_board(CHECKERBOARD, None)
    flat_m, bends = board.places_m() - board.places_m().mean(axis=0), []
    for pose in _poses(ACTION, board, NEAR, np.random.default_rng(NEAR.seed)):
        points_m = pose.points_m(flat_m)
        seen_px = ACTION.pixels(points_m[:, :2] / points_m[:, 2:])
        plane = np.asarray(cv2.findHomography(flat_m, seen_px)[0])
        off_px = np.linalg.norm(cv2.perspectiveTransform(flat_m[:, None], plane)[:, 0] - seen_px, axis=1)
        across, down = seen_px[1] - seen_px[0], seen_px[board.columns] - seen_px[0]
        bends.append(off_px.max() / np.sqrt(abs(across[0] * down[1] - across[1] * down[0])))
    assert max(bends) == pytest.approx(0.5, abs=0.1)


def test_right_sets_and_a_fit_beside_a_focal_length_two_percent_off_are_counted() -> None:
    wrong = replace(PNG, name="wrong", expected=Fits(camera=_with_focal_length(WEBCAM, 1.02), views=8))
    figures = photo_set_figures(lambda _: None, sets=(PNG, BY_NAME["empty_pattern"], wrong))
    assert figures["photo_sets"] == 4  # with the lens that folds back
    assert figures["photo_sets_right"] == 3
    assert figures["photo_sets_wrong"] == ["wrong"]
    assert "the focal length is off by 1.9" in str(figures["photo_set_faults"])
    assert figures["photo_focal_error_max"] == pytest.approx(0.0196, abs=0.002)
    assert isinstance(figures["inverse_max_px"], float)
    assert figures["inverse_max_px"] <= 0.02


def test_a_board_that_was_miscounted_is_refused_by_name() -> None:
    one = replace(BY_NAME["squares_counted"], series=Series(count=1))
    assert faults_of([one], run_sets([one], lambda _: None)) == {one.name: ""}


@pytest.mark.parametrize(
    ("name", "outcome", "fault"),
    [
        ("png", SetOutcome(refusal="they are too alike"), "refused: they are too alike"),
        ("png", SetOutcome(crash="error: (-215)"), "broke: error"),
        ("all_alike", SetOutcome(views=20), "should have been refused"),
        ("all_alike", SetOutcome(refusal="tilt it"), "for another reason: tilt it"),
        ("curled_paper", SetOutcome(refusal="corners scatter by 2.0 px: too alike"), "for another reason"),
    ],
)
def test_another_outcome_than_the_right_one_is_a_fault(name: str, outcome: SetOutcome, fault: str) -> None:
    one: PhotoSet = BY_NAME[name]
    assert fault in faults_of([one], {name: outcome})[name]


def test_directions_beyond_the_fold_are_a_fault() -> None:
    straight = replace(_as_given(FOLDING), distortion=(0.0,) * 5)
    assert "beyond it have one" in field_fault(straight, FOLDING, margin=0.01)
    assert field_fault(_as_given(FOLDING), FOLDING, margin=0.01) == ""
