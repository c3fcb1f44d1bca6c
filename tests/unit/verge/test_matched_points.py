"""Matches of a point: their stated error, and what is known of a point's row beforehand."""

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.localisation_scenes import CONTRAST, texture

from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.point import PositionPrior, match_point
from foveacam_pipeline.matching.search import SearchReach, find_point
from foveacam_pipeline.matching.windows import MatchWindow

WINDOW = MatchWindow(half_px=20, weight_sigma_px=9.0)
SIDE_PX = 81


def textured(shift_px: NDArray[np.float64], noise: NDArray[np.float64]) -> InterpolatedPicture:
    """Return a picture of the texture, moved to the right and down, with noise."""
    y_px, x_px = np.mgrid[:SIDE_PX, :SIDE_PX].astype(np.float64)
    image = texture(x_px - shift_px[0], y_px - shift_px[1]) + noise
    return InterpolatedPicture.of(image.astype(np.float32))


def stripes(shift_px: float) -> NDArray[np.float32]:
    """Return upright stripes, which tell nothing of a row."""
    x_px = np.arange(SIDE_PX) - shift_px
    line = 120.0 + CONTRAST * (np.sin(0.4 * x_px) + np.sin(0.23 * x_px))
    return np.tile(line.astype(np.float32), (SIDE_PX, 1))


@pytest.mark.parametrize("slopes", [0, 2])
def test_matched_points_scatter_as_far_as_they_say(slopes: int) -> None:
    rng, ratios = np.random.default_rng(1), []
    for _ in range(60):
        shift_px = rng.uniform(-0.8, 0.8, 2)
        first, second = (
            textured(at_px, 3.0 * rng.standard_normal((SIDE_PX, SIDE_PX)))
            for at_px in (np.zeros(2), shift_px)
        )
        found = match_point(
            first, second, WindowPlacement(), window=WINDOW, prior=PositionPrior(slopes=slopes)
        )
        assert found is not None
        ratios.append((found.position_px - shift_px) / found.sigma_px)
    # 120 draws know a standard deviation to 6 %
    assert 0.8 <= float(np.sqrt(np.mean(np.square(ratios)))) <= 1.2


def test_where_the_picture_tells_no_row_the_known_one_is_taken() -> None:
    pictures = InterpolatedPicture.of(stripes(0.0)), InterpolatedPicture.of(stripes(0.4))
    prior = PositionPrior(y_px=0.8, y_sigma_px=0.1)
    found = match_point(*pictures, WindowPlacement(), window=WINDOW, prior=prior)
    assert found is not None
    assert found.position_px == pytest.approx([0.4, 0.8], abs=0.02)
    assert found.sigma_px[1] == pytest.approx(0.1, rel=0.1)


def test_the_known_row_is_the_pictures_whichever_row_is_searched() -> None:
    prior = PositionPrior(y_px=0.5, y_sigma_px=0.1)
    found = find_point(
        stripes(0.0),
        stripes(3.4),
        (40, 40),
        reach=SearchReach(low_px=-6, high_px=6, rows_px=1),
        window=WINDOW,
        prior=prior,
    )
    assert found is not None
    assert (found.x_px, found.y_px) == pytest.approx((3.4, 0.5), abs=0.02)


def test_a_window_shows_the_same_part_of_a_binned_picture() -> None:
    assert WINDOW.binned(2) == MatchWindow(half_px=10, weight_sigma_px=4.5)
