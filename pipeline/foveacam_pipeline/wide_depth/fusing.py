"""Fuse new measurements of cells with the depth that the context already has there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.wide_depth.surfaces import EDGE_RELATIVE
from foveacam_pipeline.wide_depth.values import AgeingModel, CellSurfaces, ContextMap, DepthSource

SAME_SIGMAS = 3.0
"""Two depths are of one surface when they differ by less than this many standard errors, or by less than half
the difference that separates two surfaces of a cell."""
TRUSTED_RATIO = 10.0
"""A measurement whose error is this many times that of the known depth does not replace it."""
DENSE = (DepthSource.DENSE_DEPTH, DepthSource.MOSAIC)
"""Sources that measure all surfaces of a cell: a surface that they do not measure is dropped."""


def fuse_surfaces(
    known: ContextMap, new: CellSurfaces, *, source: DepthSource, now_s: float, ageing: AgeingModel
) -> None:
    """Update `known` in place with the surfaces `new`, measured at `now_s`.

    A consistent depth is averaged by inverse variance; a contradicting one becomes the primary surface and
    the older one the second. A dense measurement replaces both.
    """
    order = np.argsort(new.samples, kind="stable")  # of two surfaces the larger comes last: the primary one
    first, second = _rounds(new.only(order))
    for index, part in enumerate((first, second)):
        if len(part):
            replaces = source in DENSE and index == 0
            _fuse(known, part, _Measurement(source=source, now_s=now_s, ageing=ageing, replaces=replaces))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measurement:
    """How and when a round of surfaces was measured; `replaces`: contradicted surfaces are dropped."""

    source: DepthSource
    now_s: float
    ageing: AgeingModel
    replaces: bool


def _rounds(surfaces: CellSurfaces) -> tuple[CellSurfaces, CellSurfaces]:
    """Split the surfaces into two rounds, each with at most one surface a cell."""
    _, first = np.unique(surfaces.cell, return_index=True)
    in_first = np.zeros(len(surfaces), dtype=np.bool_)
    in_first[first] = True
    return surfaces.only(in_first), surfaces.only(~in_first)


def _fuse(known: ContextMap, new: CellSurfaces, how: _Measurement) -> None:
    row, column = np.divmod(new.cell, known.inverse_z_per_m.shape[2])
    with_first, with_second = (_consistent(known, layer, row, column, new=new, how=how) for layer in (0, 1))
    only_second = with_second & ~with_first
    known.swap(row[only_second], column[only_second])
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
    _average(known, (row, column), selected=fits, new=new, how=how)
    _store(known, 0, (row, column), selected=unknown | (contradicts & ~weaker), new=new, how=how)
    _store(known, 1, (row, column), selected=weaker, new=new, how=how)


def _aged(
    known: ContextMap, layer: int, row: NDArray[np.int64], column: NDArray[np.int64], how: _Measurement
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
    how: _Measurement,
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
    how: _Measurement,
) -> NDArray[np.bool_]:
    return np.asarray(new.sigma_per_m > TRUSTED_RATIO * _aged(known, 0, row, column, how), dtype=np.bool_)


def _average(
    known: ContextMap,
    cells: tuple[NDArray[np.int64], NDArray[np.int64]],
    *,
    selected: NDArray[np.bool_],
    new: CellSurfaces,
    how: _Measurement,
) -> None:
    """Average the primary surface and the new one by inverse variance.

    Looks share the errors of the calibration. Therefore the standard error of the mean is the weighted mean
    of both standard errors, which is not too small whatever their correlation.
    """
    row, column = cells[0][selected], cells[1][selected]
    old_sigma, new_sigma = _aged(known, 0, row, column, how), new.sigma_per_m[selected]
    share = old_sigma**2 / (old_sigma**2 + new_sigma**2)
    at = (0, row, column)
    known.inverse_z_per_m[at] += share * (new.inverse_z_per_m[selected] - known.inverse_z_per_m[at])
    known.tangents[at] += share[:, None] * (new.tangents[selected] - known.tangents[at])
    known.sigma_per_m[at] = share * new_sigma + (1.0 - share) * old_sigma
    known.measured_s[at] = how.now_s
    finer = share >= 0.5
    known.source[0, row[finer], column[finer]] = how.source


def _store(
    known: ContextMap,
    layer: int,
    cells: tuple[NDArray[np.int64], NDArray[np.int64]],
    *,
    selected: NDArray[np.bool_],
    new: CellSurfaces,
    how: _Measurement,
) -> None:
    at = (layer, cells[0][selected], cells[1][selected])
    known.inverse_z_per_m[at] = new.inverse_z_per_m[selected]
    known.tangents[at] = new.tangents[selected]
    known.sigma_per_m[at] = new.sigma_per_m[selected]
    known.measured_s[at] = how.now_s
    known.source[at] = how.source
