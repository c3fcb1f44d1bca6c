"""Many scenes at many budgets (Sec. 4.2): mean gains by bin, the ratio T, and where it crosses the paper's.

The values for programs and the comparison with the paper are made here too; drawings are in `figures`.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.study.report.findings import PaperComparison, Value
from foveacam_pipeline.study.tradeoff.depth_metrics import (
    DepthMetric,
    TradeoffRatio,
    gains,
    tradeoff,
    tradeoffs,
)
from foveacam_pipeline.study.tradeoff.outcomes import DisparityEstimator, SceneOutcome, scene_outcomes
from foveacam_pipeline.study.tradeoff.patches import Floats, PatchChoice, PictureSize, PixelBudget, budget
from foveacam_pipeline.study.tradeoff.streets import StereoScene
from foveacam_pipeline.workers.progress import ProgressSteps

PATCHES = 4
RESAMPLES = 400
INTERVAL_PERCENT = (5.0, 95.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetPoint:
    """All scenes at one budget, `share` of the native pixels, with one choice of patches."""

    share: float
    sizes: PixelBudget
    outcomes: tuple[SceneOutcome, ...]

    def mean(self, of: Callable[[SceneOutcome], Floats]) -> Floats:
        """Return (bins,) the mean over scenes, NaN in a bin that no scene fills."""
        return _mean(np.array([of(each) for each in self.outcomes]))

    def gains(self, metric: DepthMetric) -> Floats:
        """Return (bins,) the mean gain of FOV over MR."""
        return self.mean(lambda each: gains(each.fov, each.mr, metric))

    def gain_errors(self, metric: DepthMetric) -> Floats:
        """Return (bins,) the standard error of those means, over scenes; 0 for a single scene."""
        each = np.array([gains(found.fov, found.mr, metric) for found in self.outcomes])
        if len(each) < 2:
            return np.zeros(each.shape[1])
        off = np.array([row - self.gains(metric) for row in each])
        return np.sqrt(_mean(off**2) / (len(each) - 1))

    def ratio(self, metric: DepthMetric) -> TradeoffRatio:
        """Return T of the mean gains."""
        return tradeoff(self.gains(metric))

    def interval(self, metric: DepthMetric, *, seed: int) -> tuple[TradeoffRatio, TradeoffRatio]:
        """Return T's 90 % interval, both readings, over scenes resampled with replacement."""
        each = np.array([gains(found.fov, found.mr, metric) for found in self.outcomes])
        rng = np.random.default_rng([seed, len(each)])
        drawn = rng.integers(0, len(each), (RESAMPLES, len(each)))
        means, totals = (
            np.percentile(ratios, INTERVAL_PERCENT, method="nearest")
            for ratios in tradeoffs(_mean(each[drawn], axis=1))
        )
        low, high = (TradeoffRatio(mean=float(means[end]), total=float(totals[end])) for end in (0, 1))
        return low, high


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetSweep:
    """Every budget, by both choices of patches, shares increasing; `native`: the size of the scenes."""

    native: PictureSize
    points: dict[PatchChoice, tuple[BudgetPoint, ...]]

    @property
    def shares(self) -> tuple[float, ...]:
        """The budgets."""
        return tuple(point.share for point in self.points[PatchChoice.TRUTH])

    def at(self, share: float, choice: PatchChoice) -> BudgetPoint:
        """Return the point whose budget is nearest to `share`."""
        return min(self.points[choice], key=lambda point: abs(point.share - share))


def sweep_budgets(
    scenes: Iterable[StereoScene],
    *,
    shares: Sequence[float],
    estimator: DisparityEstimator,
    steps: ProgressSteps,
) -> BudgetSweep:
    """Return the outcomes of the scenes, all of one size, at each budget. Raise Cancelled, InvalidInput."""
    found: dict[tuple[PatchChoice, float], list[SceneOutcome]] = {}
    sizes: dict[float, PixelBudget] = {}
    for scene in scenes:
        native = PictureSize(width=scene.left.shape[1], height=scene.left.shape[0])
        for share in shares:
            sizes[share] = budget(native, share, patches=PATCHES)
            for choice, outcome in scene_outcomes(scene, sizes[share], estimator).items():
                found.setdefault((choice, share), []).append(outcome)
            steps.step(f"{scene.name}, {100.0 * share:.0f} % of the pixels")
    points = {
        choice: tuple(
            BudgetPoint(share=share, sizes=sizes[share], outcomes=tuple(found[choice, share]))
            for share in sorted(shares)
        )
        for choice in PatchChoice
    }
    return BudgetSweep(native=sizes[shares[0]].native, points=points)


