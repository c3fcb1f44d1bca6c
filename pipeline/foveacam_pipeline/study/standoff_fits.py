"""Curves over the ratio of D_max to D_min: means over maps, how sure they are, what law they follow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from foveacam_pipeline.study.standoff_runs import MapRun

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveBand:
    """A figure at each ratio, over maps: mean, standard deviation, half the 95 % interval of the mean."""

    mean: F64
    sigma: F64
    half_95: F64


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffCurves:
    """What the maps yield at the ratios, arrays (maps, ratios): areas (Fig. 9) and R_cov (Fig. 10)."""

    ratios: tuple[float, ...]
    multi_m2: F64
    single_m2: F64
    weighted_m2: F64
    multi: F64
    single_any: F64
    single_fixed: F64

    @property
    def maps(self) -> int:
        """How many maps there are."""
        return len(self.multi)


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaFit:
    """Least squares of a mean area over the ratio x = D_max / D_min.

    `quadratic`: coefficients of x², x and 1, m², and its `r2`. `law_m2`: k of k (x² - 1), the law of rings
    without obstacles, and `law_r2`. `line_r2`: of a straight line, the least that a curve has to beat.
    """

    quadratic: tuple[float, float, float]
    r2: float
    law_m2: float
    law_r2: float
    line_r2: float


def curves_of(ratios: Sequence[float], runs: Sequence[MapRun]) -> StandoffCurves:
    """Return the runs' figures as arrays."""
    areas = np.array([[(a.multi_m2, a.single_m2, a.weighted_m2) for a in run.areas] for run in runs])
    rates = np.array([[(c.multi, c.single_any, c.single_fixed) for c in run.coverage] for run in runs])
    return StandoffCurves(
        ratios=tuple(ratios),
        multi_m2=areas[..., 0],
        single_m2=areas[..., 1],
        weighted_m2=areas[..., 2],
        multi=rates[..., 0],
        single_any=rates[..., 1],
        single_fixed=rates[..., 2],
    )


def band(figures: F64) -> CurveBand:
    """Return mean, deviation and Student's 95 % interval of (maps, ratios) figures; of one map, none."""
    maps = len(figures)
    mean = figures.mean(axis=0)
    if maps < 2:
        return CurveBand(mean=mean, sigma=np.zeros_like(mean), half_95=np.full_like(mean, np.inf))
    sigma = figures.std(axis=0, ddof=1)
    half = float(student.ppf(0.975, maps - 1)) * sigma / np.sqrt(maps)
    return CurveBand(mean=mean, sigma=sigma, half_95=np.asarray(half))


def grows(ratios: Sequence[float], gap: F64) -> bool:
    """Tell whether a gap is above 0 at every ratio above 1 and larger at each than at the one before."""
    beyond = gap[np.asarray(ratios) > 1.0]
    return bool((beyond > 0.0).all() and (np.diff(beyond) > 0.0).all())


def fit_of(ratios: Sequence[float], area_m2: F64) -> AreaFit:
    """Return the fits of a curve of areas."""
    x = np.asarray(ratios)
    (a, b, c), r2 = _least_squares(np.vander(x, 3), area_m2)
    (law,), law_r2 = _least_squares((x**2 - 1.0)[:, None], area_m2)
    line_r2 = _least_squares(np.vander(x, 2), area_m2)[1]
    return AreaFit(quadratic=(a, b, c), r2=r2, law_m2=law, law_r2=law_r2, line_r2=line_r2)


def _least_squares(terms: F64, values: F64) -> tuple[list[float], float]:
    """Return coefficients, and the share of the variance about the mean that they explain."""
    found = np.linalg.lstsq(terms, values, rcond=None)[0]
    left = values - terms @ found
    about = values - values.mean()
    return [float(each) for each in found], 1.0 - float(left @ left) / float(about @ about)
