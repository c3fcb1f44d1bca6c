"""Diagram of how the mounts drifted while they were calibrated."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.mount_drift import S_PER_MIN, DriftRun, MountDrift

_DPI = 110
_LEAST_GAP_MIN, _GAP_SHARE = 0.1, 0.05
_LEAST_LABEL_PX = 0.05
ACROSS, DOWN, KNOCK = "#1f4e79", "#b03a2e", "#b9770e"


def drift_figure(drift: dict[Role, MountDrift], *, f_px: float) -> Figure:
    """Draw each eye's gaze against where it stood at the end of the run, fovea px, over the minutes.

    Runs stand one after the other, without the time between them: their clocks may differ. How far a run ends
    from the last one is written above it.
    """
    figure = Figure(figsize=(9.6, 3.8), dpi=_DPI, layout="constrained")
    panels = figure.subplots(1, len(drift), sharey=True, squeeze=False)[0]
    for axes, (role, mount) in zip(panels, drift.items(), strict=True):
        _draw_drift(axes, mount, f_px=f_px)
        axes.set_title(f"{role} eye: {f_px * mount.rad_per_minute:.2f} px a minute", fontsize=10)
        axes.set_xlabel("minutes of measuring before the end")
    panels[0].set_ylabel("gaze against the end of the run, fovea px")
    panels[0].legend(fontsize=8, frameon=False)
    return figure


def _draw_drift(axes: Axes, mount: MountDrift, *, f_px: float) -> None:
    """Draw all runs, the last one up to zero."""
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    axes.margins(y=0.15)  # room for what is written above
    end_min, gap_min = 0.0, max(_LEAST_GAP_MIN, _GAP_SHARE * mount.minutes)
    for before, run in reversed(list(pairwise([mount.runs[0], *mount.runs]))):
        _draw_drift_run(axes, run, end_min=end_min, f_px=f_px, named=run is mount.runs[-1])
        end_min -= run.minutes + gap_min
        if run is not mount.runs[0]:
            _draw_gap(axes, end_min + gap_min / 2.0, knocked=before.knocked)


def _draw_gap(axes: Axes, at_min: float, *, knocked: bool) -> None:
    """Draw what lies between two runs: time, or a knock."""
    colour, style = (KNOCK, "-") if knocked else ("0.8", ":")
    axes.axvline(at_min, color=colour, linewidth=0.7, linestyle=style)
    if knocked:
        axes.text(
            at_min,
            0.02,
            " knock",
            transform=axes.get_xaxis_transform(),
            fontsize=8,
            color=colour,
            rotation=90,
            ha="right",
            va="bottom",
        )


def _draw_drift_run(axes: Axes, run: DriftRun, *, end_min: float, f_px: float, named: bool) -> None:
    """Draw one run; `named`: with its lines in the legend."""
    minutes = end_min + (run.knots_s - run.knots_s[-1]) / S_PER_MIN
    gaze = f_px * np.column_stack([run.turn_rad[:, 1], -run.turn_rad[:, 0]])
    sigma = f_px * run.sigma_rad[:, ::-1]
    for column, (name, colour) in enumerate((("across", ACROSS), ("down", DOWN))):
        axes.errorbar(
            minutes,
            gaze[:, column] - gaze[-1, column],
            yerr=sigma[:, column],
            fmt="o-",
            ms=3,
            color=colour,
            label=name if named else None,
            capsize=2,
        )
    away_px = float(np.linalg.norm(gaze[-1]))
    if away_px > _LEAST_LABEL_PX:
        middle_min = float(minutes[0] + minutes[-1]) / 2.0
        axes.annotate(
            f"{away_px:.1f} px off",
            (middle_min, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, -4),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=8,
            color="0.3",
        )
