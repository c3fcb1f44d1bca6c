"""Feasible regions by cells, computed from the definition alone, to check `regions`.

Every cell's centre is tested against every edge of every obstacle with numpy; no geometry library, no code
of the exact regions.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap
from foveacam_pipeline.study.visibility.standoff import StandoffRing

CHUNK = 8192
"""Cells tested at once; this many fit into a processor's cache."""


def raster_regions(
    field: FieldMap, ring: StandoffRing, *, agent_radius_m: float, cell_m: float
) -> NDArray[np.bool_]:
    """Return (targets, rows, columns) bool: cells whose centre is in the target's feasible region.

    Rows run with y from the bounds' first corner. Raise InvalidInput unless cells exceed 0 m.
    """
    if not 0.0 < cell_m < math.inf:
        raise InvalidInput(f"cells of {cell_m} m were asked for; they must be larger than 0 m")
    x_m, y_m = _centres(field, cell_m)
    free = _free(field, x_m, y_m, agent_radius_m)
    across_m, up_m = np.meshgrid(x_m, y_m)
    edges_m = np.concatenate([np.empty((0, 2, 2)), *(edges for edges in _edges(field))])
    found = np.zeros((len(field.targets_m), *free.shape), dtype=bool)
    for mask, (tx, ty) in zip(found, field.targets_m, strict=True):
        distance_m = np.hypot(across_m - tx, up_m - ty)
        rows, columns = np.nonzero((distance_m > ring.inner_m) & (distance_m < ring.outer_m) & free)
        cells_m = np.column_stack([x_m[columns] - tx, y_m[rows] - ty])
        mask[rows, columns] = _in_sight(cells_m, edges_m - np.array([tx, ty]))
    return found


def raster_areas_m2(masks: NDArray[np.bool_], *, cell_m: float) -> tuple[float, float, float]:
    """Return the areas, m², of the union, of one target's region in the mean, and of their sum."""
    each = masks.sum(axis=(1, 2)) * cell_m**2
    return float(masks.any(axis=0).sum() * cell_m**2), float(each.mean()), float(each.sum())


def _centres(field: FieldMap, cell_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x0, y0, x1, y1 = field.bounds_m
    return np.arange(x0 + cell_m / 2.0, x1, cell_m), np.arange(y0 + cell_m / 2.0, y1, cell_m)


def _edges(field: FieldMap) -> list[NDArray[np.float64]]:
    """Return each obstacle's edges, (n, 2, 2): of its outline and of its holes."""
    found = []
    for obstacle in field.obstacles:
        rings = [np.asarray(ring.coords)[:, :2] for ring in (obstacle.exterior, *obstacle.interiors)]
        found.append(np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in rings]))
    return found


def _free(
    field: FieldMap, x_m: NDArray[np.float64], y_m: NDArray[np.float64], agent_radius_m: float
) -> NDArray[np.bool_]:
    """Return (rows, columns) bool: where the agent's disc is within the bounds and meets no obstacle."""
    x0, y0, x1, y1 = field.bounds_m
    inside_x = (x_m >= x0 + agent_radius_m) & (x_m <= x1 - agent_radius_m)
    inside_y = (y_m >= y0 + agent_radius_m) & (y_m <= y1 - agent_radius_m)
    free = np.logical_and.outer(inside_y, inside_x)
    for edges_m in _edges(field):
        low, high = edges_m.min(axis=(0, 1)) - agent_radius_m, edges_m.max(axis=(0, 1)) + agent_radius_m
        columns = slice(*np.searchsorted(x_m, [low[0], high[0]]))
        rows = slice(*np.searchsorted(y_m, [low[1], high[1]]))
        across_m, up_m = np.meshgrid(x_m[columns], y_m[rows])
        free[rows, columns] &= ~_met(across_m, up_m, edges_m, agent_radius_m)
    return free


def _met(
    x_m: NDArray[np.float64], y_m: NDArray[np.float64], edges_m: NDArray[np.float64], radius_m: float
) -> NDArray[np.bool_]:
    """Return where a disc about each point meets an obstacle: the point is inside, or an edge is near."""
    inside, near = np.zeros(x_m.shape, dtype=bool), np.zeros(x_m.shape, dtype=bool)
    for (ax, ay), (bx, by) in edges_m:
        ex, ey, px, py = bx - ax, by - ay, x_m - ax, y_m - ay
        if by != ay:
            inside ^= ((ay > y_m) != (by > y_m)) & (px < ex * py / ey)
        along = np.clip((px * ex + py * ey) / (ex * ex + ey * ey), 0.0, 1.0)
        near |= (px - along * ex) ** 2 + (py - along * ey) ** 2 < radius_m**2
    return inside | near


def _in_sight(cells_m: NDArray[np.float64], edges_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return for each cell whether the segment from the origin, the target, crosses no edge."""
    clear = np.ones(len(cells_m), dtype=bool)
    for start in range(0, len(cells_m), CHUNK):
        x, y = cells_m[start : start + CHUNK].T.copy()
        blocked = np.zeros(len(x), dtype=bool)
        for (ax, ay), (bx, by) in edges_m:
            turn = ax * by - ay * bx
            if turn < 0.0:
                ax, ay, bx, by, turn = bx, by, ax, ay, -turn
            # between the rays to both ends, and beyond the edge's line
            blocked |= (ax * y >= ay * x) & (bx * y <= by * x) & (x * (by - ay) - y * (bx - ax) > turn)
        clear[start : start + CHUNK] = ~blocked
    return clear
