"""Fit the error model of a depth backend: `python -m foveacam_bench.depth.error_fit live|sgbm` prints it.

Data: the Motorcycle pair, half of the weight, and 36 rendered looks of both scenes, 1.5 to 30 m away, drawn
with another seed than the looks of the benches. The log-odds of an error above 1 px are a logistic regression
over all matched pixels; the logarithm of sigma is the 68.3 % quantile of the logarithm of the error over the
pixels that this regression accepts.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from foveacam_bench.depth.dense import SHARES, WRONG_PX, rectified_real
from foveacam_bench.depth.real_pairs import real_pairs
from foveacam_bench.depth.rendered_looks import true_looks
from foveacam_pipeline.stereo.errors import CueWeights, match_cues
from foveacam_pipeline.stereo.estimator import DepthBackend
from foveacam_pipeline.stereo.kernels import enlarge_cells
from foveacam_pipeline.stereo.live import LARGEST_BEND_PX, match_cells, refine_match
from foveacam_pipeline.stereo.match import find_and_refine
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, gradients_correlate
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair

LOOKS = 18
"""Looks at each scene."""
SEED = 77_11
NEAREST_M, FARTHEST_M = 1.5, 30.0
SAMPLES, REAL_SAMPLES = 4_000, 80_000
LEAST_ERROR_PX = 1e-3
SOFTNESS = 0.05
"""Width over which the kink of the pinball loss is smoothed, in the logarithm of the error."""

CUES = tuple(field.name for field in fields(CueWeights))
"""A constant and the cues, in their order."""

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitData:
    """Matched pixels: a 1 and the cues (n, 9), errors (n,) px, weights (n,), and which are `alike` (n,).

    `alike`: the gradients of both pictures correlate.
    """

    cues: F64
    error_px: F64
    weight: F64
    alike: NDArray[np.bool_]


def fit(backend: DepthBackend) -> tuple[CueWeights, CueWeights]:
    """Return `fit_cues` of the backend's matches of all pairs."""
    return fit_cues(_joined(list(_pairs(backend))))


def fit_cues(data: FitData) -> tuple[CueWeights, CueWeights]:
    """Return the weights of the logarithm of sigma and of the log-odds of an error above 1 px."""
    odds = _logistic(data.cues, np.abs(data.error_px) > WRONG_PX, data.weight)
    kept = data.alike & (data.cues @ odds <= np.log(DEFAULT.max_wrong / (1.0 - DEFAULT.max_wrong)))
    log_error = np.log(np.maximum(np.abs(data.error_px[kept]), LEAST_ERROR_PX))
    sigma = fit_quantile(data.cues[kept], log_error, data.weight[kept])
    return _weights(sigma), _weights(odds)


