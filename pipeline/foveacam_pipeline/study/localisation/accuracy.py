"""Errors of localised trajectories: centroid alignment, RMS and its interval, recovery of the shape."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.study.localisation.rail import LOBE_DEPTH_M

Floats = NDArray[np.float64]
LEAST_CORRELATION = 0.9
"""A trajectory shows the infinity sign if its depths correlate at least by this with those of the slots."""
LARGEST_RESIDUAL_M = LOBE_DEPTH_M / 2.0
"""It shows the sign only if the RMS error of its depths, after alignment, is below half of a lobe's depth."""
LEAST_POSITIONS = 3
"""Fewer positions of a trial show no shape."""
REPEATS = 2000
COVERAGE = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A value with its confidence interval of 95 %."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryErrors:
    """Errors of one pair at one standoff, metres.

    `rms`: of the 3D position after centroid alignment; `depth_rms`: of its depth alone. `depth`: RMS of the
    depth without alignment. `drift_m`: (x, y, z) mean offset of the centroids. `noise_m`: standard deviation
    of the depth between trials at one slot. `correlation`: mean over trials, of the depths with those of the
    slots. `recovered`: share of the trials that show the infinity sign. `found`: share of localised targets.
    """

    rms: Interval
    depth_rms_m: float
    depth: Interval
    drift_m: tuple[float, float, float]
    noise_m: float
    correlation: float
    recovered: float
    found: float


def aligned(points_m: Floats, truth_m: Floats) -> Floats:
    """Return trajectories moved so that the centroids of their found positions are those of the slots.

    `points_m`: (trials, slots, 3), NaN where a target was not found. `truth_m`: (slots, 3).
    """
    return points_m - centroid_offsets_m(points_m, truth_m)[:, None, :]


def centroid_offsets_m(points_m: Floats, truth_m: Floats) -> Floats:
    """Return (trials, 3): centroid of a trial's found positions minus that of their slots; NaN for none."""
    errors = points_m - truth_m
    counts = np.isfinite(errors[..., 0]).sum(axis=1)
    totals = np.where(np.isfinite(errors), errors, 0.0).sum(axis=1)
    return np.where(counts[:, None] > 0, totals / np.maximum(counts, 1)[:, None], np.nan)


def trajectory_errors(
    points_m: Floats, truth_m: Floats, *, rng: np.random.Generator
) -> TrajectoryErrors | None:
    """Return the errors of trials (trials, slots, 3) against slots (slots, 3); None if nothing was found."""
    found = np.isfinite(points_m[..., 0])
    if not found.any():
        return None
    residual_m = aligned(points_m, truth_m) - truth_m
    squares = np.sum(residual_m**2, axis=2)
    drift_m = np.nanmean(centroid_offsets_m(points_m, truth_m), axis=0).tolist()
    correlations = [depth_correlation(trial, truth_m) for trial in points_m]
    return TrajectoryErrors(
        rms=rms_interval(squares, rng=rng),
        depth_rms_m=float(np.sqrt(np.nanmean(residual_m[..., 2] ** 2))),
        depth=rms_interval((points_m - truth_m)[..., 2] ** 2, rng=rng),
        drift_m=(drift_m[0], drift_m[1], drift_m[2]),
        noise_m=_noise_m(residual_m[..., 2]),
        correlation=float(np.mean(correlations)),
        recovered=float(np.mean([shows_infinity(trial, truth_m) for trial in points_m])),
        found=float(found.mean()),
    )


def rms_interval(squares: Floats, *, rng: np.random.Generator, repeats: int = REPEATS) -> Interval:
    """Return the root of the mean of squares (trials, slots), and its bootstrap interval; NaN is left out.

    Slots are drawn with replacement, and for each of them trials: errors of a slot that its trials share, as
    the calibration's, widen the interval as they should.
    """
    trials, slots = squares.shape
    slot = rng.integers(slots, size=(repeats, slots, 1))
    drawn = squares[rng.integers(trials, size=(repeats, slots, trials)), slot]
    known = np.isfinite(drawn)
    counts = known.sum(axis=(1, 2))
    means = np.where(known, drawn, 0.0).sum(axis=(1, 2))[counts > 0] / counts[counts > 0]
    tail = 50.0 * (1.0 - COVERAGE)
    low, high = np.sqrt(np.percentile(means, [tail, 100.0 - tail])).tolist()
    return Interval(value=float(np.sqrt(np.nanmean(squares))), low=low, high=high)


def depth_correlation(trial_m: Floats, truth_m: Floats) -> float:
    """Return the correlation of one trial's depths (slots, 3) with those of the slots; 0 where undefined."""
    found = np.isfinite(trial_m[:, 2])
    if found.sum() < LEAST_POSITIONS or np.ptp(trial_m[found, 2]) == 0.0:
        return 0.0
    return float(np.corrcoef(trial_m[found, 2], truth_m[found, 2])[0, 1])


def shows_infinity(trial_m: Floats, truth_m: Floats) -> bool:
    """Return whether a trial (slots, 3) recovers the infinity sign: see the limits of this module.

    A slot whose target was not found counts as an error of a whole lobe.
    """
    residual_m = (aligned(trial_m[None], truth_m)[0] - truth_m)[:, 2]
    residual_m = np.where(np.isfinite(residual_m), residual_m, LOBE_DEPTH_M)
    close = float(np.sqrt(np.mean(residual_m**2))) < LARGEST_RESIDUAL_M
    return close and depth_correlation(trial_m, truth_m) >= LEAST_CORRELATION


def _noise_m(residual_m: Floats) -> float:
    """Return the standard deviation (RMS over slots) between trials (trials, slots); NaN for one trial."""
    counts = np.isfinite(residual_m).sum(axis=0)
    repeated = residual_m[:, counts > 1]
    return float(np.sqrt(np.nanmean(np.nanvar(repeated, axis=0, ddof=1)))) if repeated.size else float("nan")
