"""Vergence on the simulated rig, judged by its truth."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.marker_room import make_grey

from foveacam_bench.verge.field_clicks import LOOKED_AT_PX, judge
from foveacam_hardware.contract import Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.surroundings.estimator import SurroundingsEstimator
from foveacam_pipeline.verge.surroundings.infer import InferredDepth
from foveacam_pipeline.verge.values import Basis, Fixation, FixationState, PixelTarget
from foveacam_pipeline.verge.verdict import CANNOT_TURN
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import (
    EYES,
    ClickKind,
    classify_click,
    truth_of,
    visible_from,
)
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

SURVEYED = Path(__file__).parents[2] / "data" / "rig120-calibration.json"
WHITEBOARD = ((660.0, 300.0), (640.0, 213.0))
"""Its frame's outer edge looks like the inner one: a fovea that sees it alone sees a nearer frame."""
BESIDE_A_FRAME = (710.4, 402.0)
"""On the whiteboard, so near to its frame that a binned patch shows just the frame's edge."""
HIDDEN_FROM_THE_LEFT = (602.0, 561.0)
"""On the notice, behind the marble figure for the left eye, which sees another letter in its place."""
BESIDE_A_BOOK = (820.8, 805.7)
"""On the plain card, where a book in front of it is nearer than its own edges."""
SEEN_BEHIND = ((565.8, 613.6), (1058.1, 770.2))
"""On the notice, which the left eye cannot see, and on an apple: both foveae match something else there."""
BEFORE_A_WALL = ((943.3, 604.8), (1053.9, 781.0))
"""On the obelisk and on an apple: at infinity both foveae show the wall behind, and agree on it."""
BESIDE_AN_EDGE = (600.0, 792.8)
"""On the back wall, beside the edge of something nearer, which hides it from one eye."""
ON_LEAVES = (998.5, 453.5)
"""Where the patch also fits a wide pixel and a half aside."""
OUT_OF_REACH_OF_THE_LEFT = (1082.0, 903.0)


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    warm_up()
    with open_simulated(scene="bench", inline=True) as opened:
        make_grey(opened)
        yield opened


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def look_at(rig: Rig, calibration: Calibration, x_px: float, y_px: float) -> Fixation:
    return fixate(rig.head, calibration, PixelTarget(x_px=x_px, y_px=y_px), clock=rig.clock)


def truth_m(rig: Rig, x_px: float, y_px: float) -> float:
    assert rig.truth is not None
    seen = rig.truth.depth_at(x_px, y_px, rig.clock.now_ns())
    assert seen is not None
    return seen.range_m


def holds(found: Fixation, true_m: float) -> bool:
    """Return whether an answer is so: a distance within three standard errors, or limits that hold."""
    if found.bound is not None:
        return found.bound.nearest_m <= true_m <= found.bound.farthest_m
    assert found.distance_m is not None and found.distance_sigma_m is not None, found.reason
    return abs(found.distance_m - true_m) <= 3.0 * found.distance_sigma_m


@pytest.mark.parametrize(("pixel", "seen_by"), [((1080.0, 160.0), Role.LEFT), ((1140.0, 420.0), Role.RIGHT)])
def test_a_click_on_what_one_eye_alone_sees_is_not_judged_as_textured(
    rig: Rig, calibration: Calibration, pixel: tuple[float, float], seen_by: Role
) -> None:
    truth = truth_of(rig)
    click = classify_click(truth, calibration, scene="bench", pixel=pixel, t_ns=rig.clock.now_ns())

    assert click is not None
    assert [role for role in EYES if visible_from(truth, role, click)] == [seen_by]
    assert click.kind is ClickKind.AWKWARD


@pytest.mark.parametrize(("x_px", "y_px"), [(1000.0, 780.0), (640.0, 550.0)])
def test_distance_is_true_within_three_sigma(
    rig: Rig, calibration: Calibration, x_px: float, y_px: float
) -> None:
    found = look_at(rig, calibration, x_px, y_px)
    assert found.state is FixationState.VERGED, found.reason
    assert found.basis is Basis.BOTH_FOVEAE
    assert holds(found, truth_m(rig, x_px, y_px))


@pytest.mark.parametrize(("x_px", "y_px"), WHITEBOARD)
def test_a_plain_board_is_as_far_as_its_frame_says(
    rig: Rig, calibration: Calibration, x_px: float, y_px: float
) -> None:
    found = look_at(rig, calibration, x_px, y_px)
    assert found.state is FixationState.NO_TEXTURE
    assert found.basis is Basis.SURROUNDINGS, found.reason
    assert found.distance_m is not None and found.distance_sigma_m is not None
    assert holds(found, truth_m(rig, x_px, y_px))
    assert found.distance_sigma_m <= 0.05 * found.distance_m


