"""Figures of the stand-off formulas: Monte Carlo beside Eqs. 10-13, success, depth error at D_min (Eq. 9)."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, NullLocator

from foveacam_pipeline.study.tradeoff.depth_error import FOVEA_PX_PER_DEG, WIDE_PX_PER_DEG, error_m
from foveacam_pipeline.study.visibility.checks import ProbabilityCheck
from foveacam_pipeline.study.visibility.curves import F64
from foveacam_pipeline.study.visibility.obstacles import (
    RandomObstacles,
    sample_success,
    success_probability,
    success_slope_per_m,
)
from foveacam_pipeline.study.visibility.plan_figures import patch_of
from foveacam_pipeline.study.visibility.regions import annulus
from foveacam_pipeline.study.visibility.standoff import (
    NearBound,
    StandoffRing,
    resolution_rad,
    resolving_range_m,
    standoff_ring,
)

SUCCESS_OCCUPANCIES = (0.0, 0.01, 0.05, 0.2)
SUCCESS_RADIUS_M = 0.3
SUCCESS_INNER_M, SUCCESS_OUTER_M = 5.0, 25.0
COLOURS = ("#0072B2", "#56B4E9", "#E69F00", "#D55E00")
FEATURE_M, FEATURE_PX = 0.01, 4.0
"""The feature that the rig's rings are shown for: 1 cm, resolved when it fills four pixels."""

NEAR_ERROR_PX = 1.0
"""Error of matching assumed for the depth error at D_min."""

SHOWN_INNER_M = 5.0
CAMERAS = (("wide", WIDE_PX_PER_DEG, "#D55E00"), ("fovea", FOVEA_PX_PER_DEG, "#0072B2"))


def camera_ring(px_per_deg: float, d_min_m: float, bound: NearBound = NearBound.INFLATED) -> StandoffRing:
    """Return the ring of a camera of Table 2 for the feature above, with its depth error at D_min."""
    error = error_m(d_min_m, px_per_deg, error_px=NEAR_ERROR_PX)
    return standoff_ring(d_min_m, camera_range_m(px_per_deg), near_error_m=error, bound=bound)


def camera_range_m(px_per_deg: float) -> float:
    """Return D_max of a camera for the feature above (Eq. 6)."""
    return resolving_range_m(FEATURE_M, resolution_rad(px_per_deg, pixels=FEATURE_PX))


def checks_figure(checks: Sequence[ProbabilityCheck]) -> Figure:
    """Draw the errors of the Monte Carlo estimates against Eqs. 10-13, in standard errors."""
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    axes = figure.subplots()
    names = {10: "Eq. 10, corridor", 11: "Eq. 11, clear sight", 12: "Eq. 12, success", 13: "Eq. 13, slope"}
    for colour, mark, (equation, name) in zip(COLOURS, "osD^", names.items(), strict=True):
        found = [(n, check.z) for n, check in enumerate(checks) if check.equation == equation]
        axes.plot(*np.array(found).T, mark, color=colour, markersize=5.0, label=name)
    for limit in (-3.0, 3.0):
        axes.axhline(limit, color="0.3", linestyle="--", linewidth=1.0)
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set(
        xlabel="number of the setting",
        ylabel="(Monte Carlo − closed form)\n/ standard error",
        ylim=(-4.0, 4.0),
    )
    axes.set_title(f"{checks[0].drawn.trials} trials a setting; dashed: 3 standard errors", fontsize=10)
    figure.legend(fontsize=9, loc="outside lower center", ncols=4)
    return figure


def success_figure(*, trials: int, seed: int) -> Figure:
    """Draw P_succ and its slope over D_max for several occupancies (Eqs. 12, 13), with Monte Carlo."""
    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    share, slope = figure.subplots(1, 2)
    domain_m2 = math.pi * SUCCESS_OUTER_M**2
    x_m = np.linspace(SUCCESS_INNER_M, SUCCESS_OUTER_M, 81)
    drawn_m = np.linspace(9.0, SUCCESS_OUTER_M, 5)
    for n, (occupancy, colour) in enumerate(zip(SUCCESS_OCCUPANCIES, COLOURS, strict=True)):
        clutter = RandomObstacles(occupancy=occupancy, radius_m=SUCCESS_RADIUS_M)
        share.plot(
            x_m, [_success(d_m, clutter, domain_m2) for d_m in x_m], color=colour, label=f"p = {occupancy:g}"
        )
        slope.plot(
            x_m, [100.0 * success_slope_per_m(d_m, clutter, domain_m2=domain_m2) for d_m in x_m], color=colour
        )
        rng = np.random.default_rng([seed, n])
        estimates = [
            sample_success(
                StandoffRing(inner_m=SUCCESS_INNER_M, outer_m=d_m),
                clutter,
                domain_m2=domain_m2,
                trials=trials,
                rng=rng,
            )
            for d_m in drawn_m
        ]
        share.errorbar(
            drawn_m,
            [each.value for each in estimates],
            yerr=[3.0 * each.sigma for each in estimates],
            fmt="o",
            color=colour,
            markersize=4.0,
            capsize=3.0,
        )
    share.set(xlabel="Dₘₐₓ, m", ylabel="probability of success P (Eq. 12)")
    slope.set(xlabel="Dₘₐₓ, m", ylabel="dP / dDₘₐₓ, % per m (Eq. 13)")
    for axes in (share, slope):
        axes.grid(visible=True, alpha=0.3)
    share.legend(fontsize=9, title=f"obstacles of {SUCCESS_RADIUS_M:g} m radius,\np of them per m²")
    figure.suptitle(
        f"Dₘᵢₙ = {SUCCESS_INNER_M:g} m, domain: a disc of {SUCCESS_OUTER_M:g} m; dots: {trials} "
        "random observers, ± 3 standard errors",
        fontsize=10,
    )
    return figure


