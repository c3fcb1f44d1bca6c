"""Check array arguments: float64 rows of a fixed width."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import InvalidInput


def as_rows(values: ArrayLike, *, columns: int, name: str) -> NDArray[np.float64]:
    """Return `values` as (n, `columns`) float64 or raise InvalidInput naming the argument and its shape."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise InvalidInput(
            f"{name}: shape (n, {columns}) is needed, {rows.shape} was given; pass one row for each point"
        )
    return rows


def as_finite_rows(values: ArrayLike, *, columns: int, name: str) -> NDArray[np.float64]:
    """Return `values` as (n, `columns`) float64 and refuse NaN and infinities."""
    rows = as_rows(values, columns=columns, name=name)
    bad = ~np.isfinite(rows).all(axis=1)
    if bad.any():
        index = int(np.argmax(bad))
        raise InvalidInput(f"{name}: row {index} is {rows[index].tolist()}; remove rows that are not finite")
    return rows
