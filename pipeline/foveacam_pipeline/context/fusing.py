"""What a new measurement of a cell does to what is known of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.context.surfaces import EDGE_RELATIVE
from foveacam_pipeline.context.values import AgeingModel, CellSurfaces, ContextMap, DepthSource

SAME_SIGMAS = 3.0
"""Two depths are of one surface when they differ by less than so many standard errors, or by half of what
parts two surfaces of a cell."""
TRUSTED_RATIO = 10.0
"""A measurement with an error so many times that of the known one does not take its place."""
DENSE = (DepthSource.DENSE_DEPTH, DepthSource.MOSAIC)
"""Sources that see all surfaces of a cell: what they do not see is not there."""


def fuse_surfaces(
    known: ContextMap, new: CellSurfaces, *, source: DepthSource, now_s: float, ageing: AgeingModel
) -> None:
    """Change `known` by what was measured now.

    A consistent depth is averaged by inverse variance; a contradicting one becomes the primary surface and
    the older one the second. A dense measurement replaces both.
    """
    order = np.argsort(new.samples, kind="stable")  # of two surfaces the larger comes last: the primary one
    ordered = _taken(new, order)
    first, second = _rounds(ordered)
    for index, part in enumerate((first, second)):
        if len(part):
            replaces = source in DENSE and index == 0
            _fuse(known, part, _Measuring(source=source, now_s=now_s, ageing=ageing, replaces=replaces))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measuring:
    """How one round of surfaces was measured; `replaces`: contradicting surfaces are dropped."""

    source: DepthSource
    now_s: float
    ageing: AgeingModel
    replaces: bool


def _taken(surfaces: CellSurfaces, order: NDArray[np.int64]) -> CellSurfaces:
    return CellSurfaces(
        cell=surfaces.cell[order],
        tangents=surfaces.tangents[order],
        inverse_z_per_m=surfaces.inverse_z_per_m[order],
        sigma_per_m=surfaces.sigma_per_m[order],
        samples=surfaces.samples[order],
    )


def _rounds(surfaces: CellSurfaces) -> tuple[CellSurfaces, CellSurfaces]:
    """Part the surfaces so that no cell is twice in a round."""
    _, first = np.unique(surfaces.cell, return_index=True)
    in_first = np.zeros(len(surfaces), dtype=np.bool_)
    in_first[first] = True
    return surfaces.only(in_first), surfaces.only(~in_first)


def _fuse(known: ContextMap, new: CellSurfaces, how: _Measuring) -> None:
    row, column = np.divmod(new.cell, known.inverse_z_per_m.shape[2])
    with_first, with_second = (_consistent(known, layer, row, column, new=new, how=how) for layer in (0, 1))
    second_is_it = with_second & ~with_first
    known.swap(row[second_is_it], column[second_is_it])
    fits = with_first | with_second
    unknown = ~np.isfinite(known.inverse_z_per_m[0, row, column])
    contradicts = ~(fits | unknown)
    weaker = contradicts & _weaker(known, row, column, new=new, how=how)
    if how.replaces:
        known.inverse_z_per_m[1, row, column] = np.nan
        weaker[:] = False
    else:
        pushed = contradicts & ~weaker
        known.swap(row[pushed], column[pushed])
    _average(known, (row, column), kept=fits, new=new, how=how)
    _put(known, 0, (row, column), kept=unknown | (contradicts & ~weaker), new=new, how=how)
    _put(known, 1, (row, column), kept=weaker, new=new, how=how)


def _aged(
    known: ContextMap, layer: int, row: NDArray[np.int64], column: NDArray[np.int64], how: _Measuring
) -> NDArray[np.float64]:
    return how.ageing.sigma_per_m(
        known.sigma_per_m[layer, row, column],
        inverse_z_per_m=known.inverse_z_per_m[layer, row, column],
        age_s=how.now_s - known.measured_s[layer, row, column],
    )


def _consistent(
    known: ContextMap,
    layer: int,
    row: NDArray[np.int64],
    column: NDArray[np.int64],
    *,
    new: CellSurfaces,
    how: _Measuring,
) -> NDArray[np.bool_]:
    q = known.inverse_z_per_m[layer, row, column]
    errors = SAME_SIGMAS * np.hypot(_aged(known, layer, row, column, how), new.sigma_per_m)
    limit = np.maximum(errors, 0.5 * EDGE_RELATIVE * q)
    return np.asarray(np.abs(new.inverse_z_per_m - q) <= limit, dtype=np.bool_)  # NaN: not consistent


def _weaker(
    known: ContextMap,
    row: NDArray[np.int64],
    column: NDArray[np.int64],
    *,
    new: CellSurfaces,
    how: _Measuring,
) -> NDArray[np.bool_]:
    return np.asarray(new.sigma_per_m > TRUSTED_RATIO * _aged(known, 0, row, column, how), dtype=np.bool_)


def _average(
    known: ContextMap,
    place: tuple[NDArray[np.int64], NDArray[np.int64]],
    *,
    kept: NDArray[np.bool_],
    new: CellSurfaces,
    how: _Measuring,
) -> None:
    """Average the primary surface and the new one by inverse variance.

    Looks share the calibration's errors: the mean's standard error is the weighted mean of theirs, which no
    correlation makes too small.
    """
    row, column = place[0][kept], place[1][kept]
    old_sigma, new_sigma = _aged(known, 0, row, column, how), new.sigma_per_m[kept]
    share = old_sigma**2 / (old_sigma**2 + new_sigma**2)
    at = (0, row, column)
    known.inverse_z_per_m[at] += share * (new.inverse_z_per_m[kept] - known.inverse_z_per_m[at])
    known.tangents[at] += share[:, None] * (new.tangents[kept] - known.tangents[at])
    known.sigma_per_m[at] = share * new_sigma + (1.0 - share) * old_sigma
    known.measured_s[at] = how.now_s
    finer = share >= 0.5
    known.source[0, row[finer], column[finer]] = how.source


def _put(
    known: ContextMap,
    layer: int,
    place: tuple[NDArray[np.int64], NDArray[np.int64]],
    *,
    kept: NDArray[np.bool_],
    new: CellSurfaces,
    how: _Measuring,
) -> None:
    at = (layer, place[0][kept], place[1][kept])
    known.inverse_z_per_m[at] = new.inverse_z_per_m[kept]
    known.tangents[at] = new.tangents[kept]
    known.sigma_per_m[at] = new.sigma_per_m[kept]
    known.measured_s[at] = how.now_s
    known.source[at] = how.source
