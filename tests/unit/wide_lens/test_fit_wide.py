"""The fit of the wide lens against the lens that made the views."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.board_scenes import WEBCAM, DivisionLens, Pose, board_samples, many_poses

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.boards import Charuco, Checkerboard
from foveacam_pipeline.calibrate.wide.fit_wide import (
    WideFit,
    choose_model,
    fit_wide,
    left_out_px,
    observations_of,
)
from foveacam_pipeline.calibrate.wide.lens_accuracy import USEFUL_PX, grid_px
from foveacam_pipeline.calibrate.wide.wide_bundle import first_lens, fit_bundle, prior_about
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples

pytestmark = pytest.mark.slow

BOARD = Charuco()
LENS = DivisionLens()


def _error_px(fit: WideFit, lens: DivisionLens = LENS) -> float:
    pixels = grid_px(lens.width, lens.height)
    angles = np.arctan(lens.straight(pixels))
    misses = fit.intrinsics.pixels(angles) - pixels
    return float(np.sqrt(np.mean(np.sum(misses**2, axis=1))))


@pytest.mark.parametrize("model", ["five", "rational"])
def test_a_lens_is_found_again_from_views_without_noise(model: str) -> None:
    samples = board_samples(BOARD, many_poses(20, np.random.default_rng(1)), noise_px=0.0)
    fit = fit_wide(samples, "five" if model == "five" else "rational")
    # the series of 1 / (1 + bend r2) is cut off after r to the 6th: 0.06^4 0.285^9 3155 px = 1e-6 px
    assert _error_px(fit) < 1e-3


def test_the_true_error_is_within_the_stated_one_19_times_of_20() -> None:
    ratios = []
    for seed in range(20):
        poses = many_poses(20, np.random.default_rng(100 + seed))
        fit = fit_wide(board_samples(BOARD, poses, noise_px=0.02, seed=seed))
        ratios.append(_error_px(fit) / (2.0 * fit.accuracy.sigma_px))
    assert sum(ratio <= 1.0 for ratio in ratios) >= 19
    assert np.median(ratios) > 0.15, "and it is not stated far larger than it is"


def test_errors_that_a_view_shares_are_counted_by_view() -> None:
    """A bent board: corners of one view err together, so the noise alone would promise too much."""
    poses = many_poses(24, np.random.default_rng(8))
    rng = np.random.default_rng(9)
    samples = WideSamples(BOARD)
    for sample in board_samples(BOARD, poses, noise_px=0.005):
        places = sample.view.places_m / 0.1
        bow = np.column_stack([places[:, 0] * places[:, 1], places[:, 0] ** 2]) @ rng.normal(0, 0.03, (2, 2))
        samples.add(_moved(sample, sample.view.corners_px + bow))
    fit = fit_wide(samples)
    assert _error_px(fit) <= (2.0 * fit.accuracy.sigma_px)


def test_five_coefficients_are_recommended_where_the_rational_model_predicts_no_better() -> None:
    choice = choose_model(board_samples(BOARD, many_poses(15, np.random.default_rng(2))))
    assert choice.recommended.model == "five"
    assert "does not predict better" in choice.reason


@dataclass(frozen=True, kw_only=True)
class FishEye(DivisionLens):
    """Angles, not tangents, are proportional to the radius; and the field is wide."""

    def pixels(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        tangents = points_m[..., :2] / points_m[..., 2:]
        radius = np.linalg.norm(tangents, axis=-1, keepdims=True)
        return np.asarray(tangents * np.arctan(radius) / radius * self.focal_px + np.array(self.centre_px))


def test_the_rational_model_is_recommended_for_a_lens_that_needs_it() -> None:
    lens, rng = FishEye(focal_px=620.0), np.random.default_rng(4)
    poses = []
    for _ in range(24):
        depth_m = float(rng.uniform(0.18, 0.35))
        x, y = (rng.uniform(-1.0, 1.0, 2) * np.array([1.1, 0.8]) * depth_m).tolist()
        turn = rng.uniform(-0.5, 0.5, 3)
        poses.append(Pose(place_m=(x, y, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    choice = choose_model(board_samples(BOARD, poses, lens=lens, noise_px=0.02))
    assert choice.recommended.model == "rational"
    assert choice.left_out_px["rational"] < 0.9 * choice.left_out_px["five"]


def test_a_lens_that_five_coefficients_do_not_fit_is_calibrated_by_the_rational_model() -> None:
    lens, rng = FishEye(focal_px=620.0), np.random.default_rng(4)
    poses = []
    for _ in range(8):
        depth_m = float(rng.uniform(0.12, 0.3))
        x, y = (rng.uniform(-1.0, 1.0, 2) * np.array([1.1, 0.8]) * depth_m).tolist()
        turn = rng.uniform(-0.5, 0.5, 3)
        poses.append(Pose(place_m=(x, y, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    samples = board_samples(BOARD, poses, lens=lens, noise_px=0.02)
    with pytest.raises(InvalidInput, match="leave the focal length unsure"):
        fit_wide(samples, "five")
    choice = choose_model(samples)
    assert choice.recommended.model == "rational"
    assert choice.other is None
    assert choice.recommended.intrinsics.fx_px == pytest.approx(620.0, rel=0.002)
    assert choice.reason.startswith("rational: the model five does not fit, wide calibration: ")


def _central_views(*, count: int, reach: float, seed: int) -> WideSamples:
    """Return views by a very wide lens of a board that stays near the centre."""
    lens, rng = FishEye(focal_px=560.0), np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        depth_m = float(rng.uniform(0.3, 0.6))
        x, y = (rng.uniform(-reach, reach, 2) * depth_m).tolist()
        turn = rng.uniform(-0.5, 0.5, 3)
        poses.append(Pose(place_m=(x, y, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    return board_samples(BOARD, poses, lens=lens, noise_px=0.05)


def test_the_rational_model_is_not_recommended_where_the_views_do_not_determine_it() -> None:
    choice = choose_model(_central_views(count=10, reach=0.5, seed=2))
    assert choice.left_out_px["rational"] < 0.98 * choice.left_out_px["five"]
    assert choice.recommended.model == "five"
    assert "the views do not determine the rational model" in choice.reason


def test_where_a_fitted_lens_folds_back_no_accuracy_is_stated_and_directions_are_missing() -> None:
    fit = fit_wide(_central_views(count=10, reach=0.5, seed=2))
    pixels = grid_px(LENS.width, LENS.height)
    angles = fit.intrinsics.angles_rad(pixels)
    known = np.isfinite(angles).all(axis=1)
    assert 0.2 < fit.accuracy.known_fraction == known.mean() < 0.95
    assert not np.isfinite(fit.accuracy.map_px).all()
    assert fit.accuracy.map_px.ravel()[known].max() <= USEFUL_PX
    assert math.isfinite(fit.accuracy.sigma_px)
    assert np.abs(fit.intrinsics.pixels(angles[known]) - pixels[known]).max() <= 0.02


def test_a_few_wrong_corners_do_not_move_the_lens() -> None:
    clean = board_samples(BOARD, many_poses(20, np.random.default_rng(3)), noise_px=0.02)
    rng, spoilt = np.random.default_rng(7), WideSamples(BOARD)
    for sample in clean:
        corners = sample.view.corners_px.copy()
        corners[rng.integers(len(corners))] += rng.uniform(-5.0, 5.0, 2)
        spoilt.add(_moved(sample, corners))
    fit = fit_wide(spoilt)
    assert _error_px(fit) < (2.0 * fit.accuracy.sigma_px)
    assert fit.accuracy.sigma_px < 2.0 * fit_wide(clean).accuracy.sigma_px


def test_one_wrong_corner_does_not_decide_between_two_lenses() -> None:
    clean, spoilt = (board_samples(BOARD, many_poses(8, np.random.default_rng(3))) for _ in range(2))
    first = next(iter(spoilt))
    corners = first.view.corners_px.copy()
    corners[10] += [30.0, -20.0]
    spoilt.remove(first.id)
    spoilt.add(_moved(first, corners))
    assert left_out_px(spoilt, "five") < 1.3 * left_out_px(clean, "five")


def test_the_noise_of_corners_is_found_from_boards_with_few_of_them() -> None:
    board, noise_px, found = Checkerboard(columns=4, rows=3, square_m=0.06), 0.05, []
    for seed in range(12):
        samples = board_samples(
            board, many_poses(6, np.random.default_rng(seed)), noise_px=noise_px, seed=seed
        )
        views = observations_of(list(samples))
        lens = first_lens(views, width=LENS.width, height=LENS.height, coefficients=5)
        found.append(fit_bundle(views, lens, prior=prior_about(lens, width=LENS.width)).sigma_px)
    # 144 coordinates less 36 of poses and 9 of the lens, 12 times: known to 2 %
    assert float(np.sqrt(np.mean(np.square(found)))) == pytest.approx(noise_px, rel=0.1)


def test_the_field_of_view_is_that_of_the_lens() -> None:
    fit = fit_wide(board_samples(BOARD, many_poses(20, np.random.default_rng(5))))
    edge = np.arctan(
        LENS.straight(np.array([[-0.5, 537.4], [1439.5, 537.4], [722.9, -0.5], [722.9, 1079.5]]))
    )
    expected = np.degrees([edge[1, 0] - edge[0, 0], edge[3, 1] - edge[2, 1]])
    np.testing.assert_allclose(np.degrees(fit.field_rad), expected, atol=0.005)


FLAT = [Pose(place_m=(x, y, z)) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (1.3, 1.7)]
FAR = [Pose(place_m=(0.0, 0.0, 3.5), turn_rad=(0.4 * math.sin(k), 0.4 * math.cos(k), 0.1)) for k in range(8)]
ALIKE = [Pose(place_m=(x, y, 1.5), turn_rad=(0.4, 0.3, 0.0)) for x in (-0.1, 0.1) for y in (-0.1, 0.0, 0.1)]


@pytest.mark.parametrize(
    ("poses", "remedy"),
    [
        (many_poses(4, np.random.default_rng(1)), "4 views of the board, at least 5"),
        (FLAT, "tilt it by 20 to 40°"),
        (FAR, "show the board in every corner"),
        (ALIKE, "they are too alike"),
    ],
    ids=["few", "frontal", "one place", "one tilt"],
)
def test_views_that_cannot_tell_the_lens_are_refused_with_the_remedy(poses: list[Pose], remedy: str) -> None:
    with pytest.raises(InvalidInput, match=remedy):
        fit_wide(board_samples(BOARD, poses))


def test_good_views_with_noisy_corners_are_not_called_alike() -> None:
    with pytest.raises(InvalidInput, match=r"their corners scatter by \d\.\d\d px: take sharper"):
        fit_wide(board_samples(BOARD, many_poses(16, np.random.default_rng(1)), noise_px=5.0))


def test_good_views_of_curled_paper_are_not_called_alike() -> None:
    """Errors that a view's corners share: the focal length is far more unsure than by their noise."""
    rng, samples = np.random.default_rng(9), WideSamples(BOARD)
    for sample in board_samples(BOARD, many_poses(16, np.random.default_rng(1)), noise_px=0.05):
        places = sample.view.places_m / 0.1
        bow = np.column_stack([places[:, 0] * places[:, 1], places[:, 0] ** 2]) @ rng.normal(0, 3.0, (2, 2))
        samples.add(_moved(sample, sample.view.corners_px + bow))
    with pytest.raises(InvalidInput, match=r"their corners scatter by \d\.\d\d px: .* of a flat board"):
        fit_wide(samples)


