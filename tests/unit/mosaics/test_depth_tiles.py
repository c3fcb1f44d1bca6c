import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.depth_tiles import (
    STEP_M,
    TILE_CELLS,
    depth_range_m,
    nearest_of_four,
    write_depth_tiles,
)

NAN = np.nan


def metres(path: Path) -> NDArray[np.float64]:
    """Return the depth that a tile's colours say; 0 unknown."""
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    assert picture is not None
    blue, green, red = np.moveaxis(picture.astype(np.int64), 2, 0)
    return np.asarray((red * 65536 + green * 256 + blue) * STEP_M, dtype=np.float64)


def test_depth_is_read_back_from_the_colours_of_its_tiles(tmp_path: Path) -> None:
    z_m = np.linspace(0.5, 1500.0, 600 * 10, dtype=np.float32).reshape(10, 600)
    z_m[3, 7] = NAN
    write_depth_tiles(tmp_path, z_m)
    tiles = [metres(tmp_path / "depth_files" / "10" / f"{column}_0.png") for column in (0, 1)]
    assert tiles[0].shape == (10, TILE_CELLS)
    read_m = np.concatenate(tiles, axis=1)
    assert read_m[3, 7] == 0.0
    known = np.isfinite(z_m)
    assert np.abs(read_m - z_m)[known].max() <= STEP_M
    assert metres(tmp_path / "depth_files" / "0" / "0_0.png").shape == (1, 1)
    assert 'Width="600" Height="10"' in (tmp_path / "depth.dzi").read_text()
    document = json.loads((tmp_path / "depth_tiles.json").read_text())
    assert (document["cell_px"], document["step_m"]) == (8, STEP_M)


def test_a_coarser_level_shows_the_nearest_of_four_and_makes_nothing_up() -> None:
    z_m = np.array([[5.0, 2.0, NAN], [7.0, NAN, NAN], [4.0, 9.0, 3.0]], dtype=np.float32)
    found = nearest_of_four(z_m)
    assert np.array_equal(found, np.array([[2.0, NAN], [4.0, 3.0]], dtype=np.float32), equal_nan=True)


@pytest.mark.parametrize("place", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_the_nearest_of_four_is_found_wherever_it_lies(place: tuple[int, int]) -> None:
    z_m = np.full((2, 2), 8.0, dtype=np.float32)
    z_m[place] = 5.0
    assert nearest_of_four(z_m).tolist() == [[5.0]]


def test_the_scale_leaves_outliers_out_and_has_no_ends_where_nothing_is_known() -> None:
    z_m = np.full((100, 100), 6.0, dtype=np.float32)
    z_m[0, 0] = 900.0
    near_m, far_m = depth_range_m(z_m)
    assert near_m is not None
    assert far_m is not None
    assert 5.9 < near_m < 6.0 < far_m < 6.1
    assert depth_range_m(np.full((4, 4), NAN, dtype=np.float32)) == (None, None)
