"""The error model of dense matching: each pixel's sigma and the probability that its match is wrong.

Both are fitted, once, for each matcher: the logarithm of the 68.3 % quantile of the error, and the log-odds
of an error above 1 px, are linear in eight cues. Data: the Motorcycle pair (half the weight) and 36 rendered
looks of both simulated scenes, 1.5 to 30 m. Aloe, Tsukuba and 28 other rendered looks are for checks only.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.refine import FloatImage, Refinement, gradients_correlate
from foveacam_pipeline.stereo.search import MatchSettings

LARGEST_SPREAD_PX = 64.0
LARGEST_STEP_CUE_PX = 3.0
LEAST_STEP_PX, LEAST_SPREAD_PX = 0.1, 0.25
LARGEST_NOISE_SIGMA_PX, LEAST_NOISE_SIGMA_PX = 10.0, 0.01
LEAST_SIGMA_PX, LARGEST_SIGMA_PX = 0.02, 20.0
SPREAD_CELLS, WIDE_SPREAD_CELLS, HOLES_CELLS, WIDE_HOLES_CELLS = 3, 7, 5, 13
"""Sides of the windows of the neighbourhood cues, cells of 2 x 2 pixels."""
_FARTHEST = np.float32(1e6)


@dataclass(frozen=True, slots=True, kw_only=True)
class CueWeights:
    """Weights of the cues in a sum; `log` is the natural logarithm."""

    constant: float
    noise_sigma: float
    """Of log(error of the sub-pixel step from noise and texture, px)."""
    noise: float
    """Of log(standard deviation of the brightness difference, grey levels)."""
    step: float
    """Of log(0.1 px + size of the sub-pixel step that the images ask for)."""
    spread: float
    """Of log(0.25 px + spread of disparity in `SPREAD_CELLS`): slanted surfaces and edges."""
    wide_spread: float
    """Of log(0.25 px + spread of disparity in `WIDE_SPREAD_CELLS`)."""
    holes: float
    """Of the share in `HOLES_CELLS` that the matcher rejected: ambiguous, or unlike at right."""
    wide_holes: float
    """Of the share in `WIDE_HOLES_CELLS` that the matcher rejected."""
    likeness: float
    """Of the correlation of both windows' gradients in 6 x 6 pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorModel:
    """The fitted weights of the cues for one matcher."""

    log_sigma: CueWeights
    log_odds_wrong: CueWeights