def test_twenty_pictures_of_one_pose_are_too_alike_however_well_they_fit() -> None:
    near = Pose(place_m=(0.01, 0.0, 0.3), turn_rad=(0.3, 0.35, 0.1))
    samples = board_samples(BOARD, [near] * 20, lens=WEBCAM, noise_px=0.02)
    with pytest.raises(
        InvalidInput, match="20 views show the board in no more than 1 ways; they are too alike"
    ):
        fit_wide(samples)


def test_views_of_something_that_is_no_flat_board_are_refused() -> None:
    rng, samples = np.random.default_rng(2), WideSamples(BOARD)
    for sample in board_samples(BOARD, many_poses(10, rng)):
        samples.add(_moved(sample, rng.uniform(0.0, 1000.0, sample.view.corners_px.shape)))
    with pytest.raises(InvalidInput, match="no lens explains the views"):
        fit_wide(samples)


def test_a_board_that_is_not_as_wide_as_said_changes_nothing_but_the_scale() -> None:
    poses = many_poses(12, np.random.default_rng(6))
    small, large = (
        fit_wide(board_samples(Checkerboard(square_m=0.036), poses, noise_px=0.0)),
        fit_wide(_as_if(board_samples(Checkerboard(square_m=0.036), poses, noise_px=0.0), square_m=0.05)),
    )
    assert small.intrinsics.fx_px == pytest.approx(large.intrinsics.fx_px, rel=1e-6)


def test_an_unknown_model_is_refused() -> None:
    samples = board_samples(BOARD, many_poses(6, np.random.default_rng(1)))
    with pytest.raises(InvalidInput, match="five, rational"):
        fit_wide(samples, "seven")  # type: ignore[arg-type]  # what a caller might pass


def _moved(sample: WideSample, corners_px: NDArray[np.float64]) -> WideSample:
    view = sample.view
    moved = BoardView(
        board=view.board, corners_px=corners_px, ids=view.ids, width=view.width, height=view.height
    )
    return WideSample(view=moved, thumbnail_jpeg=b"")


def _as_if(samples: WideSamples, *, square_m: float) -> WideSamples:
    board = Checkerboard(square_m=square_m)
    views = [
        BoardView(
            board=board,
            corners_px=sample.view.corners_px,
            ids=sample.view.ids,
            width=sample.view.width,
            height=sample.view.height,
        )
        for sample in samples
    ]
    return WideSamples(board, [WideSample(view=view, thumbnail_jpeg=b"") for view in views])
