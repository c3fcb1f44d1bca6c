"""Curves over the ratio of D_max to D_min (Figs. 9, 10): means over maps, intervals, fits and drawings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import stdtrit

from foveacam_pipeline.study.visibility.sweep import MapRun

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveBand:
    """A figure at each ratio, over maps: mean, standard deviation, half the 95 % interval of the mean."""

    mean: F64
    sigma: F64
    half_95: F64


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffCurves:
    """Results of the maps at the ratios, arrays (maps, ratios): areas (Fig. 9) and R_cov (Fig. 10)."""

    ratios: tuple[float, ...]
    multi_m2: F64
    single_m2: F64
    weighted_m2: F64
    multi: F64
    single_any: F64
    single_fixed: F64

    @property
    def maps(self) -> int:
        """The number of maps."""
        return len(self.multi)


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaFit:
    """Least squares of a mean area over the ratio x = D_max / D_min.

    `quadratic`: coefficients of x², x and 1, m², and its `r2`. `law_m2`: k of k (x² - 1), the law of rings
    without obstacles, and `law_r2`. `line_r2`: of a straight line, for comparison.
    """

    quadratic: tuple[float, float, float]
    r2: float
    law_m2: float
    law_r2: float
    line_r2: float


def curves_from_runs(ratios: Sequence[float], runs: Sequence[MapRun]) -> StandoffCurves:
    """Return the results of the runs as arrays."""
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


def curve_band(figures: F64) -> CurveBand:
    """Return mean, deviation and Student's 95 % interval of (maps, ratios) values; infinite for one map."""
    maps = len(figures)
    mean = figures.mean(axis=0)
    if maps < 2:
        return CurveBand(mean=mean, sigma=np.zeros_like(mean), half_95=np.full_like(mean, np.inf))
    sigma = figures.std(axis=0, ddof=1)
    half = float(stdtrit(maps - 1, 0.975)) * sigma / np.sqrt(maps)
    return CurveBand(mean=mean, sigma=sigma, half_95=np.asarray(half))


def grows_at_every_step(ratios: Sequence[float], gap: F64) -> bool:
    """Return whether a gap is above 0 at every ratio above 1 and larger at each than at the one before."""
    beyond = gap[np.asarray(ratios) > 1.0]
    return bool((beyond > 0.0).all() and (np.diff(beyond) > 0.0).all())


def fit_area(ratios: Sequence[float], area_m2: F64) -> AreaFit:
    """Return the fits of a curve of areas."""
    x = np.asarray(ratios)
    (a, b, c), r2 = _least_squares(np.vander(x, 3), area_m2)
    (law,), law_r2 = _least_squares((x**2 - 1.0)[:, None], area_m2)
    line_r2 = _least_squares(np.vander(x, 2), area_m2)[1]
    return AreaFit(quadratic=(a, b, c), r2=r2, law_m2=law, law_r2=law_r2, line_r2=line_r2)


def _least_squares(terms: F64, values: F64) -> tuple[list[float], float]:
    """Return the coefficients, and the share of the variance about the mean that they explain."""
    found = np.linalg.lstsq(terms, values, rcond=None)[0]
    left = values - terms @ found
    about = values - values.mean()
    return [float(each) for each in found], 1.0 - float(left @ left) / float(about @ about)


MULTI, SINGLE, FIXED, OTHER = "#0072B2", "#D55E00", "#E69F00", "0.45"
RATIO = "detection-range ratio x = Dₘₐₓ / Dₘᵢₙ"


