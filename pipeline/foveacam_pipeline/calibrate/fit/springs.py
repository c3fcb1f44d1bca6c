"""A mirror hangs in springs that stiffen: u + k u^3 = v on each axis, drive v and deflection u as shares.

Saturation is most of what bends a mirror's law. With it inside, a polynomial of low order is left with the
cross-talk and the optics.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from foveacam_pipeline.geometry.polynomial import monomials

START_STIFFENING = 0.15
"""A tenth less reach at full drive than the slope at rest promises."""
_MAX_STIFFENING = 2.0
_STIFFENING_TOLERANCE = 1e-5


def spring_deflection(share: NDArray[np.float64], stiffening: tuple[float, float]) -> NDArray[np.float64]:
    """Return (n, 2) deflections u of springs with u + k u^3 = `share`: (n, 2), k >= 0 for each axis."""
    columns = []
    for drive, k in zip(share.T, stiffening, strict=True):
        if k < 1e-9:
            columns.append(drive)
            continue
        scale = math.sqrt(1.0 / (3.0 * k))  # the one real root of a cubic without turning points
        columns.append(2.0 * scale * np.sinh(np.arcsinh(drive / (2.0 * k * scale**3)) / 3.0))
    return np.column_stack(columns)


def fit_stiffening(
    share: NDArray[np.float64], angles_rad: NDArray[np.float64], *, order: int
) -> tuple[float, float]:
    """Return the k of both axes with which a polynomial of `order` has the least left to do.

    `share`: (n, 2) drive over the largest. `angles_rad`: (n, 2).
    """

    def squares(stiffening: NDArray[np.float64]) -> float:
        kx, ky = np.maximum(stiffening, 0.0).tolist()
        drive = spring_deflection(share, (kx, ky))
        basis = monomials(drive[:, 0], drive[:, 1], order)
        solution = np.linalg.solve(basis.T @ basis, basis.T @ angles_rad)  # the search bears its rounding
        return float(np.sum((angles_rad - basis @ solution) ** 2))

    start = np.array([START_STIFFENING, START_STIFFENING])
    scale = max(squares(start), 1e-300)

    def share_left(stiffening: NDArray[np.float64]) -> float:
        return squares(stiffening) / scale

    found = minimize(share_left, start, method="Nelder-Mead", tol=_STIFFENING_TOLERANCE)
    kx, ky = np.clip(found.x, 0.0, _MAX_STIFFENING).tolist()
    return kx, ky
