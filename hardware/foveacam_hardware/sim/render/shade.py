"""Radiance of a run of pixels that see the same face: coordinates, footprint, material, light.

The noise is filtered by choosing mip levels of its layers by the pixel's footprint on the face, with
several fetches along a stretched footprint; cells are averaged over it exactly.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.cells import shade_cells
from foveacam_hardware.sim.render.jit import kernel
from foveacam_hardware.sim.render.materials import BITMAP, CELLS, MAX_LAYERS, NOISE, Tables
from foveacam_hardware.sim.render.noise import LEVELS, LONGEST, SHORTEST, TILE
from foveacam_hardware.sim.render.pictures import shade_bitmap
from foveacam_hardware.sim.render.setup import TILE_W, Objects, Prims

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

MAX_TAPS = 8
CUT_PX = 2.6
"""Shortest wavelength let through, in pixels: what is shorter would alias."""
TAP_SPREAD = 1.0
"""Length over which taps are spread along a stretched footprint, in pixels."""


class Run(NamedTuple):
    """Working memory of a run of at most TILE_W pixels."""

    t: F64  # ray parameter
    light: F32
    du: F32  # metres from the middle of the run, along u and v
    dv: F32
    shade: F32  # (3, TILE_W) red, green, blue of a bitmap; else row 0: 0 = first colour, 1 = second
    total: F32  # (3, TILE_W) sum over mapping axes
    weight: F32
    weights: F32  # sum of the weights, of their squares for noise
    J: F64  # (2, 2) footprint: metres along (u, v) per pixel along (x, y)


@kernel
def new_run() -> Run:
    """Allocate the working memory."""
    n = TILE_W
    return Run(
        np.zeros(n),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros((3, n), np.float32),
        np.zeros((3, n), np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros((2, 2)),
    )


@kernel
def _interpolate(x: F64, y: F64, t: F64, plane: F64, out: F32) -> None:
    """Fill out with t·(plane·p): an attribute that is linear on the face."""
    for i in range(x.shape[0]):
        out[i] = np.float32((plane[0] * x[i] + plane[1] * y[i] + plane[2]) * t[i])


@kernel
def _ray_parameters(x: F64, y: F64, plane: F64, t: F64) -> None:
    for i in range(x.shape[0]):
        t[i] = 1.0 / (plane[0] * x[i] + plane[1] * y[i] + plane[2])


@kernel
def _coordinate(x: F64, y: F64, t: F64, row: F64, scale: float, out: F32) -> float:
    """Fill out with a coordinate from the middle of the run on, metres; return it there, from the camera on."""
    m = x.shape[0] // 2
    middle = (row[0] * x[m] + row[1] * y[m] + row[2]) * t[m] * scale
    for i in range(x.shape[0]):
        out[i] = np.float32((row[0] * x[i] + row[1] * y[i] + row[2]) * t[i] * scale - middle)
    return middle


@kernel
def _footprint(x: float, y: float, t: float, row: F64, plane: F64, scale: float, out: F64) -> None:
    """Fill out (2,) with metres of a coordinate per pixel along x and y."""
    along = (row[0] * x + row[1] * y + row[2]) * t
    out[0] = scale * t * (row[0] - plane[0] * along)
    out[1] = scale * t * (row[1] - plane[1] * along)


@kernel
def _fetch(du: F32, dv: F32, base: F64, grid: F64, weight: float, level: int, noise: F32, out: F32) -> None:
    """Add weight · noise at texel (base + grid (du, dv)) of a level, bilinear, periodic."""
    bits = np.int32(10 - level)
    n = np.int32(TILE >> level)
    first = 0
    for k in range(level):
        first += (TILE >> k) * (TILE >> k)
    texels = noise[first : first + n * n]
    mask = np.int32(n - 1)
    scale = 0.5**level
    bx, by = base[0] * scale, base[1] * scale
    u0 = np.float32(bx - np.floor(bx / n) * n)
    v0 = np.float32(by - np.floor(by / n) * n)
    a, b = np.float32(grid[0] * scale), np.float32(grid[1] * scale)
    c, d = np.float32(grid[2] * scale), np.float32(grid[3] * scale)
    w = np.float32(weight)
    for i in range(du.shape[0]):
        x = u0 + du[i] * a + dv[i] * b
        y = v0 + du[i] * c + dv[i] * d
        fx, fy = np.floor(x), np.floor(y)
        j, k = np.int32(fx) & mask, np.int32(fy) & mask
        j1, k1 = (j + np.int32(1)) & mask, ((k + np.int32(1)) & mask) << bits
        k = k << bits
        x -= fx
        y -= fy
        top = texels[np.uint32(k + j)] + x * (texels[np.uint32(k + j1)] - texels[np.uint32(k + j)])
        low = texels[np.uint32(k1 + j)] + x * (texels[np.uint32(k1 + j1)] - texels[np.uint32(k1 + j)])
        out[i] += w * (top + y * (low - top))


@kernel
def _taps(
    run: Run, n: int, base: F64, grid: F64, weight: float, level: int, axis: F64, taps: int, noise: F32
) -> None:
    """Fetch `taps` times along `axis` (metres in u and v, one pixel long) about each pixel."""
    here = np.empty(2)
    for k in range(taps):
        at = ((k + 0.5) / taps - 0.5) * TAP_SPREAD
        here[0] = base[0] + at * (grid[0] * axis[0] + grid[1] * axis[1])
        here[1] = base[1] + at * (grid[2] * axis[0] + grid[3] * axis[1])
        _fetch(run.du[:n], run.dv[:n], here, grid, weight / taps, level, noise, run.shade[0, :n])


@kernel
def long_axis(J: F64, axis: F64) -> float:
    """Fill axis (2,) with the footprint ellipse's longer half axis doubled, metres; return the shorter one."""
    p = J[0, 0] * J[0, 0] + J[0, 1] * J[0, 1]
    r = J[1, 0] * J[1, 0] + J[1, 1] * J[1, 1]
    s = J[0, 0] * J[1, 0] + J[0, 1] * J[1, 1]
    half, spread = 0.5 * (p + r), np.sqrt(0.25 * (p - r) * (p - r) + s * s)
    long = np.sqrt(half + spread)
    angle = 0.5 * np.arctan2(2.0 * s, p - r)
    axis[0], axis[1] = long * np.cos(angle), long * np.sin(angle)
    det = abs(J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0])
    return det / max(long, 1e-300)


