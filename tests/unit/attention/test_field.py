import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_pipeline.attention.field import (
    FIRST_GUESS_PER_M,
    FieldGrid,
    Yields,
    cell_contrast,
    expected_inverse_z,
    parts_of,
)
from foveacam_pipeline.wide_depth.values import ContextMap

GRID = FieldGrid.of(CALIBRATION.wide, context_cell_px=8)


def known_map() -> ContextMap:
    return ContextMap.empty(rows=135, columns=180, cell_px=8)


def test_the_grid_covers_the_wide_view_with_cells_of_three_by_three_context_cells() -> None:
    assert (GRID.rows, GRID.columns, GRID.cell_px, len(GRID)) == (45, 60, 24, 2700)
    middle = GRID.tangents[22 * 60 + 30]
    pixel = CALIBRATION.wide.pixels(np.arctan(middle)[None])[0]
    assert pixel == pytest.approx([30 * 24 + 11.5, 22 * 24 + 11.5], abs=1e-6)


def test_parts_are_the_context_cells_of_each_cell_and_filled_beyond_the_edge() -> None:
    values = np.arange(135 * 180, dtype=np.float64).reshape(135, 180)
    parts = parts_of(values, GRID, fill=-1.0)
    assert parts[61].tolist() == values[3:6, 3:6].ravel().tolist()
    cut = parts_of(values[:134], GRID, fill=-1.0)
    assert cut[-1].tolist() == [*values[132:134, 177:180].ravel().tolist(), -1.0, -1.0, -1.0]


def test_depth_is_expected_to_be_that_of_the_nearest_known_cell() -> None:
    known = known_map()
    expected, guessed = expected_inverse_z(known, GRID)
    assert (expected == FIRST_GUESS_PER_M).all()
    assert guessed.all()
    known.inverse_z_per_m[0, 3:6, 3] = (0.2, 0.5, 0.3)
    known.inverse_z_per_m[0, 120, 150] = 0.04
    expected, guessed = expected_inverse_z(known, GRID)
    grid = expected.reshape(45, 60)
    assert guessed.sum() == len(GRID) - 2
    assert (grid[1, 1], grid[0, 0], grid[5, 5]) == (0.3, 0.3, 0.3)
    assert (grid[40, 50], grid[44, 59]) == (0.04, 0.04)


@pytest.mark.parametrize("binning", [1, 2])
def test_contrast_is_of_what_changes_along_the_rows(binning: int) -> None:
    picture = np.full((1080 // binning, 1440 // binning), 100, np.uint8)
    period = 24 // binning
    upright = (np.arange(picture.shape[1]) // period) % 2 * 60
    level = (np.arange(picture.shape[0]) // period) % 2 * 60
    half = picture.shape[0] // 2
    picture[:half] += upright.astype(np.uint8)
    picture[half:] += level[half:, None].astype(np.uint8)
    contrast = cell_contrast(picture, GRID, binning=binning).reshape(45, 60)
    assert contrast[2:20, 2:-2].min() > 1.0
    assert contrast[25:-2, 2:-2].max() < 0.1


def test_the_noise_of_the_camera_is_no_contrast() -> None:
    noise = np.random.default_rng(4).normal(100.0, 1.5, (1080, 1440))
    blank = cell_contrast(np.clip(noise, 0, 255).astype(np.uint8), GRID, binning=1)
    assert np.median(blank) < 0.12
    texture = np.random.default_rng(5).normal(0.0, 12.0, (540, 720)).repeat(2, axis=0).repeat(2, axis=1)
    textured = cell_contrast(np.clip(noise + texture, 0, 255).astype(np.uint8), GRID, binning=1)
    assert textured.min() > 1.0


def test_yields_follow_what_looks_bring_and_know_no_windfall() -> None:
    yields = Yields()
    for _ in range(30):
        yields = yields.learned(apart=True, share=0.2)
    assert yields.apart == pytest.approx(0.2, abs=0.01)
    assert yields.verged == 1.0
    for _ in range(60):
        yields = yields.learned(apart=False, share=9.0)
    assert yields.verged == pytest.approx(1.5, abs=0.01)
    assert yields.learned(apart=False, share=-3.0).verged < yields.verged