def crossings(shares: Sequence[float], ratios: Sequence[float], target: float) -> tuple[float, ...]:
    """Return the budgets at which T crosses `target`, by interpolation; none where it never does.

    T / (1 + T), the share of gains in all changes, is interpolated linearly over the logarithm of the budget,
    so that T may be infinite.
    """
    parts = [1.0 if math.isinf(ratio) else ratio / (1.0 + ratio) for ratio in ratios]
    aim = target / (1.0 + target)
    found = []
    for index in range(1, len(shares)):
        before, after = parts[index - 1] - aim, parts[index] - aim
        if (before < 0.0) != (after < 0.0):
            along = before / (before - after)
            logs = np.log(shares[index - 1 : index + 1])
            found.append(float(np.exp(logs[0] + along * (logs[1] - logs[0]))))
    return tuple(found)


def _mean(rows: NDArray[np.float64], *, axis: int = 0) -> Floats:
    """Return the mean along an axis, NaN left out; NaN where there is nothing else."""
    known = np.isfinite(rows)
    count = known.sum(axis=axis)
    total = np.where(known, rows, 0.0).sum(axis=axis)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


HEADLINE_SHARE = 0.25
"""T is reported at this budget: half the native resolution each way. The paper does not state its own."""
PAPER_RATIOS = {DepthMetric.ABSREL: 2.02, DepthMetric.RMSE: 7.41, DepthMetric.DELTA1: 3.28}  # Sec. 4.2
READINGS = {"mean": "mean", "sum": "total"}
"""The readings of T: name in values, and field."""
CHOICE_SUFFIXES = {PatchChoice.TRUTH: "", PatchChoice.ESTIMATE: "_from_estimate"}
CHOICE_LABELS = {PatchChoice.TRUTH: "patches by truth", PatchChoice.ESTIMATE: "patches by the estimate"}
METRIC_LABELS = {DepthMetric.ABSREL: "AbsRel", DepthMetric.RMSE: "RMSE", DepthMetric.DELTA1: "δ₁"}


def sweep_values(found: BudgetSweep, *, prefix: str = "") -> dict[str, Value]:
    """Return the values of a sweep for programs; an infinite ratio (no loss) is None."""
    values: dict[str, Value] = {
        f"{prefix}headline_q": found.at(HEADLINE_SHARE, PatchChoice.TRUTH).share,
        f"{prefix}q": list(found.shares),
        f"{prefix}scenes": len(found.at(HEADLINE_SHARE, PatchChoice.TRUTH).outcomes),
        f"{prefix}pixel_imbalance_max": max(
            abs(point.sizes.imbalance) for point in found.points[PatchChoice.TRUTH]
        ),
    }
    for choice, points in found.points.items():
        end, headline = CHOICE_SUFFIXES[choice], found.at(HEADLINE_SHARE, choice)
        for metric in DepthMetric:
            for name, field in READINGS.items():
                ratios = ratios_of(points, metric, field)
                values[f"{prefix}t_{metric}_{name}{end}"] = _plain(getattr(headline.ratio(metric), field))
                values[f"{prefix}t_{metric}_{name}_by_q{end}"] = [_plain(ratio) for ratio in ratios]
                values[f"{prefix}crossing_q_{metric}_{name}{end}"] = list(
                    crossings(found.shares, ratios, PAPER_RATIOS[metric])
                )
            values[f"{prefix}gain_{metric}_by_bin{end}"] = [_plain(gain) for gain in headline.gains(metric)]
        values[f"{prefix}coverage_by_bin{end}"] = [
            _plain(share) for share in headline.mean(lambda each: each.coverage)
        ]
    return values


def ratios_of(points: tuple[BudgetPoint, ...], metric: DepthMetric, field: str) -> list[float]:
    """Return T at each budget by one reading: "mean" or "total"."""
    return [float(getattr(point.ratio(metric), field)) for point in points]


