"""Cues of the error model: what surrounds each cell of 2 x 2 px, at borders and odd sides too."""

import numpy as np
import pytest

from foveacam_pipeline.stereo.errors import LEAST_SPREAD_PX, match_cues
from foveacam_pipeline.stereo.refine import FloatImage, Refinement

SPREAD_CUE, WIDE_SPREAD_CUE, HOLES_CUE = 3, 4, 5


@pytest.mark.parametrize("size", [(24, 30), (25, 31)])
def test_the_spread_is_that_of_all_known_pixels_of_the_cells_around(size: tuple[int, int]) -> None:
    disparity = holed_map(size)
    cues = match_cues(disparity, refinement_of(size))

    for cue, reach in ((SPREAD_CUE, 1), (WIDE_SPREAD_CUE, 3)):
        expected = np.empty_like(cues[cue])
        for row, column in np.ndindex(expected.shape):
            known = around(disparity, row, column, reach)
            known = known[np.isfinite(known)]
            expected[row, column] = np.ptp(known) if len(known) else 0.0
        np.testing.assert_allclose(np.exp(cues[cue]) - LEAST_SPREAD_PX, expected, atol=2e-4)


def test_the_share_of_holes_is_that_of_the_pixels_of_the_cells_around() -> None:
    disparity = holed_map((24, 30))
    holes = match_cues(disparity, refinement_of((24, 30)))[HOLES_CUE]

    for row, column in ((2, 2), (5, 7), (9, 12)):
        assert holes[row, column] == pytest.approx(
            np.isnan(around(disparity, row, column, 2)).mean(), abs=1e-5
        )


def around(disparity: FloatImage, row: int, column: int, reach: int) -> FloatImage:
    """Return the pixels of the cells within `reach` of a cell."""
    rows, columns = (slice(max(0, 2 * (at - reach)), 2 * (at + reach + 1)) for at in (row, column))
    return disparity[rows, columns]


def holed_map(size: tuple[int, int]) -> FloatImage:
    rng = np.random.default_rng(5)
    disparity = rng.uniform(-20.0, 20.0, size).astype(np.float32)
    disparity[rng.uniform(size=size) < 0.4] = np.nan
    disparity[:8, :8] = np.nan
    return disparity


def refinement_of(size: tuple[int, int]) -> Refinement:
    cells = np.ones(((size[0] + 1) // 2, (size[1] + 1) // 2), dtype=np.float32)
    return Refinement(
        residual_px=np.zeros(size, dtype=np.float32),
        step_px=cells,
        noise=cells,
        noise_sigma_px=cells,
        likeness=cells,
        wide_likeness=cells,
        seen=np.ones(size, dtype=np.bool_),
    )
