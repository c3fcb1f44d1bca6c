"""The error of a matched place, from what still differs between the two windows once they are laid together.

Differences are summed over blocks that are wider than the noise is correlated; the spread of those sums, not
an assumed noise, gives the error. It holds for camera noise and for structure alike: a window over an edge,
where parts pull to either side, states the error that this makes.
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
"""The optics' blur ties neighbouring pixels together (sigma 1.4 px): fewer samples than pixels, squared."""


def place_covariance(
    reference: Image, moved: Image, lens: WindowWeights, prior: NDArray[np.float64], *, slopes: int
) -> NDArray[np.float64]:
    """Return the (2, 2) covariance of the place, px²; infinite along what the windows do not tell.

    `reference`, `moved`: (n, n) normalised windows. `prior`: (2 + slopes,) variance of one equation over the
    variance of what is known beforehand.
    """
    one, two = lens.slopes(reference, slopes), lens.slopes(moved, slopes)
    weights = lens.weights.ravel()
    weighted = one * weights
    shared = (weighted @ two.T).astype(np.float64)  # what noise adds to the slopes of either cancels
    values, ways = np.linalg.eigh((shared + shared.T) / 2.0)
    information = (ways * np.maximum(values, 0.0)) @ ways.T + np.diag(prior)
    difference = (reference - moved).ravel()
    pulls = _pulls(weighted * difference, lens)
    misfit = float(np.dot(weights, difference * difference))
    spread = pulls @ pulls.T + np.diag(prior * equation_variance(misfit, lens.samples))
    return _inverted(information, spread)


def equation_variance(misfit: float, samples: float) -> float:
    """Return the variance of one equation, were the noise of neighbouring pixels independent."""
    return max(misfit, 0.0) / (2.0 * samples) * CORRELATION**2


def _pulls(columns: Image, lens: WindowWeights) -> NDArray[np.float64]:
    """Return (k, blocks): how hard each block of pixels pulls at each unknown.

    As the unknowns were fitted to them, the blocks pull less than they would without: this is made up for.
    """
    sigma_px = math.sqrt(lens.samples / (2.0 * math.pi))
    block = max(LEAST_BLOCK_PX, round(BLOCK_SHARE * sigma_px))
    sums = _blocks(columns.reshape(len(columns), *lens.weights.shape), block)
    shares = _blocks(lens.weights[None], block)
    count = 1.0 / float(np.sum(shares * shares))
    return sums * math.sqrt(count / max(count - len(columns), 1.0))


def _blocks(columns: Image, block: int) -> NDArray[np.float64]:
    """Return the sums (k, blocks) of each block of columns (k, n, n)."""
    starts = np.arange(0, columns.shape[1], block)
    sums = np.add.reduceat(np.add.reduceat(columns, starts, axis=1), starts, axis=2)
    return np.asarray(sums.reshape(len(columns), -1), dtype=np.float64)


def _inverted(information: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what `spread` of the pulls makes of the place, infinite where nothing is known of it."""
    inverse = np.linalg.pinv(information, hermitian=True, rcond=LEAST_INFORMATION)
    covariance = (inverse @ spread @ inverse)[:2, :2]
    for k in (0, 1):
        if not _known(information, k):
            covariance[k, :] = covariance[:, k] = 0.0
            covariance[k, k] = math.inf
    return covariance


def _known(information: NDArray[np.float64], index: int) -> bool:
    """Return whether one unknown is known at all while the others are unknown too."""
    others = [k for k in range(len(information)) if k != index]
    rest, mixed = information[np.ix_(others, others)], information[index, others]
    known = information[index, index] - mixed @ np.linalg.lstsq(rest, mixed, rcond=None)[0]
    return bool(known > LEAST_INFORMATION)
