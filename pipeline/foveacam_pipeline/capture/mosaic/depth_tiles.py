"""The fused depth as Deep Zoom tiles that a browser decodes exactly: PNG whose colours encode depth.

A pixel is a cell of the chart; red * 65536 + green * 256 + blue is its depth in steps of `STEP_M`, 0
unknown. A coarser level shows the nearest of four cells: a mean depth would lie where nothing is.
"""

import json
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.mosaic.chart import CELL
from foveacam_pipeline.storage.disk import write_file

Cells = NDArray[np.float32]
STEP_M = 1e-4
LARGEST = 256**3 - 1
TILE_CELLS = 512
DOCUMENT = "depth_tiles.json"
FORMAT = "foveacam-depth-tiles"
VERSION = 1


def write_depth_tiles(folder: Path, z_m: Cells) -> None:
    """Write depth.dzi, its tiles and their description. `z_m`: (rows, columns), NaN unknown.

    Raise OSError.
    """
    height, width = z_m.shape
    top = math.ceil(math.log2(max(width, height)))
    level_m = z_m
    for level in range(top, -1, -1):
        _write_level(folder / "depth_files" / str(level), level_m)
        level_m = nearest_of_four(level_m)
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<Image xmlns="http://schemas.microsoft.com/deepzoom/2008" '
        f'Format="png" Overlap="0" TileSize="{TILE_CELLS}">\n'
        f'  <Size Width="{width}" Height="{height}"/>\n</Image>\n'
    )
    write_file(folder / "depth.dzi", text.encode())
    near_m, far_m = depth_range_m(z_m)
    document = {
        "format": FORMAT,
        "version": VERSION,
        "width": width,
        "height": height,
        "cell_px": CELL,
        "tile_px": TILE_CELLS,
        "step_m": STEP_M,
        "near_m": near_m,
        "far_m": far_m,
    }
    write_file(folder / DOCUMENT, (json.dumps(document, indent=1) + "\n").encode())


def encode_depth(z_m: Cells) -> NDArray[np.uint8]:
    """Return depth as (h, w, 3) uint8; unknown depth and depth beyond 1677 m is black."""
    steps = np.rint(np.nan_to_num(z_m.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0) / STEP_M)
    steps[(steps < 0) | (steps > LARGEST)] = 0
    whole = steps.astype(np.uint32)
    return np.stack([whole >> 16, (whole >> 8) & 255, whole & 255], axis=2).astype(np.uint8)


def nearest_of_four(z_m: Cells) -> Cells:
    """Return half the size, rounded up: the nearest known depth of every 2 x 2 cells."""
    height, width = z_m.shape
    even = np.pad(z_m, ((0, height % 2), (0, width % 2)), constant_values=np.nan)
    rows = np.fmin(even[0::2], even[1::2])
    return np.asarray(np.fmin(rows[:, 0::2], rows[:, 1::2]), dtype=np.float32)


def depth_range_m(z_m: Cells) -> tuple[float | None, float | None]:
    """Return the limits of a colour scale, m, without the outer 2 % of depths; None where none is known."""
    known = z_m[np.isfinite(z_m)]
    if known.size == 0:
        return None, None
    near_m, far_m = (float(value) for value in np.percentile(known, (2, 98)))
    margin_m = max(0.05 * (far_m - near_m), 0.002 * far_m)
    return max(0.0, near_m - margin_m), far_m + margin_m


def _write_level(folder: Path, level_m: Cells) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    height, width = level_m.shape
    for row, y in enumerate(range(0, height, TILE_CELLS)):
        for column, x in enumerate(range(0, width, TILE_CELLS)):
            tile_m = level_m[y : y + TILE_CELLS, x : x + TILE_CELLS]
            write_file(folder / f"{column}_{row}.png", encode(encode_depth(tile_m), ImageCodec.PNG))