@kernel
def _shade_noise(run: Run, n: int, u: float, v: float, side: int, layers: F64, noise: F32) -> None:
    """Fill shade row 0 with the sum of all layers that the footprint lets through, of mean 0."""
    axis, base, grid = np.empty(2), np.empty(2), np.empty(4)
    short = long_axis(run.J, axis)
    long = np.hypot(axis[0], axis[1])
    taps = int(min(float(MAX_TAPS), max(1.0, np.ceil(long / max(short, 1e-300) - 0.3))))
    footprint = max(short, long / taps)
    for i in range(n):
        run.shade[0, i] = np.float32(0.0)
    for k in range(MAX_LAYERS):
        texel = layers[k, 0]
        if texel == 0.0 or CUT_PX * footprint >= texel * LONGEST:
            break
        for j in range(4):
            grid[j] = layers[k, 1 + j]
        # Opposite and neighbouring faces show other parts of the tile.
        base[0] = grid[0] * u + grid[1] * v + TILE * (layers[k, 5] + 0.381966 * side)
        base[1] = grid[2] * u + grid[3] * v + TILE * (layers[k, 5] * 7.0 + 0.276393 * side)
        needed = 1 if CUT_PX * long <= SHORTEST * texel else taps
        level = max(0.0, np.log2(CUT_PX * footprint / (SHORTEST * texel)))
        low = int(level)
        part = level - low
        if low < LEVELS:
            _taps(run, n, base, grid, layers[k, 6] * (1.0 - part), low, axis, needed, noise)
        if part > 0.0 and low + 1 < LEVELS:
            _taps(run, n, base, grid, layers[k, 6] * part, low + 1, axis, needed, noise)


@kernel
def _shade_axis(
    x: F64, y: F64, f: int, side: int, run: Run, prims: Prims, objects: Objects, tables: Tables
) -> None:
    """Fill shade by the object's material, mapped along one axis of its coordinates."""
    n, m = x.shape[0], x.shape[0] // 2
    j = prims.obj[f]
    axis = side >> 1
    a, b = (2 if axis == 0 else 0), (2 if axis == 1 else 1)
    A, o, plane = objects.A[j], objects.o[j], prims.q[f]
    scale = 1.0 / tables.stretch[j]
    u = o[a] * scale + _coordinate(x, y, run.t, A[a], scale, run.du[:n])
    v = o[b] + _coordinate(x, y, run.t, A[b], 1.0, run.dv[:n])
    _footprint(x[m], y[m], run.t[m], A[a], plane, scale, run.J[0])
    _footprint(x[m], y[m], run.t[m], A[b], plane, 1.0, run.J[1])
    kind = tables.kind[j]
    if kind == NOISE:
        _shade_noise(run, n, u, v, side, tables.layers[j], tables.noise)
    elif kind == CELLS:
        shade_cells(run.du[:n], run.dv[:n], u, v, run.J, tables.cells[j], tables.sums, run.shade[0])
    elif kind == BITMAP:
        shade_bitmap(run.du[:n], run.dv[:n], u, v, run.J, tables.cells[j], tables.texels, run.shade)


