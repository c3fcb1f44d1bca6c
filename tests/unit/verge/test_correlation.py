"""Correlation maps, their peaks and how clear these are."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import (
    UNSEEN,
    best_outside,
    correlation,
    largest,
    peak,
    score_map,
    vertex,
)

HALF_PX = 10
BELL = np.outer(*2 * (np.exp(-(np.linspace(-1.0, 1.0, 2 * HALF_PX + 1) ** 2)),)).astype(np.float32)
ROUNDING = 1e-3
"""Least score that is more than the rounding of float32 spectra; what was seen of it stays below 4e-5."""


def texture(seed: int, shape: tuple[int, int] = (60, 80)) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).normal(0.0, 30.0, shape).astype(np.float32)
    return np.asarray(128.0 + 4.0 * cv2.GaussianBlur(noise, (0, 0), 2.5), dtype=np.float32)


def cut(picture: NDArray[np.float32], x: int, y: int, *, half_px: int = HALF_PX) -> NDArray[np.float32]:
    return picture[y - half_px : y + half_px + 1, x - half_px : x + half_px + 1]


def test_map_has_the_correlation_of_every_place() -> None:
    picture, patch = texture(1), cut(texture(2), 30, 30)
    scores = score_map(picture, patch)

    assert scores.shape == (40, 60)
    assert scores.dtype == np.float32
    for x, y in ((0, 0), (59, 39), (17, 23)):
        seen = picture[y : y + 21, x : x + 21]
        expected = np.corrcoef(seen.ravel().astype(np.float64), patch.ravel().astype(np.float64))[0, 1]
        assert scores[y, x] == pytest.approx(expected, abs=1e-4)  # float32
        assert correlation(np.ascontiguousarray(seen), patch) == pytest.approx(expected, abs=1e-4)  # float32


def test_brightness_and_contrast_do_not_count() -> None:
    picture = texture(3)
    darker = 0.5 * cut(picture, 42, 25) + 40.0
    grey = score_map(picture.astype(np.uint8), darker.astype(np.uint8))
    for scores in (score_map(picture, darker), grey):
        assert largest(scores) == (42 - HALF_PX, 25 - HALF_PX)
        assert scores.max() == pytest.approx(1.0, abs=2e-3)  # rounding to grey levels


@pytest.mark.parametrize("shift_px", [(0.0, 0.0), (0.25, -0.4), (-0.45, 0.1)])
def test_peak_tells_fractions_of_a_pixel(shift_px: tuple[float, float]) -> None:
    picture = texture(4, (120, 140))
    matrix = np.array([[1.0, 0.0, shift_px[0]], [0.0, 1.0, shift_px[1]]])
    moved = cv2.warpAffine(picture, matrix, (140, 120), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    patch = cut(picture, 70, 60, half_px=30)
    x_px, y_px, score = peak(score_map(np.asarray(moved, dtype=np.float32), patch))

    # of 60 random shifts of such textures a parabola misplaces by 0.034 px rms; this is three times as much
    assert (x_px, y_px) == pytest.approx((40.0 + shift_px[0], 30.0 + shift_px[1]), abs=0.1)
    assert score > 0.98


def test_peak_at_a_border_is_a_whole_pixel_there() -> None:
    rising = np.linspace(-0.5, 0.9, 15, dtype=np.float32).reshape(3, 5)
    assert peak(rising[::-1, ::-1]) == pytest.approx((0.0, 0.0, 0.9))
    assert peak(rising) == pytest.approx((4.0, 2.0, 0.9))
    assert peak(np.array([[0.1, 0.8, 0.6]], dtype=np.float32)) == pytest.approx((1.0 + 5.0 / 18.0, 0.0, 0.8))


def test_vertex_of_a_parabola_and_of_none() -> None:
    assert vertex(*(2.0 - (step - 0.3) ** 2 for step in (-1.0, 0.0, 1.0))) == pytest.approx(0.3)
    assert vertex(1.0, 1.0, 1.0) == vertex(2.0, 0.0, 1.0) == 0.0


@pytest.mark.parametrize("weights", [None, BELL], ids=["plain", "weighted"])
def test_flat_patch_fits_nowhere(weights: NDArray[np.float32] | None) -> None:
    flat = np.full((21, 21), 90.0, dtype=np.float32)
    for picture in (texture(5), np.full((60, 80), 90.0, dtype=np.float32)):
        np.testing.assert_allclose(score_map(picture, flat, weights=weights), 0.0, atol=ROUNDING)


@pytest.mark.parametrize("level", [0.0, 7.3, 93.7, 100.0, 200.3])
def test_nothing_fits_a_flat_part_of_a_picture(level: float) -> None:
    picture, patch = texture(6), cut(texture(7), 60, 30)
    picture[:, :40] = level
    np.testing.assert_allclose(score_map(picture, patch)[:, :20], 0.0, atol=ROUNDING)
    weighted = score_map(picture, patch, weights=BELL)
    assert np.abs(weighted).max() < 10.0  # OpenCV's division by 0 gives infinities


@pytest.mark.parametrize("shape", [(61, 20), (20, 81), (61, 81)])
def test_patch_larger_than_the_picture_is_refused(shape: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="does not fit"):
        score_map(texture(8), texture(9, shape))


def test_weights_let_the_middle_decide() -> None:
    picture, other = texture(10), texture(11)
    patch = cut(other, 30, 30).copy()
    patch[5:-5, 5:-5] = cut(picture, 40, 30)[5:-5, 5:-5]  # a rim that shows something else
    weights = np.zeros_like(BELL)
    weights[5:-5, 5:-5] = 1.0
    assert score_map(picture, patch)[20, 30] < 0.9
    assert score_map(picture, patch, weights=weights)[20, 30] == pytest.approx(1.0, abs=1e-4)


def test_a_second_place_that_looks_alike_leaves_no_lead() -> None:
    picture = texture(12, (60, 120))
    alone = score_map(picture, cut(picture, 30, 30))
    picture[20:41, 80:101] = cut(picture, 30, 30)
    twice = score_map(picture, cut(picture, 30, 30))

    guard_px = (6, 6)
    assert best_outside(alone, (20, 20), guard_px=guard_px) < 0.8
    assert best_outside(twice, (20, 20), guard_px=guard_px) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("guard_px", [(0, 0), (1, 2), (2, 0), (1, 4), (5, 4)])
def test_guarded_places_do_not_count(guard_px: tuple[int, int]) -> None:
    scores = np.random.default_rng(13).uniform(-1.0, 1.0, (4, 5)).astype(np.float32)
    for y, x in np.ndindex(scores.shape):
        rows, columns = np.abs(np.arange(4) - y) > guard_px[1], np.abs(np.arange(5) - x) > guard_px[0]
        expected = scores[rows[:, None] | columns].max(initial=UNSEEN)
        assert best_outside(scores, (x, y), guard_px=guard_px) == expected
