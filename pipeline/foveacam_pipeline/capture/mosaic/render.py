"""One tile of a mosaic: foveae blended over the wide view.

A view weighs by the cube of how far inside its frame a pixel lies: seams are soft and narrow, and noise is
hardly averaged away on one side of them and not on the other. Where no fovea saw, the wide view shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.views import (
    ChartPatch,
    MosaicView,
    Picture,
    PlacedView,
    ViewPictureCache,
    lay,
    patch_of,
)
from foveacam_pipeline.capture.mosaic.wide import WideView, as_bright

FEATHER_PX = 24.0
"""Over so many px the outermost foveae pass into the wide view."""
GROUND = (17.0, 20.0, 26.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TileSources:
    """Everything that a tile is painted from."""

    chart: Chart
    filled: NDArray[np.float32]
    views: Sequence[MosaicView]
    pictures: ViewPictureCache
    channels: int
    wide: WideView | None

    def tile(self, x_px: int, y_px: int, *, width: int, height: int) -> Picture:
        """Return a rectangle of the chart, whose edges lie on cells: (h, w) or (h, w, 3) uint8."""
        rows = slice(y_px // CELL, (y_px + height) // CELL)
        columns = slice(x_px // CELL, (x_px + width) // CELL)
        patch = patch_of(self.chart, self.filled, rows, columns)
        total = np.zeros((height, width, self.channels), dtype=np.float32)
        weight = np.zeros((height, width), dtype=np.float32)
        deepest = np.zeros((height, width), dtype=np.float32)
        for laid in self._laid(patch):
            share = laid.inside_px**3
            total += share[..., None] * self._channels(laid.image)
            weight += share
            np.maximum(deepest, laid.inside_px, out=deepest)
        total /= np.maximum(weight, np.float32(1e-9))[..., None]
        cover = np.minimum(deepest / np.float32(FEATHER_PX), np.float32(1.0))[..., None]
        if float(cover.min()) < 1.0:
            total *= cover
            total += (np.float32(1.0) - cover) * self._beneath(patch)
        out = np.clip(np.rint(total), 0, 255).astype(np.uint8)
        return out[..., 0] if self.channels == 1 else out

    def _laid(self, patch: ChartPatch) -> list[PlacedView]:
        left, top, right, bottom = patch.box
        found = []
        for view in self.views:
            a, b, c, d = view.box
            if a <= right and left <= c and b <= bottom and top <= d:
                laid = lay(view, self.pictures.of(view), patch)
                if laid is not None:
                    found.append(laid)
        return found

    def _beneath(self, patch: ChartPatch) -> NDArray[np.float32]:
        ground = np.array(GROUND if self.channels == 3 else GROUND[:1], dtype=np.float32)
        if self.wide is None:
            return np.broadcast_to(ground, (*patch.size, self.channels))
        image, seen = self.wide.on(patch)
        return np.where(seen[..., None], self._channels(image), ground).astype(np.float32)

    def _channels(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        return image.reshape(*image.shape[:2], -1)


def canvas_of(
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    *,
    chart: Chart,
    filled: NDArray[np.float32],
    wide: WideView | None,
) -> TileSources:
    """Return what the tiles of a scan are painted from."""
    bright = None if wide is None else as_bright(wide, views, pictures, chart=chart, filled=filled)
    channels = 1 if pictures.of(views[0]).ndim == 2 else 3
    return TileSources(
        chart=chart, filled=filled, views=views, pictures=pictures, channels=channels, wide=bright
    )
