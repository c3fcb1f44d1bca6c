"""Renders one tile of a mosaic: foveae blended over the wide view.

A view's weight is the cube of a pixel's distance to the edge of its frame: seams are soft and narrow, and
noise is about equal on both sides. The wide view fills what no fovea covers.
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
    chart_patch,
    warp_view,
)
from foveacam_pipeline.capture.mosaic.wide import WideView, match_brightness

FEATHER_PX = 24.0
"""Width over which the outermost foveae fade into the wide view."""
BACKGROUND = (17.0, 20.0, 26.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TileSources:
    """The inputs for rendering a tile."""

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
        patch = chart_patch(self.chart, self.filled, rows, columns)
        total = np.zeros((height, width, self.channels), dtype=np.float32)
        weight = np.zeros((height, width), dtype=np.float32)
        deepest = np.zeros((height, width), dtype=np.float32)
        for warped in self._warped_views(patch):
            share = warped.inside_px**3
            total += share[..., None] * self._channels(warped.image)
            weight += share
            np.maximum(deepest, warped.inside_px, out=deepest)
        total /= np.maximum(weight, np.float32(1e-9))[..., None]
        cover = np.minimum(deepest / np.float32(FEATHER_PX), np.float32(1.0))[..., None]
        if float(cover.min()) < 1.0:
            total *= cover
            total += (np.float32(1.0) - cover) * self._background(patch)
        out = np.clip(np.rint(total), 0, 255).astype(np.uint8)
        return out[..., 0] if self.channels == 1 else out

    def _warped_views(self, patch: ChartPatch) -> list[PlacedView]:
        left, top, right, bottom = patch.box
        found = []
        for view in self.views:
            a, b, c, d = view.box
            if a <= right and left <= c and b <= bottom and top <= d:
                warped = warp_view(view, self.pictures.picture(view), patch)
                if warped is not None:
                    found.append(warped)
        return found

    def _background(self, patch: ChartPatch) -> NDArray[np.float32]:
        background = np.array(BACKGROUND if self.channels == 3 else BACKGROUND[:1], dtype=np.float32)
        if self.wide is None:
            return np.broadcast_to(background, (*patch.size, self.channels))
        image, seen = self.wide.on_patch(patch)
        return np.where(seen[..., None], self._channels(image), background).astype(np.float32)

    def _channels(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        return image.reshape(*image.shape[:2], -1)


def tile_sources(
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    *,
    chart: Chart,
    filled: NDArray[np.float32],
    wide: WideView | None,
) -> TileSources:
    """Return the inputs for rendering the tiles of a scan."""
    bright = None if wide is None else match_brightness(wide, views, pictures, chart=chart, filled=filled)
    channels = 1 if pictures.picture(views[0]).ndim == 2 else 3
    return TileSources(
        chart=chart, filled=filled, views=views, pictures=pictures, channels=channels, wide=bright
    )
