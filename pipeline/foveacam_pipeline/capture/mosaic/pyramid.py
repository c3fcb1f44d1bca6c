"""A picture of any size as Deep Zoom: tiles on disk, each level half the size of the one before.

Tiles are made depth first, four and then the one that combines them, so that memory holds a few tiles
whatever the size. A tile that is on disk is not rendered again.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.storage.disk import finish_part, write_file, write_part

Picture = NDArray[np.uint8]
TILE_PX = 512
NAME = "mosaic"


@dataclass(frozen=True, slots=True, kw_only=True)
class TilePyramid:
    """The files of the tiles. Level 0 is one pixel, `top` the whole picture."""

    folder: Path
    width: int
    height: int
    quality: int

    @property
    def top(self) -> int:
        """The level of the whole picture."""
        return math.ceil(math.log2(max(self.width, self.height)))

    def size(self, level: int) -> tuple[int, int]:
        """Return (width, height) of a level, px."""
        step: int = 2 ** (self.top - level)
        return -(-self.width // step), -(-self.height // step)

    def tiles(self, level: int) -> tuple[int, int]:
        """Return the number of tiles of a level, across and down."""
        width, height = self.size(level)
        return -(-width // TILE_PX), -(-height // TILE_PX)

    def path(self, level: int, column: int, row: int) -> Path:
        """Return the file of a tile."""
        return self.folder / f"{NAME}_files" / str(level) / f"{column}_{row}.jpg"

    @property
    def leaves(self) -> int:
        """Number of tiles of the whole picture."""
        across, down = self.tiles(self.top)
        return across * down

    def read(self, level: int, column: int, row: int) -> Picture | None:
        """Return a tile that is on disk; None where it is missing or unreadable."""
        try:
            content = self.path(level, column, row).read_bytes()
        except FileNotFoundError:
            return None
        found = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
        if found is None:
            return None
        image = found if found.ndim == 2 else cv2.cvtColor(found, cv2.COLOR_BGR2RGB)
        return np.asarray(image, dtype=np.uint8)

    def write(self, level: int, column: int, row: int, image: Picture) -> None:
        """Write a tile atomically. Raise OSError."""
        path = self.path(level, column, row)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_part(path, jpeg_bytes(image, quality=self.quality))
        finish_part(path)

    def write_descriptor(self) -> None:
        """Write the `.dzi` file, which marks all tiles as complete. Raise OSError."""
        text = (
            '<?xml version="1.0" encoding="UTF-8"?>\n'
            '<Image xmlns="http://schemas.microsoft.com/deepzoom/2008" '
            f'Format="jpg" Overlap="0" TileSize="{TILE_PX}">\n'
            f'  <Size Width="{self.width}" Height="{self.height}"/>\n</Image>\n'
        )
        write_file(self.folder / f"{NAME}.dzi", text.encode())

    def read_level(self, level: int) -> Picture:
        """Return a level as one picture, from its tiles."""
        across, down = self.tiles(level)
        rows = []
        for row in range(down):
            tiles = [self.read(level, column, row) for column in range(across)]
            if any(tile is None for tile in tiles):
                raise InvalidInput(f"{self.folder}: tiles of level {level} are gone; make the mosaic again")
            rows.append(np.concatenate([tile for tile in tiles if tile is not None], axis=1))
        return np.concatenate(rows, axis=0)

    def level_of(self, largest_px: int) -> int:
        """Return the finest level whose longer side is at most `largest_px`."""
        return next(level for level in range(self.top, -1, -1) if max(self.size(level)) <= largest_px)


Paint = Callable[[int, int, int, int], Picture]
"""(x, y, width, height) of the whole picture, px -> its pixels."""


def paint_tiles(pyramid: TilePyramid, paint: Paint, on_leaf: Callable[[int], None]) -> None:
    """Make all missing tiles; `on_leaf(n)` is called when n more tiles of the top level are finished."""
    _build_tile(pyramid, 0, 0, 0, paint=paint, on_leaf=on_leaf)


def _build_tile(
    pyramid: TilePyramid, level: int, column: int, row: int, *, paint: Paint, on_leaf: Callable[[int], None]
) -> Picture:
    image = pyramid.read(level, column, row)
    if image is not None:
        on_leaf(_leaves_below(pyramid, level, column, row))
        return image
    if level == pyramid.top:
        x, y = column * TILE_PX, row * TILE_PX
        image = paint(x, y, min(TILE_PX, pyramid.width - x), min(TILE_PX, pyramid.height - y))
        pyramid.write(level, column, row, image)
        on_leaf(1)
        return image
    across, down = pyramid.tiles(level + 1)
    rows = [
        np.concatenate(
            [
                _build_tile(pyramid, level + 1, c, r, paint=paint, on_leaf=on_leaf)
                for c in range(2 * column, min(across, 2 * column + 2))
            ],
            axis=1,
        )
        for r in range(2 * row, min(down, 2 * row + 2))
    ]
    image = halve(np.concatenate(rows, axis=0))
    pyramid.write(level, column, row, image)
    return image


def _leaves_below(pyramid: TilePyramid, level: int, column: int, row: int) -> int:
    step: int = 2 ** (pyramid.top - level)
    across, down = pyramid.tiles(pyramid.top)
    wide = min(across, (column + 1) * step) - column * step
    return wide * (min(down, (row + 1) * step) - row * step)


def halve(image: Picture) -> Picture:
    """Return a picture at half the size, rounded up: means of 2 x 2 px."""
    height, width = image.shape[:2]
    even = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    size = ((width + 1) // 2, (height + 1) // 2)
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def jpeg_bytes(image: Picture, *, quality: int) -> bytes:
    """Return (h, w) or (h, w, 3) RGB as a JPEG file."""
    stored = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    done, content = cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise InvalidInput(f"OpenCV cannot write a tile of {image.shape} as JPEG")
    return content.tobytes()
