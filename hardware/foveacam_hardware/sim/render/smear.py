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
    near, present = np.empty((kept, groups, columns), np.float32), np.empty((kept, groups), np.bool_)
    total = np.empty((channels, width), np.float32)
    free, seen = np.empty(width, np.float32), np.empty(width, np.float32)
    share = np.float32(1.0 / count)
    for v in range(first, first + kept - 1):
        _take_row(layer, v, planes[v % kept], near[v % kept], present[v % kept])
    for y in range(first, end):
        newest = (y + kept - 1) % kept
        _take_row(layer, y + kept - 1, planes[newest], near[newest], present[newest])
        total[:], seen[:] = np.float32(0.0), np.float32(0.0)
        for k in range(count):
            free[:] = np.float32(1.0)
            for g in range(groups):
                v = (y + layer.margin_y - steps[k, g, 1]) % kept
                if present[v, g]:
                    _cover(
                        near[v, g], planes[v], layer.margin_x - steps[k, g, 0], still_depth[y], free, total
                    )
            for x in range(width):
                seen[x] += free[x]
        for c in range(channels):
            for x in range(width):
                out[y, x, c] = share * (total[c, x] + seen[x] * still[y, x, c])


@part
def _cover(near: F32, planes: F32, left: int, depth: F32, free: F32, total: F32) -> None:
    """Add a row of the layer, `near` (W,) and `planes` (c + 1, W), from `left` on to `total` (c, w).

    `depth` (w,): of the static picture; where that is nearer the layer is hidden. `free` (w,): the share of
    each pixel that is not covered yet, reduced in place.
    """
    channels, width = total.shape
    weight, cover = np.empty(width, np.float32), planes[channels]
    first = np.uintp(left)
    for x in range(np.uintp(width)):
        weight[x] = free[x] if near[first + x] < depth[x] else np.float32(0.0)
    for x in range(np.uintp(width)):
        free[x] -= weight[x] * cover[first + x]
    for c in range(channels):
        colour, sums = planes[c], total[c]
        for x in range(np.uintp(width)):
            sums[x] += weight[x] * colour[first + x]


@part
def _take_row(layer: MovingLayer, v: int, planes: F32, near: F32, present: NDArray[np.bool_]) -> None:
    """Read row v of the layer: its channels, the depth of each group, and which groups are in it.

    The depth is infinite where a group is not. Pixels that an object covers in part, but not at their middle,
    get the group and the depth beside them.
    """
    channels, columns = planes.shape
    near[:], present[:] = np.float32(np.inf), False
    radiance = layer.radiance[v]
    for c in range(channels):
        for x in range(columns):
            planes[c, x] = radiance[x, c]
    for x in range(columns):
        if planes[channels - 1, x] > np.float32(0.0):
            shown, depth = _shown(layer, v, x)
            if shown >= 0:
                near[layer.group[shown], x] = depth
                present[layer.group[shown]] = True


@part
def _shown(layer: MovingLayer, y: int, x: int) -> tuple[int, float]:
    """Return object and depth of a pixel, or of the nearest beside it; −1 without any."""
    shown, depth = layer.ids[y, x], layer.depth[y, x]
    if shown >= 0:
        return shown, depth
    for v in range(max(0, y - 1), min(layer.ids.shape[0], y + 2)):
        for u in range(max(0, x - 1), min(layer.ids.shape[1], x + 2)):
            if layer.ids[v, u] >= 0 and layer.depth[v, u] < depth:
                shown, depth = layer.ids[v, u], layer.depth[v, u]
    return shown, depth