def area_figure(curves: StandoffCurves, tight: StandoffCurves, fits: tuple[AreaFit, AreaFit]) -> Figure:
    """Draw Fig. 9: mean areas over the ratio, their quadratic fits, and the gap between them hatched."""
    figure = Figure(figsize=(8.0, 5.4), layout="constrained")
    axes = figure.subplots()
    x = np.linspace(curves.ratios[0], curves.ratios[-1], 200)
    upper, lower = (np.polyval(fit.quadratic, x) for fit in fits)
    axes.fill_between(
        x,
        upper,
        lower,
        facecolor="none",
        edgecolor="0.75",
        hatch="///",
        linewidth=0.0,
        label="gap: multi over single",
    )
    for colour, name, means, many, fit, line in (
        (MULTI, "multi-fovea", curves.multi_m2, tight.multi_m2, fits[0], upper),
        (SINGLE, "single-fovea", curves.single_m2, tight.single_m2, fits[1], lower),
    ):
        axes.plot(x, line, color=colour, label=_fit_label(fit))
        axes.plot(
            curves.ratios, means.mean(axis=0), "o", color=colour, label=f"{name}, mean of {curves.maps} maps"
        )
        _interval(axes, tight, many, colour)
    axes.plot(
        curves.ratios, curves.weighted_m2.mean(axis=0), ":", color=OTHER, label="weighted by targets in sight"
    )
    axes.fill_between(
        [], [], [], color="0.5", alpha=0.3, label=f"95 % interval of the mean of {tight.maps} maps"
    )
    axes.set(xlabel=RATIO, ylabel="mean feasible area, m²")
    axes.set_title("multi: union over targets; single: mean over targets of its own region", fontsize=10)
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=9, loc="upper left")
    return figure


def coverage_figure(curves: StandoffCurves) -> Figure:
    """Draw Fig. 10: mean coverage of one loop over the ratio, one standard deviation over maps either way."""
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for n, (colour, mark, name, figures) in enumerate(
        (
            (MULTI, "o", "multi-fovea: N targets at once", curves.multi),
            (SINGLE, "s", "single-fovea, any one target: N is 0 or 1", curves.single_any),
            (FIXED, "^", "single-fovea, one fixed target (mean over which)", curves.single_fixed),
        )
    ):
        found = curve_band(figures)
        axes.errorbar(
            np.array(curves.ratios) + (n - 1) * 0.025,
            found.mean,
            yerr=found.sigma,
            fmt=f"-{mark}",
            color=colour,
            capsize=3.0,
            markersize=5.0,
            label=name,
        )
    axes.set(xlabel=RATIO, ylabel="coverage R = ∮ N dt of one loop")
    axes.set_title(f"mean of {curves.maps} maps, bars ± 1σ; t: normalised length of the loop", fontsize=10)
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=9, loc="upper left")
    return figure


def gap_figure(tight: StandoffCurves) -> Figure:
    """Draw the gaps of Figs. 9 and 10 over many maps, with the 95 % interval of each mean."""
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    area, rate = figure.subplots(1, 2)
    _gap(area, tight, tight.multi_m2 - tight.single_m2, MULTI, "multi − single")
    area.set(xlabel=RATIO, ylabel="gap of areas, m²")
    _gap(rate, tight, tight.multi - tight.single_fixed, FIXED, "multi − single, fixed target")
    _gap(rate, tight, tight.multi - tight.single_any, SINGLE, "multi − single, any target")
    rate.set(xlabel=RATIO, ylabel="gap of coverage")
    for axes in (area, rate):
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=9, loc="upper left")
    figure.suptitle(f"means of {tight.maps} maps, bands: their 95 % intervals", fontsize=10)
    return figure


def _interval(axes: Axes, curves: StandoffCurves, figures: F64, colour: str) -> None:
    found = curve_band(figures)
    if np.isfinite(found.half_95).all():
        axes.fill_between(
            curves.ratios, found.mean - found.half_95, found.mean + found.half_95, color=colour, alpha=0.3
        )


def _gap(axes: Axes, curves: StandoffCurves, gap: F64, colour: str, name: str) -> None:
    _interval(axes, curves, gap, colour)
    axes.plot(curves.ratios, gap.mean(axis=0), color=colour, label=name)


def _fit_label(fit: AreaFit) -> str:
    a, b, c = fit.quadratic
    return f"fit {a:.2f} x² {b:+.1f} x {c:+.1f} m², R² = {fit.r2:.5f}".replace("-", "−")
