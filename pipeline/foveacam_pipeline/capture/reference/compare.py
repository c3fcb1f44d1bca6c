"""Compares the short baseline's depth with the reference: bias, spread, and the expected curve.

An error of the disparity |dd| is one of depth |dZ| = Z^2 / (B f) |dd| (Sec. 4.1): a baseline four times as
long is four times as good.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from foveacam_pipeline.capture.reference.values import BaselineComparison, DepthBin, Floats, ReferenceSample

WRONG = 0.05
BINS = 8
LEAST_IN_BIN = 8


def compare(
    rows: Sequence[ReferenceSample], *, short_baseline_m: float, baseline_m: float, f_px: float
) -> BaselineComparison:
    """Return the comparison of samples that have both depths; `baseline_m`: the reference's."""
    table = np.column_stack(columns(rows, "short_m", "reference_m", "sigma_m", "own_sigma_m"))
    short, reference, sigma, _ = table.T
    relative = short / reference - 1.0
    good = np.abs(relative) < WRONG
    short_fb = short_baseline_m * f_px
    off_px = short_fb * (1.0 / short - 1.0 / reference)[good]
    bias_px = float(np.median(off_px)) if len(off_px) else 0.0
    disparity_px = rms(off_px - bias_px)
    long = baseline_m / short_baseline_m
    return BaselineComparison(
        samples=len(rows),
        wrong=float(np.mean(~good)),
        bias_rel=float(np.median(relative[good])) if good.any() else 0.0,
        rms_rel=rms(relative[good]),
        rms_m=rms((short - reference)[good]),
        disparity_bias_px=bias_px,
        disparity_rms_px=disparity_px,
        stated_sigma_rel=float(np.median((sigma / reference)[good])) if good.any() else 0.0,
        bins=tuple(
            _bin(at, table[good], long=long, per_depth=disparity_px / short_fb)
            for at in _edges(reference[good])
        ),
    )


def columns(rows: Sequence[ReferenceSample], *names: str) -> list[Floats]:
    """Return columns of the rows, (n,) each."""
    return [np.array([getattr(row, name) for row in rows], dtype=np.float64) for name in names]


def rms(values: Floats) -> float:
    """Return the root mean square; 0 without values."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def _edges(depth_m: Floats) -> list[tuple[float, float]]:
    """Return ranges of equal ratio over all depths, without those that have too few samples."""
    if not len(depth_m):
        return []
    low, high = float(depth_m.min()), float(depth_m.max()) * (1.0 + 1e-9)
    edges = np.geomspace(low, max(high, 1.01 * low), BINS + 1)
    pairs = [(a, b) for a, b in pairwise(edges.tolist())]
    return [(a, b) for a, b in pairs if int(((depth_m >= a) & (depth_m < b)).sum()) >= LEAST_IN_BIN]


def _bin(at: tuple[float, float], table: Floats, *, long: float, per_depth: float) -> DepthBin:
    """Return the comparison in a range of depths; rows (n, 4): short, reference, its error, its own error."""
    short, z, sigma, own = table[(table[:, 1] >= at[0]) & (table[:, 1] < at[1])].T
    expected_m = per_depth * float(np.median(z)) ** 2
    return DepthBin(
        from_m=at[0],
        to_m=at[1],
        depth_m=float(np.median(z)),
        samples=len(z),
        bias_m=float(np.median(short - z)),
        rms_m=rms(short - z),
        relative_rms=rms((short - z) / z),
        expected_short_m=expected_m,
        expected_reference_m=expected_m / long,
        reference_sigma_m=rms(sigma),
        reference_own_sigma_m=rms(own),
    )