def sweep_rows(found: BudgetSweep, *, source: str, seed: int) -> tuple[PaperComparison, ...]:
    """Return the paper's ratios beside ours, with 90 % intervals over scenes, and where ours cross them."""
    rows = [
        _ratio_row(found, choice, metric, source=source, seed=seed)
        for metric in DepthMetric
        for choice in PatchChoice
    ]
    rows += [_crossing_row(found, choice, metric, source) for metric in DepthMetric for choice in PatchChoice]
    rows.append(_coverage_row(found, source))
    return tuple(rows)


def _ratio_row(
    found: BudgetSweep, choice: PatchChoice, metric: DepthMetric, *, source: str, seed: int
) -> PaperComparison:
    point = found.at(HEADLINE_SHARE, choice)
    ratio, (low, high) = point.ratio(metric), point.interval(metric, seed=seed)
    return PaperComparison(
        quantity=f"T by {METRIC_LABELS[metric]}, {CHOICE_LABELS[choice]}, {source}",
        paper=f"{PAPER_RATIOS[metric]}",
        ours=f"means {_spread(ratio.mean, low.mean, high.mean)}; "
        f"sums {_spread(ratio.total, low.total, high.total)}",
        note=f"at q = {point.share:g} of the native pixels; 90 % interval over {len(point.outcomes)} scenes; "
        f"gain of the farthest bin {_gain(point, metric)}",
    )


def _gain(point: BudgetPoint, metric: DepthMetric) -> str:
    gain = point.gains(metric)[-1]
    before = point.mean(lambda each: each.mr.of(metric))[-1]
    unit = " m" if metric is DepthMetric.RMSE else ""
    return f"{gain:+.4f}{unit} on MR's {before:.4f}{unit}"


def _crossing_row(
    found: BudgetSweep, choice: PatchChoice, metric: DepthMetric, source: str
) -> PaperComparison:
    crossed_at = []
    for name, field in READINGS.items():
        ratios = ratios_of(found.points[choice], metric, field)
        crossed = crossings(found.shares, ratios, PAPER_RATIOS[metric])
        largest = max(range(len(ratios)), key=lambda index: ratios[index])
        where = ", ".join(f"{share:.3f}" for share in crossed)
        most = f"largest {_number(ratios[largest])} at q = {found.shares[largest]:g}"
        least = f"smallest {_number(min(ratios))}"
        if crossed:
            crossed_at.append(f"{name}s at q = {where}")
        else:
            crossed_at.append(f"{name}s never ({most if max(ratios) < PAPER_RATIOS[metric] else least})")
    return PaperComparison(
        quantity=f"budget at which T by {METRIC_LABELS[metric]} crosses the paper's, "
        f"{CHOICE_LABELS[choice]}, {source}",
        paper=f"{PAPER_RATIOS[metric]}",
        ours="; ".join(crossed_at),
        note=f"q from {found.shares[0]:g} to {found.shares[-1]:g}, between budgets by interpolation",
    )


def _coverage_row(found: BudgetSweep, source: str) -> PaperComparison:
    shares = [
        float(found.at(HEADLINE_SHARE, choice).mean(lambda each: each.coverage)[-1]) for choice in PatchChoice
    ]
    sizes = found.at(HEADLINE_SHARE, PatchChoice.TRUTH).sizes
    return PaperComparison(
        quantity=f"share of the farthest tenth of the pixels that patches cover, {source}",
        paper="not stated",
        ours=f"{100.0 * shares[0]:.0f} % by truth, {100.0 * shares[1]:.0f} % by the estimate",
        note=f"{sizes.count} patches of {sizes.patch.width} x {sizes.patch.height} px, backdrop "
        f"{sizes.backdrop.width} x {sizes.backdrop.height}, medium {sizes.medium.width} x "
        f"{sizes.medium.height}: {sizes.fov_pixels} px against {sizes.medium.pixels}",
    )


def _spread(value: float, low: float, high: float) -> str:
    return f"{_number(value)} [{_number(low)}, {_number(high)}]"


def _number(value: float) -> str:
    return "infinite (no bin is degraded)" if math.isinf(value) else f"{value:.2f}"


def _plain(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
