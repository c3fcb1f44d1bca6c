"""Motion blur of evenly moving objects: shifted copies of their picture, averaged over the static picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel, part

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class MovingLayer(NamedTuple):
    """A picture of the moving objects alone, with a margin around the blurred picture."""

    radiance: F32  # (H, W, c + 1), the last is coverage; black where that is 0
    depth: F32  # (H, W) metres, infinite where nothing is hit
    ids: I32  # (H, W) object, −1 where nothing is hit
    group: I32  # (objects,) which of the groups that move alike an object belongs to
    margin_x: int
    margin_y: int


@kernel
def smear(
    still: F32, still_depth: F32, layer: MovingLayer, steps: I32, first: int, end: int, out: F32
) -> None:
    """Fill the rows first..end of `out` (h, w, c) with the mean of the pictures of all steps.

    `still` (h, w, c), `still_depth` (h, w): the static picture. `steps` (k, groups, 2): shift of a group in
    each step, px along x and y from its position in the layer. Of two groups the one of the lower number is
    in front; occlusion within a group does not change.
    """
    _, width, channels = still.shape
    count, groups, columns = steps.shape[0], steps.shape[1], layer.ids.shape[1]
    kept = 2 * layer.margin_y + 1
    planes = np.empty((kept, channels + 1, columns), np.float32)
    near, spans = np.empty((kept, groups, columns), np.float32), np.empty((kept, groups, 2), np.int32)
    total = np.empty((channels, width), np.float32)
    free, hidden = np.empty(width, np.float32), np.empty(width, np.float32)
    rows, lefts = np.empty(groups, np.int32), np.empty(groups, np.int32)
    share, all_steps = np.float32(1.0 / count), np.float32(count)
    for v in range(first, first + kept - 1):
        _take_row(layer, v, planes[v % kept], near[v % kept], spans[v % kept])
    for y in range(first, end):
        newest = (y + kept - 1) % kept
        _take_row(layer, y + kept - 1, planes[newest], near[newest], spans[newest])
        total[:], hidden[:] = np.float32(0.0), np.float32(0.0)
        for k in range(count):
            for g in range(groups):
                rows[g] = (y + layer.margin_y - steps[k, g, 1]) % kept
                lefts[g] = layer.margin_x - steps[k, g, 0]
            _add_step(near, planes, spans, rows, lefts, still_depth[y], free, hidden, total)
        for c in range(channels):
            for x in range(width):
                out[y, x, c] = share * (total[c, x] + (all_steps - hidden[x]) * still[y, x, c])


@part
def _add_step(
    near: F32, planes: F32, spans: I32, rows: I32, lefts: I32, depth: F32, free: F32, hidden: F32, total: F32
) -> None:
    """Add the groups of one step to a row: of each, the row `rows[g]` of those kept, from `lefts[g]` on."""
    width, shown = depth.shape[0], 0
    for g in range(len(rows)):
        shown += spans[rows[g], g, 0] < spans[rows[g], g, 1]
    if shown > 1:
        free[:] = np.float32(1.0)
    for g in range(len(rows) if shown > 0 else 0):
        v, left = rows[g], lefts[g]
        begin, stop = max(0, spans[v, g, 0] - left), min(width, spans[v, g, 1] - left)
        if shown == 1:
            _cover_alone(near[v, g], planes[v], left, begin, stop, depth, hidden, total)
        else:
            _cover(near[v, g], planes[v], left, begin, stop, depth, free, total)
    for x in range(width if shown > 1 else 0):
        hidden[x] += np.float32(1.0) - free[x]


@part
def _cover_alone(
    near: F32, planes: F32, left: int, begin: int, stop: int, depth: F32, hidden: F32, total: F32
) -> None:
    """Add columns begin..stop of a row of the layer where no other group is; otherwise as `_cover`.

    `hidden` (w,): the number of steps in which each pixel is covered, increased in place.
    """
    cover, colour, sums = planes[total.shape[0]], planes[0], total[0]
    a, b, shift = np.uintp(begin), np.uintp(stop), np.uintp(left)
    for x in range(a, b):
        shows = np.float32(1.0) if near[shift + x] < depth[x] else np.float32(0.0)
        hidden[x] += shows * cover[shift + x]
        sums[x] += shows * colour[shift + x]
    for c in range(1, total.shape[0]):
        colour, sums = planes[c], total[c]
        for x in range(a, b):
            shows = np.float32(1.0) if near[shift + x] < depth[x] else np.float32(0.0)
            sums[x] += shows * colour[shift + x]


@part
def _cover(
    near: F32, planes: F32, left: int, begin: int, stop: int, depth: F32, free: F32, total: F32
) -> None:
    """Add columns begin..stop of a row of the layer to `total` (c, w).

    `near` (W,), `planes` (c + 1, W): the row, from its column `left` on. `depth` (w,): of the static picture;
    where that is nearer the layer is hidden. `free` (w,): the share of each pixel that is not covered yet,
    reduced in place.
    """
    channels, width = total.shape
    weight, cover = np.empty(width, np.float32), planes[channels]
    a, b, shift = np.uintp(begin), np.uintp(stop), np.uintp(left)
    for x in range(a, b):
        weight[x] = free[x] if near[shift + x] < depth[x] else np.float32(0.0)
    for x in range(a, b):
        free[x] -= weight[x] * cover[shift + x]
    for c in range(channels):
        colour, sums = planes[c], total[c]
        for x in range(a, b):
            sums[x] += weight[x] * colour[shift + x]


@part
def _take_row(layer: MovingLayer, v: int, planes: F32, near: F32, spans: I32) -> None:
    """Read row v of the layer: its channels, the depth of each group, and the columns from..to of each.

    The depth is infinite where a group is not; the columns of one that is not in the row are empty. Pixels
    that an object covers in part, but not at their middle, get the group and the depth beside them.
    """
    channels, columns = planes.shape
    radiance, ids, depth, group = layer.radiance[v], layer.ids[v], layer.depth[v], layer.group
    near[:], spans[:, 0], spans[:, 1] = np.float32(np.inf), columns, 0
    for c in range(channels):
        plane = planes[c]
        for x in range(columns):
            plane[x] = radiance[x, c]
    cover = planes[channels - 1]
    for x in range(np.uintp(columns)):
        if cover[x] > np.float32(0.0):
            shown, at = ids[x], depth[x]
            if shown < 0:
                shown, at = _beside(layer.ids, layer.depth, v, np.intp(x))
            if shown >= 0:
                g = group[shown]
                near[g, x] = at
                spans[g, 0], spans[g, 1] = min(spans[g, 0], np.int32(x)), np.int32(x + np.uintp(1))


@part
def _beside(ids: I32, depths: F32, y: int, x: int) -> tuple[np.int32, np.float32]:
    """Return object and depth of the nearest of the pixels about one that shows nothing; −1 without any."""
    shown, depth = np.int32(-1), np.float32(np.inf)
    for v in range(max(0, y - 1), min(ids.shape[0], y + 2)):
        for u in range(max(0, x - 1), min(ids.shape[1], x + 2)):
            if ids[v, u] >= 0 and depths[v, u] < depth:
                shown, depth = ids[v, u], depths[v, u]
    return shown, depth