SEMI_GLOBAL = ErrorModel(
    log_sigma=CueWeights(
        constant=-0.908,
        noise_sigma=0.257,
        noise=0.223,
        step=0.028,
        spread=0.646,
        wide_spread=0.017,
        holes=1.884,
        wide_holes=-0.185,
        likeness=0.050,
    ),
    log_odds_wrong=CueWeights(
        constant=-3.19,
        noise_sigma=0.039,
        noise=0.742,
        step=0.149,
        spread=0.780,
        wide_spread=0.272,
        holes=0.393,
        wide_holes=1.259,
        likeness=-0.665,
    ),
)
"""Error model of `match`."""
LIVE = ErrorModel(
    log_sigma=CueWeights(
        constant=-0.014,
        noise_sigma=0.362,
        noise=0.294,
        step=-0.158,
        spread=0.36,
        wide_spread=0.17,
        holes=0.937,
        wide_holes=0.444,
        likeness=-1.146,
    ),
    log_odds_wrong=CueWeights(
        constant=-1.206,
        noise_sigma=0.227,
        noise=0.614,
        step=0.01,
        spread=0.384,
        wide_spread=0.449,
        holes=-0.216,
        wide_holes=3.817,
        likeness=-2.455,
    ),
)
"""Error model of `live`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchErrors:
    """Errors of a disparity map, both (h, w); valid where the matcher gave a disparity."""

    sigma_px: FloatImage
    wrong_log_odds: FloatImage
    """Log-odds that the error exceeds 1 px."""


def match_errors(disparity_px: FloatImage, refinement: Refinement, model: ErrorModel) -> MatchErrors:
    """Return the errors of a disparity map (h, w), px, NaN where the matcher gave none."""
    cues = match_cues(disparity_px, refinement)
    sigma, log_odds = (_weighted(cues, weights) for weights in (model.log_sigma, model.log_odds_wrong))
    cv2.exp(sigma, dst=sigma)
    np.clip(sigma, np.float32(LEAST_SIGMA_PX), np.float32(LARGEST_SIGMA_PX), out=sigma)
    if sigma.shape != disparity_px.shape:
        size = disparity_px.shape[::-1]
        sigma, log_odds = (np.asarray(cv2.resize(of, size), dtype=np.float32) for of in (sigma, log_odds))
    return MatchErrors(sigma_px=sigma, wrong_log_odds=log_odds)


def accept_matches(
    found_px: FloatImage, refinement: Refinement, *, model: ErrorModel, settings: MatchSettings
) -> tuple[FloatImage, FloatImage, FloatImage]:
    """Return the refined disparities, their sigmas, px, and the chance of each to be wrong by over 1 px.

    All are NaN where the disparity is unknown or too doubtful.

    `found_px`: (h, w) disparities of a matcher, NaN where it gave none. Overwrites `refinement.residual_px`.
    """
    errors = match_errors(found_px, refinement, model)
    known = acceptable(found_px, refinement, errors, settings=settings)
    residual, sigma = refinement.residual_px, errors.sigma_px
    chance = _probability(errors.wrong_log_odds)
    for image in (residual, sigma, chance):
        image[~known] = np.nan
    return residual, sigma, chance


def _probability(log_odds: FloatImage) -> FloatImage:
    """Turn log-odds into probabilities, in place."""
    np.negative(log_odds, out=log_odds)
    cv2.exp(log_odds, dst=log_odds)
    log_odds += np.float32(1.0)
    return np.asarray(np.reciprocal(log_odds, out=log_odds), dtype=np.float32)


def acceptable(
    found_px: FloatImage, refinement: Refinement, errors: MatchErrors, *, settings: MatchSettings
) -> NDArray[np.bool_]:
    """Return (h, w) bool: where a disparity was found, is seen by both eyes, and is not too doubtful."""
    alike = gradients_correlate(refinement).view(np.uint8)
    alike = np.asarray(cv2.resize(alike, found_px.shape[::-1], interpolation=cv2.INTER_NEAREST), np.uint8)
    known = alike.view(np.bool_)
    known &= errors.wrong_log_odds <= np.float32(math.log(settings.max_wrong / (1.0 - settings.max_wrong)))
    known &= np.isfinite(found_px)
    known &= refinement.seen
    known &= errors.sigma_px <= np.float32(settings.max_sigma_px)
    return known


def match_cues(disparity_px: FloatImage, refinement: Refinement) -> tuple[FloatImage, ...]:
    """Return the cues in the order of `CueWeights` after the constant, each (n, m), of cells.

    `disparity_px`: (h, w) of pixels or (n, m) of cells.
    """
    low, high, missing = _cells(disparity_px, refinement.step_px.shape)
    noise_sigma = np.clip(
        refinement.noise_sigma_px, np.float32(LEAST_NOISE_SIGMA_PX), np.float32(LARGEST_NOISE_SIGMA_PX)
    )
    step = np.abs(refinement.step_px)
    np.minimum(step, np.float32(LARGEST_STEP_CUE_PX), out=step)
    step += np.float32(LEAST_STEP_PX)
    spread, wide_spread = _spreads(low, high, (SPREAD_CELLS, WIDE_SPREAD_CELLS))
    return (
        _log(noise_sigma),
        _log(refinement.noise.copy()),
        _log(step),
        _log(spread),
        _log(wide_spread),
        _share(missing, HOLES_CELLS),
        _share(missing, WIDE_HOLES_CELLS),
        refinement.likeness,
    )


def _weighted(cues: tuple[FloatImage, ...], weights: CueWeights) -> FloatImage:
    factors = (
        weights.noise_sigma,
        weights.noise,
        weights.step,
        weights.spread,
        weights.wide_spread,
        weights.holes,
        weights.wide_holes,
        weights.likeness,
    )
    total = np.full(cues[0].shape, weights.constant, dtype=np.float32)
    for cue, factor in zip(cues, factors, strict=True):
        cv2.scaleAdd(cue, factor, total, dst=total)
    return total


def _cells(disparity_px: FloatImage, size: tuple[int, ...]) -> tuple[FloatImage, FloatImage, FloatImage]:
    """Return the least and the largest known disparity, px, and the share of unknown ones, of every cell."""
    unknown = np.isnan(disparity_px)
    low = np.where(unknown, _FARTHEST, disparity_px)
    high = np.where(unknown, -_FARTHEST, disparity_px)
    missing = unknown.astype(np.float32)
    if size == disparity_px.shape:
        return low, high, missing
    low, high = _paired(np.minimum, low), _paired(np.maximum, high)
    return low, high, np.asarray(cv2.resize(missing, size[::-1], interpolation=cv2.INTER_AREA), np.float32)


def _paired(which: np.ufunc, image: FloatImage) -> FloatImage:
    """Return `which` of both rows, then of both columns of each cell; the last may have one alone."""
    rows = which(image[:-1:2], image[1::2])
    rows = np.concatenate([rows, image[-1:]]) if len(image) % 2 else rows
    columns = which(rows[:, :-1:2], rows[:, 1::2])
    return np.concatenate([columns, rows[:, -1:]], axis=1) if rows.shape[1] % 2 else columns


def _spreads(low: FloatImage, high: FloatImage, sides: tuple[int, int]) -> Iterator[FloatImage]:
    """Yield `LEAST_SPREAD_PX` and the largest minus the smallest known disparity in each window, px."""
    for side in sides:
        window = np.ones((side, side), dtype=np.uint8)
        spread = np.asarray(cv2.dilate(high, window), dtype=np.float32)
        spread -= np.asarray(cv2.erode(low, window), dtype=np.float32)
        np.clip(spread, np.float32(0.0), np.float32(LARGEST_SPREAD_PX), out=spread)
        spread += np.float32(LEAST_SPREAD_PX)
        yield spread


def _share(mask: FloatImage, side: int) -> FloatImage:
    return np.asarray(cv2.blur(mask, (side, side)), dtype=np.float32)


def _log(image: FloatImage) -> FloatImage:
    """Take the logarithm in place: allocating arrays costs more than the arithmetic."""
    cv2.log(image, dst=image)
    return image
