"""Signed disparity of pairs made to order: value, stated error, search window; silence where nothing is."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.plane_head import noise_texture
from tests.support.scenes.stereo_pairs import BASELINE_M, F_PX, HEIGHT, WIDTH, flat, pair_of

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.estimator import BACKENDS, DepthBackend
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.search import MatchSettings, search_window

INNER = (slice(12, -12), slice(56, -56))


@pytest.mark.parametrize("disparity_px", [-37.3, -8.0, 0.0, 5.5, 21.25, 44.0])
def test_a_flat_surface_is_measured_with_its_sign(disparity_px: float) -> None:
    found = match(pair_of(flat(disparity_px))).residual_px[INNER]
    assert np.isfinite(found).mean() > 0.98
    assert np.nanmedian(found) == pytest.approx(disparity_px, abs=0.05)


def test_a_sloping_surface_is_measured_within_its_stated_error() -> None:
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    truth = 0.06 * (columns - WIDTH / 2) + 2.0 * np.sin(rows / 40.0)
    found = match(pair_of(truth))
    error = np.abs(found.residual_px - truth)[INNER]
    within = error <= 3.0 * found.sigma_px[INNER]
    known = np.isfinite(error)
    assert known.mean() > 0.95
    assert within[known].mean() >= 0.95
    assert np.median(error[known]) < 0.1


def test_eyes_of_different_gain_agree_all_the_same() -> None:
    found = match(pair_of(flat(6.4), gain=1.06)).residual_px[INNER]
    assert np.nanmedian(found) == pytest.approx(6.4, abs=0.1)


def test_more_noise_gives_a_larger_stated_error() -> None:
    quiet, noisy = (match(pair_of(flat(3.0), noise=noise)).sigma_px for noise in (0.5, 4.0))
    assert np.nanmedian(noisy) > 1.5 * np.nanmedian(quiet)


def test_bare_noise_has_no_disparity() -> None:
    rng = np.random.default_rng(2)
    left, right = (rng.normal(128.0, 2.0, (HEIGHT, WIDTH)).astype(np.uint8) for _ in range(2))
    found = match(replace(pair_of(flat(0.0)), left=left, right=right))
    assert np.isfinite(found.residual_px).mean() < 0.02
    np.testing.assert_array_equal(np.isfinite(found.residual_px), np.isfinite(found.sigma_px))


def test_pixels_that_an_eye_does_not_see_stay_unknown() -> None:
    pair = pair_of(flat(10.0))
    pair.valid_left[:, :120] = False
    pair.valid_right[:, 300:] = False
    found = match(pair).residual_px
    assert not np.isfinite(found[:, :120]).any()
    assert not np.isfinite(found[:, 312:]).any()  # 300 in the right window is 310 in the left one
    assert np.isfinite(found[20:-20, 140:290]).mean() > 0.98


@pytest.mark.parametrize("backend", ["sgbm", "live"])
def test_pixels_whose_match_the_right_eye_does_not_see_stay_unknown(backend: DepthBackend) -> None:
    pair = pair_of(flat(30.0))
    pair.valid_right[:, :150] = False
    pair.valid_right[:, 400:] = False
    found = BACKENDS[backend].estimate(pair).residual_px[20:-20]
    assert not np.isfinite(found[:, :178]).any()  # 150 in the right window is 180 in the left one
    assert not np.isfinite(found[:, 432:]).any()
    assert np.isfinite(found[:, 184:426]).mean() > 0.98


def test_a_spot_smaller_than_a_speckle_has_no_depth_of_its_own() -> None:
    pair = pair_of(flat(6.0))
    spot = noise_texture(22)[:12, :12]
    pair.left[120:132, 200:212] = spot
    pair.right[120:132, 190:202] = spot
    removed, kept = (
        match(pair, MatchSettings(speckle_px=speckle_px)).residual_px[120:132, 200:212]
        for speckle_px in (150, 10)
    )
    assert not (np.abs(removed - 10.0) < 2.0).any()
    assert (np.abs(kept - 10.0) < 1.0).mean() > 0.5


def test_what_only_one_eye_shows_gets_hardly_any_depth() -> None:
    pair, foreign = pair_of(flat(6.0)), (slice(60, 200), slice(150, 330))
    pair.right[foreign] = pair_of(flat(0.0)).left[::-1, ::-1][foreign]
    error = np.abs(match(pair).residual_px - 6.0)
    assert (
        error > 2.0
    ).sum() < 0.016 * 140 * 180  # three times as many where left is not compared with right
    assert np.isfinite(error[20:-20, 350:450]).mean() > 0.98


def test_a_surface_a_few_pixels_nearer_hides_what_lies_beside_it() -> None:
    disparity = flat(10.0).astype(np.float32)
    disparity[:, 200:300] = 14.0
    hidden = occluded_pixels(disparity)
    assert hidden[4:-4, 197:199].all()  # the right eye sees the card from column 186 on, the wall until there
    assert not hidden[:, :194].any()
    assert not hidden[:, 202:].any()


def test_pixels_near_the_border_are_searched_too() -> None:
    found = match(pair_of(flat(4.0))).residual_px
    assert np.isfinite(found[20:-20, 10:60]).mean() > 0.9
    assert np.isfinite(found[20:-20, -60:-10]).mean() > 0.9


def test_colour_pairs_match_like_grey_ones() -> None:
    pair = pair_of(flat(9.0))
    colour = replace(pair, left=np.stack([pair.left] * 3, axis=2), right=np.stack([pair.right] * 3, axis=2))
    assert np.nanmedian(match(colour).residual_px) == pytest.approx(9.0, abs=0.05)


def test_a_window_with_odd_sides_is_answered_to_its_last_pixel() -> None:
    pair, odd = pair_of(flat(7.25)), (slice(HEIGHT - 1), slice(WIDTH - 1))
    found = match(
        replace(
            pair,
            left=pair.left[odd],
            right=pair.right[odd],
            valid_left=pair.valid_left[odd],
            valid_right=pair.valid_right[odd],
        )
    )
    assert found.residual_px.shape == found.sigma_px.shape == (HEIGHT - 1, WIDTH - 1)
    assert np.isfinite(found.residual_px[-20:, 60:]).mean() > 0.9
    assert np.nanmedian(np.abs(found.residual_px - 7.25)) < 0.1


def test_the_search_is_centred_on_the_verged_depth() -> None:
    assert search_window(pair_of(flat(0.0), offset_px=280.0)) == (-64, 128)
    assert search_window(pair_of(flat(0.0)), MatchSettings(disparities=64)) == (-32, 64)


def test_the_search_never_goes_beyond_infinity() -> None:
    first, count = search_window(pair_of(flat(0.0), offset_px=20.0))
    assert first == -20
    assert count % 16 == 0 and first + count >= 64


def test_the_search_covers_the_depths_asked_for_and_no_more_than_256() -> None:
    pair = pair_of(flat(0.0))  # verged at 14380 * 0.2 / 280 = 10.27 m
    first, count = search_window(pair, MatchSettings(near_m=9.0, far_m=12.0))
    assert first == int(np.floor(F_PX * BASELINE_M / 12.0 - 280.0))
    assert first + count >= F_PX * BASELINE_M / 9.0 - 280.0
    assert search_window(pair, MatchSettings(near_m=1.0, far_m=12.0))[1] == 256


@pytest.mark.parametrize(("near_m", "far_m"), [(12.0, 9.0), (0.0, 9.0), (8.0, -1.0)])
def test_a_range_that_holds_nothing_is_refused(near_m: float, far_m: float) -> None:
    with pytest.raises(InvalidInput, match="stereo search"):
        match(pair_of(flat(0.0)), MatchSettings(near_m=near_m, far_m=far_m))
