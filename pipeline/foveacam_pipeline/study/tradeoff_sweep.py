"""Many scenes at many budgets (Sec. 4.2): mean gains by bin, the ratio T, where it crosses the paper's."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.progress_steps import ProgressSteps
from foveacam_pipeline.study.depth_metrics import DepthMetric, TradeoffRatio, gains, tradeoff, tradeoffs
from foveacam_pipeline.study.near_far_scenes import StereoScene
from foveacam_pipeline.study.patches import Floats, PatchChoice, PictureSize, PixelBudget, budget
from foveacam_pipeline.study.tradeoff import SceneOutcome, outcomes
from foveacam_pipeline.study.tradeoff_stereo import DisparityEstimator

PATCHES = 4
RESAMPLES = 400
INTERVAL_PERCENT = (5.0, 95.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetPoint:
    """All scenes at one budget `share` of the native pixels, patches by one choice."""

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
        """Return T's 90 % interval, both readings, over scenes drawn anew from these with replacement."""
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


def sweep(
    scenes: Iterable[StereoScene],
    *,
    shares: Sequence[float],
    estimator: DisparityEstimator,
    steps: ProgressSteps,
) -> BudgetSweep:
    """Return what the scenes, all of one size, give at each budget. Raise Cancelled, InvalidInput."""
    found: dict[tuple[PatchChoice, float], list[SceneOutcome]] = {}
    sizes: dict[float, PixelBudget] = {}
    for scene in scenes:
        native = PictureSize(width=scene.left.shape[1], height=scene.left.shape[0])
        for share in shares:
            sizes[share] = budget(native, share, patches=PATCHES)
            for choice, outcome in outcomes(scene, sizes[share], estimator).items():
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

    T / (1 + T), the gains' part of all that changes, is taken as straight over the budget's logarithm between
    two budgets: so T may be infinite.
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