def near_figure() -> Figure:
    """Draw the depth error at D_min, and its effect on the rings of wide and fovea (Eq. 9, Table 2)."""
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    (error, area), (change, scale) = figure.subplots(2, 2)
    for name, px_per_deg, colour in CAMERAS:
        d_max_m = camera_range_m(px_per_deg)
        x_m = np.geomspace(1.0, 100.0, 60)
        errors_m = [error_m(d_m, px_per_deg, error_px=NEAR_ERROR_PX) for d_m in x_m]
        error.loglog(x_m, errors_m, color=colour, label=f"{name}, {px_per_deg:g} px/°")
        inner_m = np.geomspace(1.0, 0.9999 * d_max_m, 400)
        plain = _areas_m2(px_per_deg, inner_m, NearBound.PLAIN)
        used = _areas_m2(px_per_deg, inner_m, NearBound.INFLATED)
        printed = _areas_m2(px_per_deg, inner_m, NearBound.AS_PRINTED)
        area.loglog(inner_m, used, color=colour, label=f"{name}: Dₘₐₓ = {d_max_m:.1f} m")
        change.semilogx(inner_m, 100.0 * (used / plain - 1.0), color=colour)
        change.semilogx(inner_m, 100.0 * (printed / plain - 1.0), ":", color=colour)
    error.set(ylabel="depth error ΔZ, m", title=f"depth error at Dₘᵢₙ, matching error {NEAR_ERROR_PX:g} px")
    area.set(ylabel="area of the ring, m²", ylim=(3.0, 5e5))
    area.set_title(f"ring for {1e3 * FEATURE_M:g} mm on {FEATURE_PX:g} px")
    change.set(
        ylabel="change of the area by ΔZ, %", ylim=(-25.0, 25.0), title="both signs of Eq. 9: Dₘᵢₙ ± ΔZ"
    )
    change.plot([], [], color="0.3", label="+ ΔZ, used here")
    change.plot([], [], ":", color="0.3", label="− ΔZ, printed")
    for axes in (error, area, change):
        axes.set_xlabel("Dₘᵢₙ, m")
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=8, handlelength=1.6, loc="lower left" if axes is change else "upper left")
        _plain_numbers(axes.xaxis)
    for axes in (error, area):
        _plain_numbers(axes.yaxis)
    _draw_to_scale(scale)
    for axes in (error, area, change, scale):
        axes.title.set_fontsize(10)
    return figure


def _draw_to_scale(axes: Axes) -> None:
    for _, px_per_deg, colour in reversed(CAMERAS):
        found = camera_ring(px_per_deg, SHOWN_INNER_M)
        axes.add_patch(patch_of(annulus((0.0, 0.0), found), color=colour, alpha=0.4, linewidth=0.0))
    reach_m = 1.05 * camera_range_m(FOVEA_PX_PER_DEG)
    axes.add_patch(Circle((0.0, 0.0), SHOWN_INNER_M, fill=False, color="black", linewidth=0.8))
    axes.set(xlim=(-reach_m, reach_m), ylim=(-reach_m, reach_m), aspect="equal", xlabel="x, m", ylabel="y, m")
    axes.set_title(f"to scale, Dₘᵢₙ = {SHOWN_INNER_M:g} m (black)")


def _plain_numbers(axis: Axis) -> None:
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def _areas_m2(px_per_deg: float, inner_m: F64, bound: NearBound) -> F64:
    return np.array([camera_ring(px_per_deg, d_m, bound).area_m2 for d_m in inner_m])


def _success(d_max_m: float, clutter: RandomObstacles, domain_m2: float) -> float:
    return success_probability(
        StandoffRing(inner_m=SUCCESS_INNER_M, outer_m=d_max_m), clutter, domain_m2=domain_m2
    )
