"""What a sweep says in numbers and words: T in both readings beside the paper's, crossings (Sec. 4.2)."""

import math

from foveacam_pipeline.study.depth_metrics import DepthMetric
from foveacam_pipeline.study.findings import PaperComparison, Value
from foveacam_pipeline.study.patches import PatchChoice
from foveacam_pipeline.study.tradeoff_sweep import BudgetPoint, BudgetSweep, crossings

HEADLINE_SHARE = 0.25
"""T is told at this budget: half the native resolution each way. The paper does not tell its own."""
PAPER = {DepthMetric.ABSREL: 2.02, DepthMetric.RMSE: 7.41, DepthMetric.DELTA1: 3.28}  # Sec. 4.2
READINGS = {"mean": "mean", "sum": "total"}
"""Of T: its name in values, its field."""
ENDS = {PatchChoice.TRUTH: "", PatchChoice.ESTIMATE: "_from_estimate"}
WORDS = {PatchChoice.TRUTH: "patches by truth", PatchChoice.ESTIMATE: "patches by the estimate"}
NAMES = {DepthMetric.ABSREL: "AbsRel", DepthMetric.RMSE: "RMSE", DepthMetric.DELTA1: "δ₁"}


def values_of(found: BudgetSweep, *, prefix: str = "") -> dict[str, Value]:
    """Return the figures of a sweep for programs; a ratio without any loss, infinite, is None."""
    values: dict[str, Value] = {
        f"{prefix}headline_q": found.at(HEADLINE_SHARE, PatchChoice.TRUTH).share,
        f"{prefix}q": list(found.shares),
        f"{prefix}scenes": len(found.at(HEADLINE_SHARE, PatchChoice.TRUTH).outcomes),
        f"{prefix}pixel_imbalance_max": max(
            abs(point.sizes.imbalance) for point in found.points[PatchChoice.TRUTH]
        ),
    }
    for choice, points in found.points.items():
        end, headline = ENDS[choice], found.at(HEADLINE_SHARE, choice)
        for metric in DepthMetric:
            for name, field in READINGS.items():
                ratios = ratios_of(points, metric, field)
                values[f"{prefix}t_{metric}_{name}{end}"] = _plain(getattr(headline.ratio(metric), field))
                values[f"{prefix}t_{metric}_{name}_by_q{end}"] = [_plain(ratio) for ratio in ratios]
                values[f"{prefix}crossing_q_{metric}_{name}{end}"] = list(
                    crossings(found.shares, ratios, PAPER[metric])
                )
            values[f"{prefix}gain_{metric}_by_bin{end}"] = [_plain(gain) for gain in headline.gains(metric)]
        values[f"{prefix}coverage_by_bin{end}"] = [
            _plain(share) for share in headline.mean(lambda each: each.coverage)
        ]
    return values


def ratios_of(points: tuple[BudgetPoint, ...], metric: DepthMetric, field: str) -> list[float]:
    """Return T at each budget by one reading: "mean" or "total"."""
    return [float(getattr(point.ratio(metric), field)) for point in points]


def rows_of(found: BudgetSweep, *, source: str, seed: int) -> tuple[PaperComparison, ...]:
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
        quantity=f"T by {NAMES[metric]}, {WORDS[choice]}, {source}",
        paper=f"{PAPER[metric]}",
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
    said = []
    for name, field in READINGS.items():
        ratios = ratios_of(found.points[choice], metric, field)
        crossed = crossings(found.shares, ratios, PAPER[metric])
        largest = max(range(len(ratios)), key=lambda index: ratios[index])
        where = ", ".join(f"{share:.3f}" for share in crossed)
        most = f"largest {_number(ratios[largest])} at q = {found.shares[largest]:g}"
        least = f"smallest {_number(min(ratios))}"
        if crossed:
            said.append(f"{name}s at q = {where}")
        else:
            said.append(f"{name}s never ({most if max(ratios) < PAPER[metric] else least})")
    return PaperComparison(
        quantity=f"budget at which T by {NAMES[metric]} crosses the paper's, {WORDS[choice]}, {source}",
        paper=f"{PAPER[metric]}",
        ours="; ".join(said),
        note=f"q from {found.shares[0]:g} to {found.shares[-1]:g}, between budgets by interpolation",
    )


def _coverage_row(found: BudgetSweep, source: str) -> PaperComparison:
    shares = [
        float(found.at(HEADLINE_SHARE, choice).mean(lambda each: each.coverage)[-1]) for choice in PatchChoice
    ]
    sizes = found.at(HEADLINE_SHARE, PatchChoice.TRUTH).sizes
    return PaperComparison(
        quantity=f"share of the farthest tenth of the pixels that patches cover, {source}",
        paper="not told",
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
