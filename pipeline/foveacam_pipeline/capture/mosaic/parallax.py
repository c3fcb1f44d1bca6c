"""Depth for laying pictures where stereo has none: from the overlaps themselves.

The pupil walks with the mirror, a few millimetres from view to view: neighbours of one eye see a thing from
two places. That is a short baseline, too short for a depth worth keeping, but what it tells is just what the
seam needs: the depth at which both show one thing at one place.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth, fill
from foveacam_pipeline.capture.mosaic.links import Place, around, both, places
from foveacam_pipeline.capture.mosaic.register import register
from foveacam_pipeline.capture.mosaic.views import Pictures, View, patch_of

GUESSES = (0.12, 0.3, 0.55)
"""Depths to begin with, q in 1/m, besides what the surroundings suggest."""
NEAREST, FARTHEST = 1.25, 0.0
"""q of what may be there, 1/m."""
ACROSS_PX = 2.0
"""Parallax moves along one line; what does not is no match."""
LEAST_PX_M = 12.0
"""So much the place must move with q: 0.1 px are then 0.01 per metre."""
MOST = 60
HALF_CELLS = 3


def with_overlaps(
    depth: FieldDepth, views: Sequence[View], pictures: Pictures, *, chart: Chart
) -> Iterator[tuple[int, FieldDepth]]:
    """Yield (views done, depth so far); in the last, overlaps without stereo lie as the views tell."""
    surmised = depth.surmised.copy()
    last = 0
    for place in places(views, chart, most=MOST):
        if place.first != last:
            last = place.first
            yield last, depth
        if np.isfinite(depth.per_depth[place.row, place.column]):
            continue
        q = _told(place, views, pictures, chart=chart, depth=depth)
        if q is not None:
            here = tuple(slice(k - HALF_CELLS, k + HALF_CELLS + 1) for k in (place.row, place.column))
            free = np.isnan(depth.per_depth[here])
            surmised[here][free] = q
    yield len(views), replace(depth, surmised=surmised, filled=fill(surmised))


def _told(
    place: Place, views: Sequence[View], pictures: Pictures, *, chart: Chart, depth: FieldDepth
) -> float | None:
    pair = [views[place.first], views[place.second]]
    patch = patch_of(chart, depth.filled, *around(place))
    u = np.asarray(chart.u0_px + CELL * place.column - 0.5)
    v = np.asarray(chart.v0_px + CELL * place.row - 0.5)
    for guess in (float(depth.filled[place.row, place.column]), *GUESSES):
        flat = replace(patch, per_depth=np.full_like(patch.per_depth, guess))
        images = both(pair, pictures, flat)
        found = None if images is None else register(*images)
        if found is None:
            continue
        slopes = []
        for view in pair:
            about = np.array(view.look.about(u, v, np.asarray(guess)))
            slopes.append(view.look.aside_px_m + view.look.pupil_m * about)
        way = slopes[1] - slopes[0]
        length = float(np.linalg.norm(way))
        if length < LEAST_PX_M:
            return None
        along = float(way @ found.shift_px) / length
        across = float(np.linalg.norm(found.shift_px - along * way / length))
        q = guess - along / length
        if across < ACROSS_PX and FARTHEST < q < NEAREST:
            return q
    return None
