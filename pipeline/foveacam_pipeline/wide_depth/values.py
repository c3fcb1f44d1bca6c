"""Value types of the wide context: its map, one measurement of its cells, and its ageing."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

SURFACES = 2
"""Largest number of surfaces of a cell: at an edge, the one measured last and the other."""


class DepthSource(IntEnum):
    """How a depth was measured; files hold the number."""

    FIXATION = 1
    DENSE_DEPTH = 2
    MOSAIC = 3
    WIDE_MATCH = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class AgeingModel:
    """How the standard error of 1/Z grows with age.

    `drift_per_m_per_hour`: change of the mirrors' pointing, as inverse depth: 0.01 degree an hour over the
    baseline of 0.2 m. `relative_per_hour`: undetected movement along the line of sight, relative to 1/Z.
    """

    drift_per_m_per_hour: float = math.radians(0.01) / 0.2
    relative_per_hour: float = 0.01

    def sigma_per_m(
        self, sigma_per_m: NDArray[np.float64], *, inverse_z_per_m: NDArray[np.float64], age_s: object
    ) -> NDArray[np.float64]:
        """Return the standard error of 1/Z after `age_s` seconds: a number or an array."""
        hours = np.maximum(np.asarray(age_s, dtype=np.float64), 0.0) / 3600.0
        grown = np.hypot(self.drift_per_m_per_hour, self.relative_per_hour * inverse_z_per_m) * hours
        return np.asarray(np.hypot(sigma_per_m, grown), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellSurfaces:
    """Depth of grid cells: one measurement of one surface each.

    `cell`: (n,) int64 flat index, row * columns + column. `tangents`: (n, 2) float64, X/Z and Y/Z of the
    point that represents the cell. `inverse_z_per_m`, `sigma_per_m`: (n,) float64. `samples`: (n,) int64,
    measured points of the surface in the cell.
    """

    cell: NDArray[np.int64]
    tangents: NDArray[np.float64]
    inverse_z_per_m: NDArray[np.float64]
    sigma_per_m: NDArray[np.float64]
    samples: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.cell)

    def only(self, selected: NDArray[np.bool_] | NDArray[np.int64]) -> "CellSurfaces":
        """Return some of the surfaces, in the order of their indices or by a mask (n,)."""
        return CellSurfaces(
            cell=self.cell[selected],
            tangents=self.tangents[selected],
            inverse_z_per_m=self.inverse_z_per_m[selected],
            sigma_per_m=self.sigma_per_m[selected],
            samples=self.samples[selected],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContextMap:
    """The state of the context: (2, rows, columns) arrays, one layer a surface, the primary one first.

    `inverse_z_per_m` is NaN where nothing is known. `sigma_per_m` is as measured, without ageing.
    `measured_s`: seconds since 1970. `source`: uint8 `DepthSource` or 0. `tangents`: (2, rows, columns, 2).
    """

    cell_px: int
    inverse_z_per_m: NDArray[np.float64]
    sigma_per_m: NDArray[np.float64]
    measured_s: NDArray[np.float64]
    source: NDArray[np.uint8]
    tangents: NDArray[np.float64]

    @classmethod
    def empty(cls, *, rows: int, columns: int, cell_px: int) -> "ContextMap":
        """Return a map without any depth."""
        shape = (SURFACES, rows, columns)
        return cls(
            cell_px=cell_px,
            inverse_z_per_m=np.full(shape, np.nan),
            sigma_per_m=np.full(shape, np.nan),
            measured_s=np.full(shape, np.nan),
            source=np.zeros(shape, dtype=np.uint8),
            tangents=np.full((*shape, 2), np.nan),
        )

    def copy(self) -> "ContextMap":
        """Return a deep copy."""
        return ContextMap(
            cell_px=self.cell_px,
            inverse_z_per_m=self.inverse_z_per_m.copy(),
            sigma_per_m=self.sigma_per_m.copy(),
            measured_s=self.measured_s.copy(),
            source=self.source.copy(),
            tangents=self.tangents.copy(),
        )

    @property
    def known(self) -> NDArray[np.bool_]:
        """(2, rows, columns) bool: which surfaces have a depth."""
        return np.isfinite(self.inverse_z_per_m)

    def forget(self, cells: NDArray[np.bool_]) -> None:
        """Drop all surfaces of the cells marked in (rows, columns) bool."""
        self.inverse_z_per_m[:, cells] = np.nan
        self.sigma_per_m[:, cells] = np.nan
        self.measured_s[:, cells] = np.nan
        self.source[:, cells] = 0
        self.tangents[:, cells] = np.nan

    def swap(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> None:
        """Exchange the primary and the second surface of the given cells, which must be distinct."""
        for layers in (self.inverse_z_per_m, self.sigma_per_m, self.measured_s, self.source, self.tangents):
            layers[:, rows, columns] = layers[::-1, rows, columns]
