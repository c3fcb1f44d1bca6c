"""Accuracy of a depth map by bins of true depth, and the ratio of far gains to near losses (Sec. 4.2).

The ratio T is defined in the paper's supplement, not in the paper; two readings of it are computed.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput

Floats: TypeAlias = NDArray[np.float64]
BINS = 10
DELTA1 = 1.25
"""delta_1 counts pixels whose depth is off by less than this factor, either way."""


class DepthMetric(StrEnum):
    """A metric of depth; only the last is better when it is higher."""

    ABSREL = "absrel"
    RMSE = "rmse"
    DELTA1 = "delta1"


@dataclass(frozen=True, slots=True, kw_only=True)
class BinScores:
    """Scores of one depth map, (bins,) each: AbsRel, RMSE in metres, the share within delta_1."""

    absrel: Floats
    rmse: Floats
    delta1: Floats

    def of(self, metric: DepthMetric) -> Floats:
        """Return the scores by one metric."""
        return {
            DepthMetric.ABSREL: self.absrel,
            DepthMetric.RMSE: self.rmse,
            DepthMetric.DELTA1: self.delta1,
        }[metric]


@dataclass(frozen=True, slots=True, kw_only=True)
class TradeoffRatio:
    """The near-far trade-off ratio T in both readings; infinite where no bin is degraded, 0 where none gains.

    `mean`: mean gain of the improved bins over mean loss of the degraded ones. `total`: sum over sum.
    """

    mean: float
    total: float


def depth_bins(truth_m: Floats, *, bins: int = BINS) -> NDArray[np.intp]:
    """Return (n,) the bin of each pixel: bins of equally many pixels, by increasing true depth (n,).

    Pixels of one depth stay in one bin, so that a flat wall may leave a bin empty.
    """
    if len(truth_m) < bins:
        raise InvalidInput(
            f"{len(truth_m)} pixels with true depth were found; {bins} bins need at least as many: "
            "give a scene with more truth"
        )
    inner = np.quantile(truth_m, np.arange(1, bins) / bins)
    return np.asarray(np.searchsorted(inner, truth_m, side="right"))


def bin_scores(depth_m: Floats, truth_m: Floats, bin_of: NDArray[np.intp], *, bins: int = BINS) -> BinScores:
    """Return the scores of estimated depths (n,) against true ones (n,), NaN in a bin without pixels."""
    relative = np.abs(depth_m - truth_m) / truth_m
    close = np.maximum(depth_m / truth_m, truth_m / depth_m) < DELTA1
    return BinScores(
        absrel=bin_means(relative, bin_of, bins=bins),
        rmse=np.sqrt(bin_means((depth_m - truth_m) ** 2, bin_of, bins=bins)),
        delta1=bin_means(close.astype(np.float64), bin_of, bins=bins),
    )


def bin_means(values: Floats, bin_of: NDArray[np.intp], *, bins: int = BINS) -> Floats:
    """Return the mean (bins,) of values (n,) in each bin, NaN where there is none."""
    counts = np.bincount(bin_of, minlength=bins)
    sums = np.bincount(bin_of, weights=values, minlength=bins)
    return np.asarray(np.divide(sums, counts, out=np.full(bins, np.nan), where=counts > 0))


def gains(fov: BinScores, mr: BinScores, metric: DepthMetric) -> Floats:
    """Return (bins,) FOV - MR, flipped where lower is better: above 0 is an improvement (Sec. 4.2)."""
    difference = fov.of(metric) - mr.of(metric)
    return difference if metric is DepthMetric.DELTA1 else -difference


def tradeoff(gain: Floats) -> TradeoffRatio:
    """Return T of the gains (bins,) of one metric; bins that are NaN or unchanged count for neither side."""
    mean, total = tradeoffs(gain[None, :])
    return TradeoffRatio(mean=float(mean[0]), total=float(total[0]))


def tradeoffs(gain: Floats) -> tuple[Floats, Floats]:
    """Return T of many rows of gains (n, bins): by means (n,), and by sums (n,)."""
    up, down = np.where(gain > 0.0, gain, 0.0).sum(axis=1), np.where(gain < 0.0, -gain, 0.0).sum(axis=1)
    improved, degraded = (gain > 0.0).sum(axis=1), (gain < 0.0).sum(axis=1)
    lossless = np.where(improved > 0, math.inf, 0.0)
    total = np.divide(up, down, out=lossless.copy(), where=degraded > 0)
    fewer = np.divide(degraded, improved, out=np.ones(len(gain)), where=improved > 0)
    return np.multiply(total, fewer, out=lossless, where=degraded > 0), total
