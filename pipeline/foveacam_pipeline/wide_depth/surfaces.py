"""Reduce many measured points to one or two surfaces in each cell of the grid."""

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.wide_depth.values import CellSurfaces

EDGE_RELATIVE = 0.02
"""Neighbouring points of a cell whose 1/Z differs by this share lie on different surfaces. A plane seen under
80 degrees changes by 1 % over a cell of 8 wide px (0.1 degrees), and its points are spread over the cell."""
EDGE_SIGMAS = 4.0
LEAST_SHARE = 0.1
"""A smaller share of the cell's points counts as mismatches, not as a surface."""


def cell_surfaces(samples: DepthSamples, cell: NDArray[np.int64]) -> CellSurfaces:
    """Return the surfaces of each cell: `cell` (n,) is the flat index of each sample's cell.

    The points of a cell are split at the largest gap of their 1/Z if the gap is an edge. Each surface is
    represented by its median point and its median standard error, since the points of one look share their
    errors.
    """
    order = np.lexsort((samples.inverse_z_per_m, cell))
    cells, q, sigma = cell[order], samples.inverse_z_per_m[order], samples.sigma_per_m[order]
    surface = _surface_numbers(cells, q, sigma)
    starts, ends = _runs(surface)
    counts = ends - starts
    total = np.bincount(cells, minlength=1)[cells[starts]] if len(cells) else np.empty(0, dtype=np.int64)
    middle = order[(starts + ends - 1) // 2]
    found = CellSurfaces(
        cell=cells[starts],
        tangents=samples.tangents[middle],
        inverse_z_per_m=samples.inverse_z_per_m[middle],
        sigma_per_m=_medians(surface, sigma, starts=starts, ends=ends),
        samples=counts,
    )
    return found.only(counts >= LEAST_SHARE * total)


def _surface_numbers(
    cells: NDArray[np.int64], q: NDArray[np.float64], sigma: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Return (n,) the ascending surface number of each point; points are sorted by cell, then by 1/Z."""
    if len(cells) == 0:
        return np.empty(0, dtype=np.int64)
    gap = np.diff(q, prepend=q[0])
    limit = np.maximum(EDGE_RELATIVE * np.abs(q), EDGE_SIGMAS * np.hypot(sigma, np.r_[sigma[0], sigma[:-1]]))
    new_cell = np.r_[True, np.diff(cells) > 0]
    gap[new_cell] = 0.0
    starts = np.flatnonzero(new_cell)
    largest = np.maximum.reduceat(gap, starts)[np.cumsum(new_cell) - 1]
    cut = (gap > limit) & (gap == largest)
    return np.cumsum(new_cell | cut).astype(np.int64)


def _runs(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where each run of equal numbers begins and ends."""
    if len(numbers) == 0:
        empty = np.empty(0, dtype=np.int64)
        return empty, empty
    starts = np.flatnonzero(np.r_[True, np.diff(numbers) > 0]).astype(np.int64)
    return starts, np.r_[starts[1:], len(numbers)].astype(np.int64)


def _medians(
    numbers: NDArray[np.int64],
    values: NDArray[np.float64],
    *,
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the lower median of `values` in each run of equal `numbers`."""
    order = np.lexsort((values, numbers))
    middle: NDArray[np.float64] = values[order[(starts + ends - 1) // 2]]
    return middle