@kernel
def _shade_blended(x: F64, y: F64, f: int, run: Run, prims: Prims, objects: Objects, tables: Tables) -> None:
    """Fill shade by the mean over mapping axes; noise keeps its contrast (the layers are independent)."""
    n = x.shape[0]
    kind = tables.kind[prims.obj[f]]
    rows = 3 if kind == BITMAP else 1
    run.total[:, :n] = np.float32(0.0)
    run.weights[:n] = np.float32(0.0)
    for axis in range(3):
        plane = prims.weights[f, axis]
        if plane[0] == 0.0 and plane[1] == 0.0 and plane[2] == 0.0:
            continue
        side = 2 * axis + ((prims.blend[f] >> axis) & 1)
        _shade_axis(x, y, f, side, run, prims, objects, tables)
        _interpolate(x, y, run.t, plane, run.weight[:n])
        for i in range(n):
            w = max(np.float32(0.0), run.weight[i])
            run.weights[i] += w * w if kind == NOISE else w
            for k in range(rows):
                run.total[k, i] += w * run.shade[k, i]
    for i in range(n):
        w = np.sqrt(run.weights[i]) if kind == NOISE else run.weights[i]
        for k in range(rows):
            run.shade[k, i] = run.total[k, i] / w


@kernel
def _paint(run: Run, n: int, kind: int, colors: F64, luma: F64, out: F32) -> None:
    """Write light times colour; out (n, channels)."""
    if kind == BITMAP and out.shape[1] == 1:
        r, g, b = np.float32(luma[0]), np.float32(luma[1]), np.float32(luma[2])
        for i in range(n):
            out[i, 0] = run.light[i] * (r * run.shade[0, i] + g * run.shade[1, i] + b * run.shade[2, i])
        return
    for c in range(out.shape[1]):
        first = np.float32(0.0) if kind == BITMAP else np.float32(colors[0, c])
        step = np.float32(1.0) if kind == BITMAP else np.float32(colors[1, c] - colors[0, c])
        row = run.shade[c if kind == BITMAP else 0]
        for i in range(n):
            out[i, c] = run.light[i] * (first + step * row[i])


@kernel
def shade(
    x: F64, y: F64, f: int, run: Run, prims: Prims, objects: Objects, tables: Tables, luma: F64, out: F32
) -> None:
    """Shade a run of undistorted pixels (n,) that see face f; out (n, 1 or 3). run.t is left for the depth."""
    n = x.shape[0]
    kind = tables.kind[prims.obj[f]]
    _ray_parameters(x, y, prims.q[f], run.t)
    _interpolate(x, y, run.t, prims.light[f], run.light[:n])
    if kind == CELLS or kind == BITMAP or kind == NOISE:
        if prims.blend[f]:
            _shade_blended(x, y, f, run, prims, objects, tables)
        else:
            _shade_axis(x, y, f, prims.side[f], run, prims, objects, tables)
    if kind == NOISE:
        for i in range(n):
            run.shade[0, i] = min(max(run.shade[0, i] + np.float32(0.5), np.float32(0.0)), np.float32(1.0))
    elif kind != CELLS and kind != BITMAP:
        run.shade[0, :n] = np.float32(0.0)
    _paint(run, n, kind, tables.colors[prims.obj[f]], luma, out)


@kernel
def shade_sky(x: F64, y: F64, Minv: F64, sky: F64, out: F32) -> None:
    """Shade a run that hits nothing: from the horizon's colour to the zenith's, 40° up."""
    for i in range(x.shape[0]):
        dx = Minv[0, 0] * x[i] + Minv[0, 1] * y[i] + Minv[0, 2]
        dy = Minv[1, 0] * x[i] + Minv[1, 1] * y[i] + Minv[1, 2]
        dz = Minv[2, 0] * x[i] + Minv[2, 1] * y[i] + Minv[2, 2]
        up = -dy / np.sqrt(dx * dx + dy * dy + dz * dz)
        s = min(1.0, max(0.0, up * 1.55))
        for c in range(out.shape[1]):
            out[i, c] = np.float32(sky[0, c] + s * (sky[1, c] - sky[0, c]))