def test_the_eyes_look_at_a_plain_place_that_stands_still(rig: Rig, calibration: Calibration) -> None:
    bin_cameras(rig, 2)
    try:
        judged = judge(rig, calibration, "bench", np.array(BESIDE_A_FRAME))
    finally:
        bin_cameras(rig, 1)
    assert judged.off_centre_px <= LOOKED_AT_PX


def test_a_plain_card_is_as_deep_as_its_own_edges(calibration: Calibration) -> None:
    """Against the wide view alone its edges are 0.7 % off."""
    with open_simulated(scene="bench", inline=True) as fresh:
        bin_cameras(fresh, 2)
        judged = judge(fresh, calibration, "bench", np.array(BESIDE_A_BOOK))
    assert judged.fixation.basis is Basis.SURROUNDINGS
    assert abs(judged.error_m) <= 4e-3 * judged.range_m
    assert abs(judged.sigmas) <= 3.0


def test_a_match_that_the_wide_view_denies_is_not_of_the_target(calibration: Calibration) -> None:
    with open_simulated(scene="bench", inline=True) as fresh:
        bin_cameras(fresh, 2)
        found = [judge(fresh, calibration, "bench", np.array(at_px)) for at_px in SEEN_BEHIND]
    assert all(one.fixation.basis is not Basis.BOTH_FOVEAE for one in found)
    assert not any(one.wrong for one in found)


def test_a_match_far_from_where_the_target_must_be_is_not_of_it(calibration: Calibration) -> None:
    with open_simulated(scene="bench", inline=True) as fresh:
        bin_cameras(fresh, 2)
        found = [judge(fresh, calibration, "bench", np.array(at_px)) for at_px in BEFORE_A_WALL]
    assert {one.fixation.basis for one in found} == {Basis.BOTH_FOVEAE}
    assert all(abs(one.sigmas) <= 3.0 for one in found)


def test_what_one_eye_alone_shows_beside_an_edge_is_listed_with_what_else_it_may_be(
    calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    behind = InferredDepth(
        inverse_z_per_m=0.25, sigma_per_m=1e-3, probability=0.5, samples=3, owned=False, held=False
    )
    monkeypatch.setattr(SurroundingsEstimator, "peek", lambda *_given: (behind,))
    with open_simulated(scene="bench", inline=True) as fresh:
        bin_cameras(fresh, 2)
        found = judge(fresh, calibration, "bench", np.array(BESIDE_AN_EDGE)).fixation
    assert found.basis is Basis.FOVEA_AND_WIDE
    own, other = found.alternatives
    assert own.distance_m == pytest.approx(found.distance_m)
    assert other.distance_m == pytest.approx(4.1, abs=0.2)
    assert own.probability > other.probability


def test_the_eyes_look_along_the_ray_where_the_patch_slides(calibration: Calibration) -> None:
    with open_simulated(scene="bench", inline=True) as fresh:
        bin_cameras(fresh, 2)
        judged = judge(fresh, calibration, "bench", np.array(ON_LEAVES))
    assert judged.off_centre_px <= LOOKED_AT_PX


@pytest.mark.parametrize(("aside_px", "down_px", "surveyed"), [(0.0, 1.0, False), (-1.0, -1.0, True)])
def test_a_look_alike_beside_a_hidden_target_is_not_taken_for_it(
    rig: Rig, calibration: Calibration, aside_px: float, down_px: float, *, surveyed: bool
) -> None:
    x_px, y_px = HIDDEN_FROM_THE_LEFT
    used = load_calibration(SURVEYED) if surveyed else calibration
    found = look_at(rig, used, x_px + aside_px, y_px + down_px)
    assert found.state in {FixationState.LOST, FixationState.NO_TEXTURE}, found.reason
    assert found.basis is not Basis.BOTH_FOVEAE
    assert found.left_view is not None
    assert holds(found, truth_m(rig, x_px + aside_px, y_px + down_px))


def test_where_one_eye_cannot_turn_the_other_answers_against_the_wide_camera(
    rig: Rig, calibration: Calibration
) -> None:
    x_px, y_px = OUT_OF_REACH_OF_THE_LEFT
    found = look_at(rig, calibration, x_px, y_px)
    assert found.basis is Basis.FOVEA_AND_WIDE, found.reason
    assert found.left_view is not None and not found.left_view.sees_target
    assert found.left_view.reason == CANNOT_TURN
    assert found.right_view is not None and found.right_view.sees_target
    assert holds(found, truth_m(rig, x_px, y_px))
