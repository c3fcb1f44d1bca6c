"""The covariance of a matched position, from the remaining differences of the two aligned windows.

The differences are summed over blocks larger than the correlation length of the noise; the error follows
from the scatter of these sums instead of an assumed noise level. It therefore includes structure: over an
edge, whose two sides move differently, it states the error that this causes.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.windows import Image, WindowWeights

LEAST_BLOCK_PX = 6
"""Blurred noise is correlated over about 2 px."""
BLOCK_SHARE = 0.25
"""Side of a block over the standard deviation of the weights."""
LEAST_INFORMATION = 1e-9
CORRELATION = 3.0
"""Pixels per independent sample along one side: the optical blur (sigma 1.4 px) correlates neighbours."""


def position_covariance(
    reference: Image, moved: Image, weighting: WindowWeights, prior: NDArray[np.float64], *, slopes: int
) -> NDArray[np.float64]:
    """Return the (2, 2) covariance of the position, px²; infinite along directions that are not determined.

    `reference`, `moved`: (n, n) normalised windows. `prior`: (2 + slopes,) variance of one equation over the
    variance of the prior.
    """
    one, two = weighting.slopes(reference, slopes), weighting.slopes(moved, slopes)
    weights = weighting.weights.ravel()
    weighted = one * weights
    shared = (weighted @ two.T).astype(np.float64)  # the noise of both gradients is independent
    values, ways = np.linalg.eigh((shared + shared.T) / 2.0)
    information = (ways * np.maximum(values, 0.0)) @ ways.T + np.diag(prior)
    difference = (reference - moved).ravel()
    sums = _block_sums(weighted * difference, weighting)
    misfit = float(np.dot(weights, difference * difference))
    spread = sums @ sums.T + np.diag(prior * equation_variance(misfit, weighting.samples))
    return _inverted(information, spread)


def equation_variance(misfit: float, samples: float) -> float:
    """Return the variance of one equation from the weighted mean squared difference."""
    return max(misfit, 0.0) / (2.0 * samples) * CORRELATION**2


def _block_sums(columns: Image, weighting: WindowWeights) -> NDArray[np.float64]:
    """Return (k, blocks): the contribution of each block of pixels to the right-hand side of each unknown.

    The contributions are scaled up because the unknowns were fitted to the same pixels.
    """
    sigma_px = math.sqrt(weighting.samples / (2.0 * math.pi))
    block = max(LEAST_BLOCK_PX, round(BLOCK_SHARE * sigma_px))
    sums = _blocks(columns.reshape(len(columns), *weighting.weights.shape), block)
    shares = _blocks(weighting.weights[None], block)
    count = 1.0 / float(np.sum(shares * shares))
    return sums * math.sqrt(count / max(count - len(columns), 1.0))


def _blocks(columns: Image, block: int) -> NDArray[np.float64]:
    """Return the sums (k, blocks) of each block of columns (k, n, n)."""
    starts = np.arange(0, columns.shape[1], block)
    sums = np.add.reduceat(np.add.reduceat(columns, starts, axis=1), starts, axis=2)
    return np.asarray(sums.reshape(len(columns), -1), dtype=np.float64)


def _inverted(information: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of the position for the covariance `spread` of the right-hand side."""
    inverse = np.linalg.pinv(information, hermitian=True, rcond=LEAST_INFORMATION)
    covariance = (inverse @ spread @ inverse)[:2, :2]
    for k in (0, 1):
        if not _determined(information, k):
            covariance[k, :] = covariance[:, k] = 0.0
            covariance[k, k] = math.inf
    return covariance


def _determined(information: NDArray[np.float64], index: int) -> bool:
    """Return whether one unknown is determined while the others are free."""
    others = [k for k in range(len(information)) if k != index]
    rest, mixed = information[np.ix_(others, others)], information[index, others]
    known = information[index, index] - mixed @ np.linalg.lstsq(rest, mixed, rcond=None)[0]
    return bool(known > LEAST_INFORMATION)