def _pairs(backend: DepthBackend) -> Iterator[FitData]:
    """Yield the samples of every pair; their weights sum to the pair's share of the fit."""
    rng = np.random.default_rng(SEED)
    real = next(pair for pair in real_pairs(None) if pair.name == "motorcycle")
    rectified, settings = rectified_real(real)
    found = _matched(backend, rectified, settings)
    yield _sampled(found, real.truth_px, rng, count=REAL_SAMPLES, share=0.5)
    for look in true_looks(LOOKS, seed=SEED, nearest_m=NEAREST_M, farthest_m=FARTHEST_M):
        found = _matched(backend, look.pair, DEFAULT)
        shared_px = np.nanmedian((found.residual_px - look.truth_px)[look.judged])  # the pose error
        yield _sampled(found, look.truth_px + shared_px, rng, count=SAMPLES, share=0.25 / LOOKS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchedPixels:
    """Disparities (h, w) px, NaN where unknown; cues and `alike` of every cell of 2 x 2 pixels."""

    residual_px: FloatImage
    cues: tuple[FloatImage, ...]
    alike: NDArray[np.bool_]


def _matched(backend: DepthBackend, pair: RectifiedPair, settings: MatchSettings) -> MatchedPixels:
    if backend == "sgbm":
        found, refinement = find_and_refine(pair, settings)
        residual = np.where(np.isfinite(found) & refinement.seen, refinement.residual_px, np.float32(np.nan))
        return _as_matched(residual, found, refinement)
    match = match_cells(pair, settings)
    refinement = refine_match(match)
    cells = np.where(refinement.seen, refinement.residual_px, np.float32(np.nan))
    height, width = pair.left.shape[:2]
    residual = np.empty(match.left.shape, dtype=np.float32)
    enlarge_cells(cells, np.float32(LARGEST_BEND_PX), 0, match.valid_left, residual)
    return _as_matched(residual[:height, :width], match.found_px, refinement)


def _as_matched(residual_px: FloatImage, found_px: FloatImage, refinement: Refinement) -> MatchedPixels:
    cues = match_cues(found_px, refinement)
    return MatchedPixels(residual_px=residual_px, cues=cues, alike=gradients_correlate(refinement))


def _sampled(
    found: MatchedPixels,
    truth_px: NDArray[np.floating],
    rng: np.random.Generator,
    *,
    count: int,
    share: float,
) -> FitData:
    """Return `count` random pixels of those with a disparity and a ground truth."""
    error_px = (found.residual_px - truth_px)[::2, ::2]
    rows, columns = np.nonzero(np.isfinite(error_px))
    chosen = rng.choice(len(rows), min(count, len(rows)), replace=False)
    here = rows[chosen], columns[chosen]
    return FitData(
        cues=np.column_stack([np.ones(len(chosen)), *(cue[here] for cue in found.cues)]).astype(np.float64),
        error_px=error_px[here].astype(np.float64),
        weight=np.full(len(chosen), share / len(chosen)),
        alike=found.alike[here],
    )


def _joined(parts: list[FitData]) -> FitData:
    return FitData(
        cues=np.concatenate([part.cues for part in parts]),
        error_px=np.concatenate([part.error_px for part in parts]),
        weight=np.concatenate([part.weight for part in parts]),
        alike=np.concatenate([part.alike for part in parts]),
    )


def _logistic(cues: F64, wrong: NDArray[np.bool_], weight: F64) -> F64:
    """Return the weights (9,) of the log-odds of `wrong`."""

    def loss(b: F64) -> tuple[float, F64]:
        odds = cues @ b
        slope = 1.0 / (1.0 + np.exp(-odds)) - wrong
        return float(weight @ (np.logaddexp(0.0, odds) - wrong * odds)), cues.T @ (weight * slope)

    return _minimum(loss, cues.shape[1])


def fit_quantile(cues: F64, log_error: F64, weight: F64) -> F64:
    """Return the weights (k,) of the 68.3 % quantile of `log_error`: the least pinball loss."""

    def loss(b: F64) -> tuple[float, F64]:
        rest = log_error - cues @ b
        below = -rest / SOFTNESS
        value = SHARES[1] * rest + SOFTNESS * np.logaddexp(0.0, below)
        slope = SHARES[1] - 1.0 / (1.0 + np.exp(-below))
        return float(weight @ value), -cues.T @ (weight * slope)

    return _minimum(loss, cues.shape[1])


def _minimum(loss: Callable[[F64], tuple[float, F64]], count: int) -> F64:
    found = minimize(
        loss, np.zeros(count), jac=True, method="L-BFGS-B", options={"maxiter": 2000, "ftol": 1e-11}
    )
    return np.asarray(found.x, dtype=np.float64)


def _weights(b: F64) -> CueWeights:
    return CueWeights(**{name: round(value, 3) for name, value in zip(CUES, b.tolist(), strict=True)})


if __name__ == "__main__":
    for title, weights in zip(
        ("log_sigma", "log_odds_wrong"), fit(cast(DepthBackend, sys.argv[1])), strict=True
    ):
        sys.stdout.write(f"{title}={weights}\n")
